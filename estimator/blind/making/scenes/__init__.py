"""What is true of one case, from the tissue to the instruments, and what these then read."""
