"""Session folders: what is written while devices stream, how it is sealed, recovered and read back."""
