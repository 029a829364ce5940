"""Force sensors on a serial line: the port, framing, a receiver, and what their drivers share."""
