"""Tables I to V and section VI of the paper: its set-ups, its figures, and both beside ours."""
