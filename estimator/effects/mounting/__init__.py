"""How the phantom is held, and what lies around it: anchors, grasp, table, gravity."""
