"""From device clocks to the host clock, after the fact and without touching what was recorded."""
