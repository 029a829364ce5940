"""Work beside the interface thread: in a thread, in a process of its own, or in one that remembers."""
