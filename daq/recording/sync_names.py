"""Bringing the names of files to the disk."""

import os
import sys
from pathlib import Path


def sync_names(folder: Path) -> None:
    """Bring the names of files in a folder, and its own, to the disk, where the system lets a program ask for it."""
    if sys.platform != "win32":
        for place in (folder, folder.parent):
            descriptor = os.open(place, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
