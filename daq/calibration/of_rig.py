"""Which calibrations are made of a rig, by its cameras: an only one is calibrated otherwise than a stereo pair."""

from daq.calibration_files.outcome import KINDS, Kind
from daq.errors import CalibrationError
from daq.rig import Rig


def kinds_of(rig: Rig) -> tuple[Kind, ...]:
    """Return the kinds of calibration that are made of a rig."""
    return tuple(kind for kind in KINDS if not why_not(kind, rig))


def why_not(kind: Kind, rig: Rig) -> str:
    """Return in one line why a kind of calibration is not made of a rig, and what is instead; empty if it is."""
    cameras = len(rig.cameras)
    if cameras > 1 and kind == "camera":
        return (
            f"camera: is of the only camera of a rig, and {rig.name!r} has {cameras}, two of them a stereo pair; "
            "calibrate stereo"
        )
    if cameras == 1 and kind in ("cameras", "stereo"):
        return f"{kind}: is of the two cameras of a stereo pair, and {rig.name!r} has one; calibrate camera"
    if cameras == 1 and kind == "robot":
        return (
            f"robot: sees by a stereo pair where the marker on the gripper is, and {rig.name!r} has one camera; write "
            "T_base_tissue into the rig file"
        )
    return ""


def require_kind(kind: Kind, rig: Rig) -> None:
    """Refuse a kind of calibration that is not made of a rig; raises CalibrationError."""
    if why := why_not(kind, rig):
        raise CalibrationError(why)
