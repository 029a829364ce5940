"""The emulated laboratory that the window runs, with what is mounted in it."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from daq.virtual_rig.launch import VirtualRig, virtual_rig
from daq.virtual_rig.standard import calibration_settings, standard_settings
from gui.rig.laboratory import STANDARD, Wanted


@contextmanager
def run_emulators(wanted: Wanted) -> Iterator[VirtualRig]:
    """Run it with the phantom of the paper, or with what a kind of calibration needs.

    Raises
    ------
    SessionError
        Its processes did not start.
    """
    mounted = standard_settings() if wanted.mounted == STANDARD else calibration_settings(wanted.mounted)
    settings = replace(mounted, cameras=wanted.cameras, depth=wanted.depth)
    with (
        tempfile.TemporaryDirectory(prefix="virtual-rig-") as folder,
        virtual_rig(Path(folder), settings, wanted.beside_real_devices) as running,
    ):
        yield running
