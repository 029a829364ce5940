"""What the cameras of a rig file and its keys for measuring beads with them must be."""

from collections.abc import Collection, Sequence

from daq.devices import MOST_CAMERAS
from daq.errors import RigError
from daq.files.toml_tables import TomlFile

_OF_ONE_CAMERA = ("planar_view", "depth_view")


def check_cameras(file: TomlFile, names: Sequence[str], measured_by: Collection[str]) -> None:
    """Refuse what does not go together.

    Parameters
    ----------
    names : of the cameras
    measured_by : the keys of the file that say how beads are measured with them: stereo_calibration, planar_view,
        depth_view

    Raises
    ------
    RigError
        Naming file, line and key, and what is allowed there.
    """
    if not 1 <= len(names) <= MOST_CAMERAS:
        raise file.mistake(("cameras",), f"are {len(names)}; a rig has one to {MOST_CAMERAS}")
    for number, name in enumerate(names):
        if name in names[:number]:
            which = "the first" if names.index(name) == 0 else "an earlier"
            raise file.mistake(("cameras", number, "name"), f"must differ from {which} camera's, {name!r}")
    if len(names) == 1 and "stereo_calibration" in measured_by:
        raise file.mistake(("stereo_calibration",), "is of two cameras, and the rig has one; leave it out")
    for key in _OF_ONE_CAMERA:
        if len(names) > 1 and key in measured_by:
            raise file.mistake((key,), f"is of one camera, and the rig has {len(names)}; leave it out")
    if set(_OF_ONE_CAMERA) <= set(measured_by):
        raise file.mistake(
            ("planar_view",), "is of a camera without depth, and there is a depth_view; leave it out"
        )
    if len(names) > 1 and "stereo_calibration" not in measured_by:
        raise file.mistake(
            (), f"lacks the key stereo_calibration, of the cameras {names[0]!r} and {names[1]!r}"
        )


def no_depth(file: TomlFile, name: str) -> RigError:
    """Return the refusal of a depth_view of a camera that sends no depth."""
    return file.mistake(
        ("depth_view",),
        f"is of a camera that sends depth, and {name!r} by its settings does not; a GenICam camera does with "
        "depth = true",
    )
