"""Faults of this computer and of programs beside: disk, recorder, window, estimator, an edited rig file."""

import subprocess
import time

from daq.faults import linux_only
from daq.faults.clients import CommandClient, WindowClient
from daq.faults.device_faults import REACTION_S
from daq.faults.fault import Expectation, Fault, Scene
from daq.lifeline import with_lifeline

_CLIENT_SILENCE_S = 0.85  # the limit of 0.8 s, and how often it is looked at
_FROZEN_S = 2.5
_DISK_S = 0.55  # what is written reaches the disk twice a second
_BROKEN_RIG = "this is = = no rig file\n"


def _recorder_id(scene: Scene) -> int:
    assert isinstance(scene.client, WindowClient)
    return scene.client.recorder_id


def _window_id(scene: Scene) -> int:
    assert isinstance(scene.client, CommandClient)
    return scene.client.window_id


def _fill_disk(scene: Scene) -> None:
    linux_only.fill_disk(_recorder_id(scene))


def _make_room(scene: Scene) -> None:
    linux_only.make_room(_recorder_id(scene))


def _kill_recorder(scene: Scene) -> None:
    linux_only.kill(_recorder_id(scene))


def _kill_window(scene: Scene) -> None:
    linux_only.kill(_window_id(scene))


def _freeze_window(scene: Scene) -> None:
    linux_only.freeze(_window_id(scene))
    time.sleep(_FROZEN_S)
    linux_only.thaw(_window_id(scene))


def _kill_estimator(scene: Scene) -> None:
    """Have another program estimate, and kill it."""
    command = with_lifeline("daq.cli", "estimate", str(scene.session), "--json")
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=quiet, stderr=quiet) as estimator:
        scene.client.attend(scene.chance.uniform(0.0, 1.0))
        estimator.kill()


def _break_rig_file(scene: Scene) -> None:
    scene.bench.rig_path.write_text(_BROKEN_RIG, encoding="utf-8")


def _restore_rig_file(scene: Scene) -> None:
    scene.bench.write_rig_file()


PROGRAMS = (
    Fault(
        "disk full",
        "What cannot be kept need not be pulled: held; what was written stays, and can be recovered.",
        Expectation("held", _DISK_S + REACTION_S, "cannot be (written|sealed)"),
        _fill_disk,
        _make_room,
        tells_s=_DISK_S + REACTION_S,
    ),
    Fault(
        "recorder killed",
        "The controller stops as soon as the connection breaks; the window says that the process has died, and "
        "`retract recover` saves what was acknowledged.",
        Expectation("held", REACTION_S, "process (has died|is gone)"),
        _kill_recorder,
    ),
    Fault(
        "window killed",
        "The acquisition process hears that its client is gone, or on a busy machine, where a killed program takes its "
        "time to go, that it is silent. It holds, and seals the recording with that reason. The window is `retract "
        "record`, a program of its own.",
        Expectation("held", _CLIENT_SILENCE_S + REACTION_S, "controlling program (is gone|has been silent)"),
        _kill_window,
        tells_s=_CLIENT_SILENCE_S + REACTION_S,
        client=CommandClient,
    ),
    Fault(
        "window frozen",
        "A client that does not show that it is alive for 0.8 s may be a window without an operator: held.",
        Expectation("held", _CLIENT_SILENCE_S + REACTION_S, "controlling program has been silent"),
        _freeze_window,
        tells_s=_CLIENT_SILENCE_S + REACTION_S,
        client=CommandClient,
    ),
    Fault(
        "estimator killed",
        "Going on is right: estimating and recording share nothing; no word of it belongs into the recording.",
        Expectation("goes on", marked=False),
        _kill_estimator,
        tells_s=1.3,
    ),
    Fault(
        "rig file edited meanwhile",
        "Going on is right: a session keeps to the rig that it began with, and its folder holds a copy of that one.",
        Expectation("goes on", marked=False),
        _break_rig_file,
        _restore_rig_file,
    ),
)
