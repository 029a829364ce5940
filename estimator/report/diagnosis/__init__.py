"""The report of a diagnosis: one page that a person understands at a glance, and its summary for the terminal."""
