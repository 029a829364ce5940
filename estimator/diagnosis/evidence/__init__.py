"""How probable the measurements are under a hypothesis, and from evidences to probabilities."""
