"""What a diagnosed pattern is told as: in words, drawn, and as a page."""
