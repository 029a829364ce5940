"""The RAPID server of ``rapid/``: its frames, the command connection and the state stream."""
