"""The far end of a serial line: a device that runs in real time, and what goes wrong on its way."""
