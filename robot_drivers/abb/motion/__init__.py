"""Where an IRB 140 is and what it may do: kinematics, limits, tool data."""
