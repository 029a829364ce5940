"""What a camera sees of the phantom, and of a printed board."""
