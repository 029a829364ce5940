"""The acquisition process's inside over fake devices: what its client is told when a device fails."""

import os
import pickle
import threading
import time
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import pytest
from session_bench import Bench

from daq.acquisition import silence
from daq.acquisition.connections import Connections
from daq.acquisition.messages import Close, Command, Ended, Release, Report, Start, Telemetry
from daq.acquisition.process import Host, Link
from daq.session.session import Label
from robot_drivers.errors import DeviceError, DeviceTimeoutError, DeviceUnreachableError
from robot_drivers.protocols import WrenchBlock

PATIENCE_S = 60.0


class Reports(BytesIO):
    """The client's end: keeps every report that is written."""

    def __init__(self) -> None:
        super().__init__()
        self.told: list[Report] = []

    def write(self, data: object) -> int:  # type: ignore[override] # bytes only, as the process does
        assert isinstance(data, bytes)
        self.told.append(pickle.loads(data))
        return len(data)

    def wait_for(self, wanted: Callable[[Report], bool]) -> Report:
        """Return the first report from now on that is wanted."""
        begin, deadline = len(self.told), time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            for report in self.told[begin:]:
                if wanted(report):
                    return report
            time.sleep(0.005)
        raise AssertionError("no such report came")


def test_a_robot_that_a_failed_device_has_held_is_told_and_can_be_released(tmp_path: Path) -> None:
    bench, reports = Bench(tmp_path), Reports()
    read, write = os.pipe()

    def serve() -> None:
        with os.fdopen(read, "rb") as commands:
            Host(bench.rig, bench.devices, Link(reports)).run(commands)

    host = threading.Thread(target=serve)
    healthy = bench.force.read

    def fail(timeout_s: float) -> WrenchBlock:
        raise DeviceTimeoutError("force sensor: cable out")

    with os.fdopen(write, "wb", buffering=0) as client:

        def say(command: Command) -> None:
            client.write(pickle.dumps(command))

        host.start()
        bench.force.read = fail  # type: ignore[method-assign] # the fake breaks in this test
        say(Start(bench.trajectory, bench.folder, Label("test")))
        ended = reports.wait_for(lambda report: isinstance(report, Ended))
        assert isinstance(ended, Ended)
        assert ended.failure is not None
        assert bench.robot.held.is_set()
        reports.wait_for(
            lambda report: isinstance(report, Telemetry) and report.held == ended.failure.message
        )
        bench.force.read = healthy  # type: ignore[method-assign]
        say(Release())
        reports.wait_for(lambda report: isinstance(report, Telemetry) and not report.held)
        assert not bench.robot.held.is_set()
        say(Close())
    host.join()


def test_devices_that_were_lost_are_connected_again_for_the_next_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A camera that fell silent and a robot whose connection broke: no process has to be begun anew."""
    for limit in ("LIMIT_S", "LONGEST_S"):  # this client does not show that it is alive
        monkeypatch.setattr(silence, limit, PATIENCE_S)
    bench, reports = Bench(tmp_path), Reports()
    read, write = os.pipe()

    def serve() -> None:
        with os.fdopen(read, "rb") as commands:
            Host(bench.rig, bench.devices, Link(reports)).run(commands)

    host = threading.Thread(target=serve)
    lose(bench.devices.cameras["left"], "read", DeviceTimeoutError("camera left: cable out"))
    with os.fdopen(write, "wb", buffering=0) as client:

        def carry_out(folder: Path) -> Ended:
            client.write(pickle.dumps(Start(bench.trajectory, folder, Label("test"))))
            ended = reports.wait_for(lambda report: isinstance(report, Ended))
            assert isinstance(ended, Ended)
            return ended

        host.start()
        first = carry_out(tmp_path / "first")
        lose(bench.robot, "state", DeviceTimeoutError("robot: cable out"))
        second = carry_out(tmp_path / "second")
        client.write(pickle.dumps(Close()))
    host.join()
    assert (first.failure, second.failure) == (None, None)


def lose(device: object, method: str, error: DeviceError) -> None:
    """Let a method of a device fail until the device is connected anew."""
    healthy, connect = getattr(device, method), device.connect  # type: ignore[attr-defined] # every fake has it

    def fail(*arguments: object) -> object:
        raise error

    def restored() -> None:
        setattr(device, method, healthy)
        connect()

    setattr(device, method, fail)
    device.connect = restored  # type: ignore[attr-defined] # the fake breaks in this test


def test_a_device_that_is_still_lost_is_told_in_its_own_words(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    connections = Connections(bench.devices)
    gone = DeviceUnreachableError("no robot controller at 10.0.0.2:5000; check the address")

    def connect() -> None:
        raise gone

    bench.robot.connect = connect  # type: ignore[method-assign] # the fake is gone in this test
    connections.on_failure("robot", DeviceTimeoutError("silent"))
    with pytest.raises(DeviceUnreachableError, match="check the address"):
        connections.require()
    assert connections.lost
    assert bench.robot.closed
