"""ATI force sensors on a serial line: framing without a sync byte, and what their drivers share."""
