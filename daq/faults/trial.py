"""One complete session with one fault, and everything that is known of it afterwards."""

import random
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from daq.errors import SessionError
from daq.faults.bench import ROBOT, Bench, TruePath
from daq.faults.clients import Client
from daq.faults.fault import Fault, Scene
from daq.faults.linux_only import load_average
from daq.progress import silent
from daq.recording.reader import Recording
from daq.recording.recovery import recover_session
from daq.session_report import report_session
from daq.trajectories import Retraction
from daq.virtual_rig.layout import REST_TOOL
from robot_drivers.clock import host_time_ns

_STILL_M = 2e-5  # less than this between two cycles' places is noise of standing
_MOVE_OVERHEAD_S = 0.1
_SETTLED_S = 0.3


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of one session.

    Attributes
    ----------
    fault, seed, run : which one
    instant_s : of the fault, from when samples were written
    moved_for_s : from the fault to the last cycle in which the tool moved, by the log of the emulated arm; 0 where it
        did not
    way_m : how far from rest the tool came
    acknowledged, found : samples of each stream that were said to be written, and that are in the folder
    told : what the client was told of the end, as it was told; "" for a session that ended well
    state : of the folder, as the session left it
    problems : that the folder tells
    resets : of each stream's clock that the session's report finds
    late_s : median delay of each stream's receive stamps over its estimated instants
    next_failure : why the next session failed, "" for one that ended well
    load : of the machine over the last minute
    seconds : that the run took
    """

    fault: str
    seed: int
    run: int
    instant_s: float
    moved_for_s: float
    way_m: float
    acknowledged: dict[str, int]
    found: dict[str, int]
    told: str
    state: str
    problems: tuple[str, ...]
    resets: dict[str, int]
    late_s: dict[str, float]
    next_failure: str
    load: float
    seconds: float


def nominal_s(motion: Retraction) -> float:
    """Return how long a retraction takes, from the beginning of its recording."""
    steps = motion.trajectory().steps
    standing_s = sum(step.settle_s + step.measure_s for step in steps)
    moving_s = motion.steps * motion.step_length / motion.speed.linear
    return standing_s + moving_s + _MOVE_OVERHEAD_S * motion.steps


def carry_out(bench: Bench, client: Client, fault: Fault, folder: Path, seed: int, run: int) -> Outcome:
    """Carry out one session and the next one in ``folder``, an existing one.

    Bench and client may have been through other faults before: a laboratory does not begin anew after each either.

    Raises
    ------
    DaqError
        The campaign itself cannot go on: a session did not begin without any fault, or did not end.
    """
    began = time.monotonic()
    chance = random.Random(f"{seed} {run}")
    session = folder / "session"
    instant_s = chance.uniform(fault.from_s, nominal_s(client.motion) - fault.tells_s)
    begun_ns = client.begin(session)
    if client.attend(max(0.0, instant_s - (host_time_ns() - begun_ns) * 1e-9)):
        raise SessionError(
            "the session of the campaign has ended before its fault came; the computer is too busy"
        )
    acknowledged, struck_ns = client.acknowledged(), host_time_ns()
    scene = Scene(bench, client, session, chance)
    fault.strike(scene)
    told = client.wait_for_end()
    acknowledged |= client.acknowledged()
    time.sleep(_SETTLED_S)
    path = bench.path(struck_ns)
    fault.mend(scene)
    state, recording = _opened(session)
    found, resets, late_s = _look(recording)
    next_failure = _next(bench, client, folder)
    return Outcome(
        fault=fault.label,
        seed=seed,
        run=run,
        instant_s=(struck_ns - begun_ns) * 1e-9,
        moved_for_s=moved_for_s(path, struck_ns),
        way_m=way_m(path),
        acknowledged=acknowledged,
        found=found,
        told=told,
        state=state,
        problems=recording.info.problems,
        resets=resets,
        late_s=late_s,
        next_failure=next_failure,
        load=load_average(),
        seconds=time.monotonic() - began,
    )


def moved_for_s(path: TruePath, since_ns: int) -> float:
    """Return the time from an instant to the last cycle after it in which the tool moved, 0 where it stood."""
    if len(path.time_ns) < 2:
        return 0.0
    away = np.linalg.norm(path.position - path.position[-1], axis=1)
    moving = np.flatnonzero((away > _STILL_M) & (path.time_ns >= since_ns))
    return float(path.time_ns[moving[-1]] - since_ns) * 1e-9 if len(moving) else 0.0


def way_m(path: TruePath) -> float:
    """Return how far from rest the tool stands in the end."""
    return float(np.linalg.norm(path.position[-1] - REST_TOOL.position)) if len(path.time_ns) else 0.0


def _opened(session: Path) -> tuple[str, Recording]:
    """Return the state that the session left its folder in, and what is there after what an operator would do."""
    state = Recording(session).info.state
    if state == "recording":
        recover_session(session)
    return state, Recording(session)


def _look(recording: Recording) -> tuple[dict[str, int], dict[str, int], dict[str, float]]:
    """Return the samples of each stream, the resets of its clock, and how late its stamps are."""
    found = {"force": len(recording.force), "robot": len(recording.robot)}
    for name in recording.cameras:
        images = recording.images(name)
        found[f"camera/{name}"] = len(images)
        if len(images):
            images.image(len(images) - 1)  # raises where it cannot be decoded
    streams = report_session(recording, silent).streams
    resets = {name: stream.resets for name, stream in streams.items()}
    return found, resets, {name: stream.delay_s[0] for name, stream in streams.items()}


def _next(bench: Bench, client: Client, folder: Path) -> str:
    """Have the operator bring the gripper back to rest, and the next session carried out."""
    bench.order(ROBOT, "jog", REST_TOOL)
    failure = client.next_session(folder / "next")
    bench.order(ROBOT, "jog", REST_TOOL)
    return failure
