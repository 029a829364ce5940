"""Recordings of other software, recognised so that they are named and not taken for a damaged session."""

from pathlib import Path

from daq.errors import RecordingError
from estimator.errors import InputError
from estimator.input_file import read_input_text

METADATA_FILE = "metadata.yaml"
METADATA_KEY = "rosbag2_bagfile_information"
_SUFFIXES = (".mcap", ".db3")
_ONLY_OWN = "only sessions that this software recorded are read; `retract import` reads those of others"


def require_no_foreign_bag(place: Path) -> None:
    """Refuse a rosbag2 folder, and a single file in the place of a session folder.

    Raises
    ------
    RecordingError
        It is one; the message says which.
    """
    if place.is_file():
        kind = "an MCAP file or a part of a rosbag2" if place.suffix in _SUFFIXES else "a file"
        raise RecordingError(f"{place}: is {kind}; name the folder of a session; {_ONLY_OWN}")
    if is_bag_folder(place):
        files = sorted(path.name for path in place.iterdir() if path.suffix in _SUFFIXES)
        raise RecordingError(
            f"{place}: is a rosbag2 ({', '.join([METADATA_FILE, *files[:3]])}) of other software; {_ONLY_OWN}"
        )


def is_bag_folder(place: Path) -> bool:
    """Tell whether a folder has the description of a rosbag2."""
    try:
        return METADATA_KEY in read_input_text(place / METADATA_FILE)
    except InputError:
        return False
