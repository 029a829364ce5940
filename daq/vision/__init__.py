"""Stereo vision of the fiducials: camera model, bead detection, triangulation, identity, calibration."""
