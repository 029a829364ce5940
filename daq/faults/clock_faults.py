"""Clocks of devices that jump or drift in the middle of a session.

The wall clock of this computer is not touched: it belongs to all its programs. What the drivers do when it is stepped
is held by the tests of the receiver.
"""

import time

from daq.faults.bench import FORCE, LEFT, RIGHT, ROBOT, SILENCE_S
from daq.faults.device_faults import REACTION_S
from daq.faults.fault import Act, Expectation, Fault, Scene

_DRIFT_PPM = 500.0
_LONGEST_BACK_S = 5.0

_AHEAD = (
    "Going on is right: no sample is missing and the guard goes by the host's clock. The instants before and after the "
    "jump must be estimated apart, and the recording says that the clock jumped."
)
_SLOW = "Going on is right: the clock is mapped onto the host's, whatever its rate; nothing has to be said."


def _jump(*devices: str, shortest_s: float, longest_s: float) -> Act:
    def act(scene: Scene) -> None:
        jump_s = scene.chance.uniform(shortest_s, longest_s)
        for device in devices:
            scene.bench.order(device, "disturb_clock", jump_s, 0.0)

    return act


def _catch_up(scene: Scene) -> None:
    time.sleep(_LONGEST_BACK_S)


def _drift(*devices: str) -> Act:
    def act(scene: Scene) -> None:
        drift_ppm = scene.chance.choice((-_DRIFT_PPM, _DRIFT_PPM))
        for device in devices:
            scene.bench.order(device, "disturb_clock", 0.0, drift_ppm)

    return act


def _keep_pace(*devices: str) -> Act:
    """Return what ends a drift; what the clocks have gained stays."""

    def act(scene: Scene) -> None:
        for device in devices:
            scene.bench.order(device, "disturb_clock", 0.0, 0.0)

    return act


CLOCKS = (
    Fault(
        "clock of the force sensor jumps ahead",
        "Going on is right: the sensor's instants rest on its counter. Its driver finds the two apart, begins anew and "
        "says so. (By less than 2.3 s it could be a gap in the stream; that changes no instant either.)",
        Expectation("goes on", reason="force sensor: .* anew"),
        _jump(FORCE, shortest_s=2.5, longest_s=6.0),
    ),
    Fault(
        "clock of the robot jumps ahead",
        _AHEAD,
        Expectation("goes on", reason="robot: .*clock", resets=frozenset({"robot"})),
        _jump(ROBOT, shortest_s=0.2, longest_s=5.0),
        from_s=0.5,
        tells_s=0.8,
    ),
    Fault(
        "clock of the robot jumps back",
        "Number and clock contradict each other, so the driver takes nothing until the clock is where it was; the "
        "guard holds for that silence. The next session waits for as long.",
        Expectation("held", SILENCE_S + REACTION_S, "robot"),
        _jump(ROBOT, shortest_s=-_LONGEST_BACK_S, longest_s=-3.0),
        _catch_up,
        tells_s=SILENCE_S + REACTION_S,
    ),
    Fault(
        "clock of the cameras jumps",
        _AHEAD,
        Expectation("goes on", reason="camera .*clock", resets=frozenset({"camera left", "camera right"})),
        _jump(LEFT, RIGHT, shortest_s=0.3, longest_s=5.0),
        from_s=0.5,
        tells_s=0.8,
    ),
    Fault(
        "all clocks drift",
        _SLOW,
        Expectation("goes on", marked=False),
        _drift(FORCE, ROBOT, LEFT, RIGHT),
        _keep_pace(FORCE, ROBOT, LEFT, RIGHT),
    ),
)
