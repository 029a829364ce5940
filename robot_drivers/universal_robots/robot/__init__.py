"""The arm as a robot: kinematics, limits, the servo program's registers, motion."""
