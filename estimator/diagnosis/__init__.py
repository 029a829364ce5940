"""Where the gap between model and measurement lies, which effect causes it, and how far it shrinks with it."""
