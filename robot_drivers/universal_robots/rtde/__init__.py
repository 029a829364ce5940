"""Real-Time Data Exchange: its packages on the wire, a connection, the stream of what the controller tells."""
