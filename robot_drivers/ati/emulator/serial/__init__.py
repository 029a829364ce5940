"""Emulated devices on serial lines: the far end of the line, and who answers there."""
