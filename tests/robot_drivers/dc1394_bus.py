"""An emulated FireWire bus: libdc1394's functions from ``dc1394_emulator.c``, built with the system's compiler."""

import atexit
import ctypes
import functools
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

_SOURCE = Path(__file__).with_name("dc1394_emulator.c")


@functools.cache
def emulated_library() -> str:
    """Build the library once and return its path; skips the test where there is no compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler to build the emulated libdc1394 with")
    folder = tempfile.mkdtemp(prefix="emulated-dc1394-")
    atexit.register(shutil.rmtree, folder)
    path = Path(folder) / "libdc1394_emulator.so"
    subprocess.run([compiler, "-std=gnu11", "-shared", "-fPIC", "-o", path, _SOURCE], check=True)
    return str(path)


def fresh_bus() -> ctypes.CDLL:
    """Return the functions that make its cameras misbehave, after a reset: one sound camera."""
    bus = ctypes.CDLL(emulated_library())
    bus.fake_stamp_offset_ms.argtypes = [ctypes.c_int64]
    bus.fake_reset()
    return bus
