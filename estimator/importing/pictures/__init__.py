"""What a mapping makes of a source, drawn: the phantom with its grasp and beads, the path, the forces."""
