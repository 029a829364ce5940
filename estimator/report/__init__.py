"""Pages that a person understands at a glance: one file, no network, light, dark and on paper."""
