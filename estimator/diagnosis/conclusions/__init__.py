"""What is said of a comparison: findings, places, next experiments, open questions."""
