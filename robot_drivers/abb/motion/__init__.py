"""Where the arm is and what it may do: poses, kinematics, limits, straight lines, arrival."""
