"""Drivers of the laboratory's devices, one protocol per kind of device, each with an emulator at the wire."""
