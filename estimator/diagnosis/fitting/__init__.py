"""A hypothesis compared with the measurements, and its best parameters."""
