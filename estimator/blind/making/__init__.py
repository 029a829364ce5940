"""Makes sealed cases with a simulator of its own, which shares no mechanics with the estimator it is to test."""
