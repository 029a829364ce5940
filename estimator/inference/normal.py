"""The normal distribution."""

Z95 = 1.959963984540054
"""Within so many standard deviations of the mean lie 95 %."""
