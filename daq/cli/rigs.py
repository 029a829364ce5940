"""Rig files on the command line, and the word that stands for the virtual one."""

import argparse
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from daq.rig import Rig, read_rig
from daq.timing.laboratory_time import in_the_time_of
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.standard import standard_settings

VIRTUAL = "virtual"


def add_rig(parser: argparse.ArgumentParser) -> None:
    """Add the positional argument for a rig."""
    parser.add_argument("rig", metavar="RIG", help=f'rig file, or "{VIRTUAL}" for an emulated laboratory')


@contextmanager
def opened_rig(name: str) -> Iterator[Rig]:
    """Read a rig file; for the virtual rig, run it as long as the context lasts."""
    if name != VIRTUAL:
        rig = read_rig(Path(name))
        with in_the_time_of(rig):
            yield rig
        return
    with (
        tempfile.TemporaryDirectory(prefix="virtual-rig-") as folder,
        virtual_rig(Path(folder), standard_settings()) as running,
    ):
        yield read_rig(running.rig_path)
