"""What the measurements do not state of their noise, and the covariance that it makes."""
