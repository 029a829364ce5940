"""What the gripper feels and where the beads are: phantoms, and the world between the devices."""
