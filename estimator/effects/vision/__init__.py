"""From the beads to their recorded positions: the cameras' frame, then the tracks."""
