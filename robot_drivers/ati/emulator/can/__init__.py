"""Emulated devices on a CAN bus, and the adapter between it and a serial port."""
