"""Faults of devices and their links: lost and back, loss, reordering, rubbish, saturation, stops of the controller."""

import time

from daq.faults.bench import CAMERA_SILENCE_S, FORCE, LEFT, RIGHT, ROBOT, SILENCE_S, WATCHDOG_S
from daq.faults.fault import Act, Expectation, Fault, Scene
from robot_drivers.abb.emulator.settings import ControllerFaults
from robot_drivers.ati.emulator import Faults as SensorFaults
from robot_drivers.cameras.emulator import CameraFaults

REACTION_S = 0.3
"""From the moment when a fault can be known to the tool's standstill."""

_SHARE = 0.05
_SHORTEST_S, _LONGEST_S = 1.2, 2.2  # of an absence

_HEALTHY = {FORCE: SensorFaults(), ROBOT: ControllerFaults(), LEFT: CameraFaults(), RIGHT: CameraFaults()}
_FAULTS = {FORCE: SensorFaults, ROBOT: ControllerFaults, LEFT: CameraFaults, RIGHT: CameraFaults}


def inject(device: str, **faults: object) -> Act:
    """Return what lets faults of one emulator begin."""

    def act(scene: Scene) -> None:
        scene.bench.order(device, "inject", _FAULTS[device](**faults))

    return act


def heal(*devices: str) -> Act:
    """Return what ends the faults of emulators."""

    def act(scene: Scene) -> None:
        for device in devices:
            scene.bench.order(device, "inject", _HEALTHY[device])

    return act


def _gone(device: str, how: str) -> Act:
    """Return what takes a device away at once, for a while; ``how`` is unplug or restart."""

    def act(scene: Scene) -> None:
        away_s = scene.chance.uniform(_SHORTEST_S, _LONGEST_S)
        inject(device, **{f"{how}_at_s": 0.0, f"{how}_for_s": away_s})(scene)

    return act


def _back(device: str) -> Act:
    """Return what waits until a device that is gone for a while is back, and ends the fault."""

    def act(scene: Scene) -> None:
        time.sleep(_LONGEST_S)
        heal(device)(scene)

    return act


def _drop_images(scene: Scene) -> None:
    for side in (LEFT, RIGHT):
        scene.bench.order(side, "drop", 3)


def _at_the_controller(*keys: str) -> Act:
    """Return what presses these keys at the controller."""

    def act(scene: Scene) -> None:
        for key in keys:
            scene.bench.order(ROBOT, key)

    return act


def _lost(device: str, how: str, within_s: float, right: str, reason: str, tells_s: float) -> Fault:
    verb = {"unplug": "unplugged", "restart": "without power"}[how]
    expected = Expectation("held", within_s + REACTION_S, reason)
    return Fault(
        f"{device} {verb} and back",
        right,
        expected,
        _gone(device, how),
        _back(device),
        tells_s=tells_s + REACTION_S,
    )


_SILENT = "No sample tells what the robot does to the tissue, so the guard holds at the limit of silence."
_CUT = "The controller stops by its own watchdog, for nobody can tell it to; the client finds silence and gives up."
_DARK = "The guard holds the robot, for a retraction without images cannot be evaluated."

LOST_AND_BACK = (
    _lost(FORCE, "unplug", SILENCE_S, _SILENT, "force sensor", SILENCE_S),
    _lost(FORCE, "restart", SILENCE_S, _SILENT, "force sensor", SILENCE_S),
    _lost(ROBOT, "unplug", WATCHDOG_S, _CUT, "robot", SILENCE_S),
    _lost(
        ROBOT, "restart", 0.1, "The arm stops with its power; the client finds it gone.", "robot", SILENCE_S
    ),
    _lost(LEFT, "unplug", CAMERA_SILENCE_S, _DARK, "camera", CAMERA_SILENCE_S),
    _lost(RIGHT, "restart", CAMERA_SILENCE_S, _DARK, "camera", CAMERA_SILENCE_S),
)

_GAPS = (
    "Going on is right: single samples are missing, the counter tells which, the guard sees the others in time. "
    "The recording counts them and says so; those that come late have their own place and time."
)

LOSS = (
    Fault(
        "force sensor: 5 % lost, 5 % overtaken",
        _GAPS,
        Expectation("goes on", reason="force sensor: .* lost"),
        inject(FORCE, loss=_SHARE, reordering=_SHARE),
        heal(FORCE),
    ),
    Fault(
        "robot: 5 % lost, 5 % overtaken",
        _GAPS,
        Expectation("goes on", reason="robot: .* lost"),
        inject(ROBOT, egm_loss=_SHARE, egm_reorder=_SHARE),
        heal(ROBOT),
        tells_s=0.8,  # of 200 poses one at least is lost, but for one case in 30 000
    ),
    Fault(
        "cameras: images lost",
        _GAPS + " Three images in a row of each camera: 5 % of a short session.",
        Expectation("goes on", reason="camera .* lost"),
        _drop_images,
        tells_s=0.8,
    ),
)

_STRANGE = (
    "Going on is right: what cannot be understood is left out and counted, nothing of it is taken for a sample, and "
    "the recording says so."
)

RUBBISH = (
    Fault(
        "force sensor: rubbish and cut datagrams",
        _STRANGE,
        Expectation("goes on", reason="force sensor: .* not understood"),
        inject(FORCE, rubbish=_SHARE, truncation=_SHARE),
        heal(FORCE),
    ),
    Fault(
        "robot: rubbish and cut datagrams",
        _STRANGE,
        Expectation("goes on", reason="robot: .* not understood"),
        inject(ROBOT, egm_rubbish=_SHARE, egm_truncation=_SHARE),
        heal(ROBOT),
    ),
)

STOPS = (
    Fault(
        "force sensor saturated",
        "The load is unknown and may be beyond every limit: held at once.",
        Expectation("held", REACTION_S, "saturat"),
        inject(FORCE, saturated=True),
        heal(FORCE),
    ),
    Fault(
        "robot stopped by its controller",
        "The arm stands by itself; the session ends and says that it was not the guard.",
        Expectation("held", REACTION_S, "motion program|stopped|controller"),
        _at_the_controller("stop_program"),
        _at_the_controller("start_program"),
    ),
    Fault(
        "motors off",
        "As after an emergency stop: the arm stands; it moves again only after motors, program and release.",
        Expectation("held", REACTION_S, "motors|motion program|stopped|controller"),
        _at_the_controller("motors_off"),
        _at_the_controller("motors_on", "start_program"),
    ),
    Fault(
        "EGM falls silent",
        "The robot obeys but nobody sees where it is: held at the limit of silence.",
        Expectation("held", SILENCE_S + REACTION_S, "robot"),
        inject(ROBOT, egm_loss=1.0),
        heal(ROBOT),
        tells_s=SILENCE_S + REACTION_S,
    ),
)
