"""From measurements to parameters with their uncertainty."""
