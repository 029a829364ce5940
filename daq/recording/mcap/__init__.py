"""The MCAP file as it is written: chunks, message types, and a log that grows by whole chunks."""
