"""The window as an operator has it: on an X display, which is a server of this test's own."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtGui import QImage
from session_endings import stop_of

from daq.recording.folder import read_info
from daq.recording.reader import Recording

PROGRAM = Path(__file__).with_name("x_display_program.py")

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="X displays are those of Linux")


@pytest.fixture
def display() -> Iterator[str]:
    """The name of a display that nobody else has; Xvfb chooses it."""
    if shutil.which("Xvfb") is None:
        pytest.fail("Xvfb is missing; install it: sudo apt-get install xvfb")
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1600x1000x24", "-nolisten", "tcp"],
        pass_fds=(write,),
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    try:
        with os.fdopen(read) as told:
            yield f":{told.readline().strip()}"
    finally:
        server.terminate()
        server.wait()


def colours_of(picture: Path) -> dict[int, int]:
    """How many pixels of a picture have each colour, as 0xRRGGBB."""
    image = QImage(str(picture)).convertToFormat(QImage.Format.Format_RGB32)
    pixels = np.frombuffer(image.constBits(), np.uint32).reshape(image.height(), -1) & 0xFFFFFF
    found, counts = np.unique(pixels, return_counts=True)
    return dict(zip(found.tolist(), counts.tolist(), strict=True))


def test_a_retraction_is_recorded_shown_and_stopped_on_an_x_display(
    rig_path: Path, display: str, tmp_path: Path
) -> None:
    environment = {
        **os.environ,
        "DISPLAY": display,
        "QT_QPA_PLATFORM": "xcb",
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
    }
    command = [sys.executable, str(PROGRAM), str(rig_path), str(tmp_path / "sessions"), str(tmp_path)]
    window = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert window.returncode == 0, window.stderr
    told = json.loads(window.stdout.splitlines()[-1])
    assert told["platform"] == "xcb"
    assert told["words"].startswith("held: ")

    session = Path(told["session"])
    assert read_info(session).state == "sealed"
    stop_of(session)
    assert len(Recording(session).force) > 500

    moving, held = colours_of(tmp_path / "moving.png"), colours_of(tmp_path / "held.png")
    for colours in (moving, held):
        assert len(colours) > 200  # a blank screen has one
        assert max(colours.values()) < 0.8 * sum(colours.values())
    assert moving != held
