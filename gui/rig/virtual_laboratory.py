"""The emulated laboratory that the window runs, with what is mounted in it."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from daq.virtual_rig.launch import VirtualRig, virtual_rig
from daq.virtual_rig.standard import calibration_settings, standard_settings
from gui.rig.laboratory import STANDARD


@contextmanager
def run_emulators(mounted: str, in_real_time: bool) -> Iterator[VirtualRig]:
    """Run it with the phantom of the paper, or with what a kind of calibration needs; alone, or beside real devices.

    Raises
    ------
    SessionError
        Its processes did not start.
    """
    settings = standard_settings() if mounted == STANDARD else calibration_settings(mounted)
    with (
        tempfile.TemporaryDirectory(prefix="virtual-rig-") as folder,
        virtual_rig(Path(folder), settings, in_real_time) as running,
    ):
        yield running
