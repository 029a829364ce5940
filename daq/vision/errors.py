"""What the stereo vision raises on purpose; every message is one line: what, where, what to do."""

from daq.errors import DaqError


class VisionError(DaqError):
    """Images from which the fiducials, or the cameras' calibration, cannot be told."""
