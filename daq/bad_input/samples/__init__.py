"""Valid files of every kind, small ones: what damage is done to."""
