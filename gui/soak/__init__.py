"""The window for a long time at full load: ``python -m gui.soak --help``."""
