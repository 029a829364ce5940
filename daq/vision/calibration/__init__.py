"""Cameras and the stereo pair calibrated from images of a ChArUco board."""

from daq.vision.calibration.bundle import BoardPair
from daq.vision.calibration.lens import LensCalibration, calibrate_lens
from daq.vision.calibration.pair import CalibrationReport, calibrate

__all__ = ["BoardPair", "CalibrationReport", "LensCalibration", "calibrate", "calibrate_lens"]
