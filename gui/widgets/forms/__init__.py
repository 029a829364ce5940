"""What is entered and chosen: parameters, trials, sessions, sources, the queue."""
