from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daq.acquisition.messages import StreamCounts, Telemetry
from daq.rig import Rig
from daq.virtual_rig.layout import Addresses, rig_description
from gui.rig.state import RigState, connecting, disconnected, opened, told
from robot_drivers.ati.compensation.tare import Tare, TareStack
from robot_drivers.protocols import DeviceIdentity, FloatArray

NONE = np.empty((0, 7))


def rig() -> Rig:
    return rig_description(Addresses(1, 2, 3, 4, 5, 6, ("tcp://a", "tcp://b")), Path("stereo.toml"))


def telemetry(second: float, **changed: object) -> Telemetry:
    counts = StreamCounts(round(7000 * second), 0, 0, 0, 0.001, 1e-4)
    seen = Telemetry(round(second * 1e9), "ready", 0, 0, None, "", {"force": counts}, NONE, NONE, {}, None)
    return replace(seen, **changed)


def connected() -> RigState:
    identity = DeviceIdentity("force sensor", "Net F/T", "FT1", "10.0.0.2")
    return opened(connecting(rig()), {"force sensor": identity})


def after(*seen: Telemetry, tares: TareStack | None = None) -> RigState:
    state = connected()
    for each in seen:
        state = told(state, each, tares or TareStack())
    return state


def tare(offset: FloatArray) -> Tare:
    none = np.zeros(6)
    return Tare(offset, none, none, none, none, 1.0, 1000, 0)


def test_a_rig_without_connection_has_a_dark_lamp_for_every_device() -> None:
    state = disconnected(rig())
    assert [row.role for row in state.rows] == ["force sensor", "robot", "camera left", "camera right"]
    assert {row.health for row in state.rows} == {"off"}
    assert not state.connected


def test_the_rate_of_a_stream_is_counted_over_two_seconds() -> None:
    state = after(*(telemetry(0.1 * tenth) for tenth in range(41)))
    assert state.rows[0].rate_hz == pytest.approx(7000.0, rel=1e-3)
    assert state.rows[0].health == "good"
    assert state.rows[0].sync_health == "good"


def test_a_silent_or_lossy_stream_changes_its_lamp() -> None:
    silent = telemetry(1.0, counts={"force": StreamCounts(10, 0, 0, 0, 3.0, 1e-4)})
    lossy = telemetry(1.0, counts={"force": StreamCounts(10, 2, 0, 1, 0.01, 2e-3)})
    assert after(silent).rows[0].health == "bad"
    assert after(lossy).rows[0].health == "doubtful"
    assert after(lossy).rows[0].sync_health == "doubtful"


def test_a_session_is_timed_from_its_first_telemetry() -> None:
    session = Path("sessions/a")
    begun = telemetry(5.0, session=session, state="step 1: pulling", step=1, steps=16)
    state = after(telemetry(4.0), begun, replace(begun, time_ns=12_500_000_000, step=2))
    assert (state.phase, state.step, state.steps, state.words) == ("running", 2, 16, "step 1: pulling")
    assert state.recording_s == pytest.approx(7.5)
    assert told(state, telemetry(13.0), TareStack()).recording_s == 0.0


def test_what_the_session_is_marked_with_is_known_while_it_runs_and_until_the_next_begins() -> None:
    first, second = Path("sessions/a"), Path("sessions/b")
    lossy = telemetry(2.0, session=first, problems=("force sensor: 12 samples lost on the way",))
    running = after(telemetry(1.0, session=first), lossy)
    assert running.problems == lossy.problems
    assert running.differs(after(telemetry(1.0, session=first)))
    ended = told(running, telemetry(3.0), TareStack())
    assert ended.problems == lossy.problems
    assert told(ended, telemetry(4.0, session=second), TareStack()).problems == ()


def test_a_held_robot_is_told_with_its_reason() -> None:
    state = after(telemetry(1.0, held="force of 16 N exceeds the limit of 15 N"))
    assert state.phase == "held"
    assert state.words == "held: force of 16 N exceeds the limit of 15 N"


def test_the_zero_is_the_tare_and_in_a_session_that_of_the_guard() -> None:
    reading = np.array([[1.0, 3.0, 4.0, 0.0, 0.1, 0.0, 0.0]])
    bare = after(telemetry(1.0, force=reading))
    assert (bare.force_n, bare.zero) == (5.0, None)
    tares = TareStack().push(tare(np.array([3.0, 0.0, 0.0, 0.0, 0.0, 0.0])))
    assert after(telemetry(1.0, force=reading), tares=tares).force_n == 4.0
    guarded = telemetry(1.0, force=reading, zero=np.array([3.0, 4.0, 0.0, 0.1, 0.0, 0.0]))
    assert after(guarded, tares=tares).force_n == 0.0


def test_telemetry_that_comes_after_the_end_of_the_connection_changes_nothing() -> None:
    state = disconnected(rig())
    assert told(state, telemetry(1.0, session=Path("s")), TareStack()) is state
