"""Cameras: drivers for OpenCV's sources and FireWire, the frame information that a camera embeds, and an emulator."""
