"""Cameras: the OpenCV driver, the frame information that a camera embeds in its pixels, and an emulator."""
