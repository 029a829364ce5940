"""Has the diagnosis answer sealed cases, and tells how well it does."""
