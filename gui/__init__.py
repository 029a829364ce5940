"""The operator's window over the laboratory; no other room imports it."""
