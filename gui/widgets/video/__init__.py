"""Live and recorded images with the beads in them."""
