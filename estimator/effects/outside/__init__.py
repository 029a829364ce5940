"""What else happens to a rig, without a label of its own: it is recognised as something unknown."""
