"""The errors that the laboratory raises on purpose; every message is one line: what, where, what to do.

DaqError
├── RigError              a rig file that cannot be right (also ValueError)
├── RecordingError        a session folder that cannot be written, read or sealed
├── SynchronisationError  a recording that cannot be turned into an experiment
├── TrajectoryError       a trajectory that cannot be right (also ValueError)
├── CalibrationError      a calibration that cannot be made, kept or used
├── VisionError           images or calibration targets that cannot be used (daq.vision.errors)
├── MotionLimitError      a trajectory that a limit forbids; nothing has moved
└── SessionError          a session that cannot begin or go on
    └── SoftwareStopError the guard stopped the robot; motion needs an explicit release
"""


class DaqError(Exception):
    """Base of everything that the laboratory raises on purpose."""


class RigError(DaqError, ValueError):
    """A rig file that cannot be used as it stands."""


class RecordingError(DaqError):
    """A session folder that cannot be written, read or sealed."""


class SynchronisationError(DaqError):
    """A recording that lacks what an experiment needs."""


class TrajectoryError(DaqError, ValueError):
    """A trajectory whose parameters cannot be right."""


class CalibrationError(DaqError):
    """A calibration whose data do not suffice, or that cannot be kept or used."""


class MotionLimitError(DaqError):
    """A trajectory that leaves the limits of the rig, found before anything moved."""


class SessionError(DaqError):
    """A session that cannot begin or go on."""


class SoftwareStopError(SessionError):
    """The guard has stopped the robot in the middle of a session."""
