"""Two entries to the challenge, written from the documented files alone: thresholds on residuals, and a classifier."""
