"""Every form of every effect that the maker knows, and effects that no label means."""
