"""Finding the messages of an MCAP file, whatever state it is in."""
