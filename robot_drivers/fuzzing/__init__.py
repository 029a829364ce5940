"""Fuzzing of everything that reads bytes of a device: ``python -m robot_drivers.fuzzing --help``."""
