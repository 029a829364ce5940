"""From the reported pose to the tissue: what the robot does, then what the gripper does."""
