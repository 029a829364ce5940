"""What the window knows about the rig: one plain value, changed by events, rendered by widgets.

Every function here returns the state after an event; none knows Qt.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from daq.acquisition.messages import StreamCounts, Telemetry
from daq.recording.streams import FORCE, ROBOT, camera_stream
from daq.rig import Rig
from robot_drivers.ati.compensation.tare import TareStack
from robot_drivers.protocols import DeviceIdentity, FloatArray

Phase = Literal["disconnected", "connecting", "ready", "running", "held", "closing"]
Health = Literal["off", "good", "doubtful", "bad"]

_RATE_SPAN_NS = 2_000_000_000
_OLD_S = {FORCE: 0.5, ROBOT: 0.5}
_OLD_IMAGE_S = 1.5
_DOUBTFUL_SYNC_S = 1e-3
_BAD_SYNC_S = 5e-3


@dataclass(frozen=True, slots=True)
class DeviceRow:
    """One device: who it is, and how its stream stands.

    Attributes
    ----------
    role, stream : such as "camera left" and "camera/left"
    identity : None while it is not connected
    counts : None before the first telemetry
    rate_hz : of what arrives, over two seconds; NaN at first
    """

    role: str
    stream: str
    identity: DeviceIdentity | None = None
    counts: StreamCounts | None = None
    rate_hz: float = math.nan

    @property
    def health(self) -> Health:
        """What its lamp shows."""
        if self.identity is None or self.counts is None:
            return "off"
        if self.counts.age_s > _OLD_S.get(self.stream, _OLD_IMAGE_S):
            return "bad"
        return "doubtful" if self.counts.lost or self.counts.dropped else "good"

    @property
    def sync_health(self) -> Health:
        """How far its times can be trusted."""
        if self.counts is None or math.isnan(self.counts.sync_s):
            return "off"
        if self.counts.sync_s > _BAD_SYNC_S:
            return "bad"
        return "doubtful" if self.counts.sync_s > _DOUBTFUL_SYNC_S else "good"


@dataclass(frozen=True, slots=True)
class RigState:
    """The rig as the operator should see it.

    Attributes
    ----------
    words : the state in words
    rows : of the devices
    session : folder of the session that is being recorded, None without one
    recording_s : how long it has been recorded
    step, steps : its progress
    held : why the robot is held, empty while it is not
    reading : (6,) the newest wrench as read, N and N·m, sensor frame; None before the first
    zero : (6,) that is taken off it: the guard's in a session, else the operator's tare; None without either
    tool : (7,) the newest ``T_base_tool``: position in m, quaternion with the scalar first
    problems : what the session under way is going to be marked with; of the last one until the next begins
    """

    phase: Phase = "disconnected"
    words: str = "not connected"
    rows: tuple[DeviceRow, ...] = ()
    session: Path | None = None
    recording_s: float = 0.0
    step: int = 0
    steps: int = 0
    held: str = ""
    reading: FloatArray | None = None
    zero: FloatArray | None = None
    tool: FloatArray | None = None
    problems: tuple[str, ...] = ()
    _began_ns: int = 0
    _rate_base: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    @property
    def load(self) -> FloatArray | None:
        """The newest wrench (6,) with its zero taken off, as far as there is one."""
        if self.reading is None or self.zero is None:
            return self.reading
        return self.reading - self.zero

    @property
    def force_n(self) -> float:
        """Magnitude of the load's force; NaN before the first sample."""
        return math.nan if self.load is None else float(np.linalg.norm(self.load[:3]))

    @property
    def torque_nm(self) -> float:
        """Magnitude of the load's torque; NaN before the first sample."""
        return math.nan if self.load is None else float(np.linalg.norm(self.load[3:]))

    def differs(self, before: "RigState") -> bool:
        """Tell whether more than numbers has changed."""
        now, then = (
            (
                state.phase,
                state.words,
                state.session,
                state.step,
                state.held,
                state.problems,
                state.zero is None,
            )
            for state in (self, before)
        )
        return now != then

    @property
    def connected(self) -> bool:
        """Whether devices are connected."""
        return self.phase in ("ready", "running", "held")


def disconnected(rig: Rig, words: str = "not connected") -> RigState:
    """Return the state without any device."""
    rows = [DeviceRow("force sensor", FORCE), DeviceRow("robot", ROBOT)]
    rows += [DeviceRow(f"camera {camera.name}", camera_stream(camera.name)) for camera in rig.cameras]
    return RigState(words=words, rows=tuple(rows))


def connecting(rig: Rig) -> RigState:
    """Return the state while the devices are being connected."""
    return replace(disconnected(rig, "connecting the devices"), phase="connecting")


def opened(state: RigState, devices: Mapping[str, DeviceIdentity]) -> RigState:
    """Return the state once the devices are connected."""
    rows = tuple(replace(row, identity=devices.get(row.role)) for row in state.rows)
    return replace(state, phase="ready", words="ready, the robot stands", rows=rows)


def closing(state: RigState) -> RigState:
    """Return the state while the devices are let go and what was recorded is sealed."""
    words = "holding the robot and sealing the recording" if state.session else "disconnecting"
    return replace(state, phase="closing", words=words)


def told(state: RigState, seen: Telemetry, tares: TareStack) -> RigState:
    """Return the state after telemetry."""
    if not state.connected:
        return state
    began_ns = state._began_ns if state.session == seen.session else seen.time_ns
    running = seen.session is not None
    return replace(
        state,
        phase="held" if seen.held else "running" if running else "ready",
        words=_words(seen),
        rows=tuple(_row(row, seen, state._rate_base) for row in state.rows),
        session=seen.session,
        recording_s=(seen.time_ns - began_ns) * 1e-9 if running else 0.0,
        step=seen.step,
        steps=seen.steps,
        held=seen.held,
        reading=seen.force[-1, 1:] if len(seen.force) else state.reading,
        zero=_zero(seen, tares),
        tool=seen.pose[-1, 1:] if len(seen.pose) else state.tool,
        problems=seen.problems if running else state.problems,
        _began_ns=began_ns,
        _rate_base=_rate_bases(state._rate_base, seen),
    )


def _words(seen: Telemetry) -> str:
    if seen.held:
        return f"held: {seen.held}"
    return seen.state if seen.session is not None else "ready, the robot stands"


def _zero(seen: Telemetry, tares: TareStack) -> FloatArray | None:
    if seen.zero is not None:
        return seen.zero
    return tares.tares[-1].offset if tares.tares else None


def _row(row: DeviceRow, seen: Telemetry, bases: Mapping[str, tuple[int, int]]) -> DeviceRow:
    counts = seen.counts.get(row.stream)
    if counts is None:
        return row
    base_ns, base = bases.get(row.stream, (seen.time_ns, counts.received))
    span_ns = seen.time_ns - base_ns
    if span_ns < _RATE_SPAN_NS:
        return replace(row, counts=counts)
    rate_hz = (counts.received - base) * 1e9 / span_ns
    return replace(row, counts=counts, rate_hz=rate_hz if rate_hz >= 0 else row.rate_hz)


def _rate_bases(bases: Mapping[str, tuple[int, int]], seen: Telemetry) -> dict[str, tuple[int, int]]:
    """Return from when and from how many samples on the rates are counted; anew every two seconds."""
    return {
        stream: base
        if (base := bases.get(stream)) is not None
        and seen.time_ns - base[0] < _RATE_SPAN_NS
        and counts.received >= base[1]
        else (seen.time_ns, counts.received)
        for stream, counts in seen.counts.items()
    }
