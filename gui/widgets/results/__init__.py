"""What a diagnosis, an estimation or a calibration came to."""
