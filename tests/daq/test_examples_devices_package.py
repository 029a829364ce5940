"""A package of devices, installed by pip: it records in the process that records, without an edit of this project."""

import json
import sys
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path

import pytest
from bench_package import install, rig_file

from daq.acquisition.client import Acquisition
from daq.cli import main
from daq.devices import ROLES
from daq.rig import read_rig
from estimator.experiment import read_experiment

SHORT = ["--steps", "2", "--return-steps", "0", "--settle", "0.1", "--measure", "0.3"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where pip has installed the package, beside nothing else."""
    target = tmp_path_factory.mktemp("installed")
    install(tmp_path_factory.mktemp("source") / "package", target)
    return target


@pytest.fixture
def installed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The package among those of this Python; afterwards it is as if it had never been there."""
    with monkeypatch.context() as context:
        context.syspath_prepend(folder)
        yield
    sys.modules.pop("bench_devices", None)


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> Mapping[str, object]:
    assert main([*arguments, "--json"]) == 0
    answer: Mapping[str, object] = json.loads(capsys.readouterr().out)
    return answer


def record(capsys: pytest.CaptureFixture[str], rig: Path, session: Path) -> Mapping[str, object]:
    """Record, again where the computer was too busy: a rig that is not emulated is held then, as it should be."""
    for attempt in range(1, 6):
        target = session.with_name(f"{session.name}{attempt}")
        status = main(["record", str(rig), *SHORT, "--output", str(target), "--json"])
        out, err = capsys.readouterr()
        if status == 0:
            target.rename(session)
            answer: Mapping[str, object] = json.loads(out)
            return answer
        assert "the controlling program has been silent" in err
    pytest.fail("this computer is too busy")


@pytest.mark.usefixtures("installed")
def test_its_drivers_are_listed_with_those_of_this_project(capsys: pytest.CaptureFixture[str]) -> None:
    drivers = told(capsys, "devices", "--list")["drivers"]
    assert isinstance(drivers, dict)
    for role, name in zip(ROLES, ("bench_sensor", "bench_arm", "bench_camera"), strict=True):
        assert drivers[role.words][name]["package"] == "bench-devices 0.1.0"


@pytest.mark.usefixtures("installed")
def test_its_devices_are_checked_by_what_their_drivers_say_of_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = rig_file(tmp_path, cameras=1)
    path.write_text(path.read_text().replace("wrench = [0.0, 0.0, -3.0", "wrench = [0.0, 0.0, -60.0"))
    assert main(["devices", str(path), "--seconds", "0.3"]) == 1
    text = capsys.readouterr().out
    assert "range (!): Fz at 86 % of its ±70 N" in text
    assert "rate: 500" in text


@pytest.mark.parametrize("cameras", [1, 4])
def test_a_whole_rig_of_its_devices_records_from_the_command_line(
    installed: None, tmp_path: Path, cameras: int, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded = record(capsys, rig_file(tmp_path, cameras), tmp_path / "session")
    (only,) = recorded["sessions"]  # type: ignore[misc]
    samples = only["samples"]
    assert samples["/robot/joints"] > 100
    assert len([topic for topic in samples if topic.endswith("/device") and "/camera/" in topic]) == cameras


def test_a_session_of_one_camera_becomes_an_experiment_without_beads_and_without_the_package(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    session, experiment = tmp_path / "session", tmp_path / "experiment"
    with monkeypatch.context() as context:
        context.syspath_prepend(folder)
        rig = rig_file(tmp_path, cameras=1)
        record(capsys, rig, session)
    sys.modules.pop("bench_devices")
    assert main(["devices", str(rig)]) == 2
    assert "must be one of" in capsys.readouterr().err
    assert main(["export", str(session), "--output", str(experiment)]) == 0
    assert "no fiducials: one camera measures no place in space" in capsys.readouterr().out
    found = read_experiment(experiment)
    assert found.fiducials.shape == (3, 0, 3)
    assert found.wrench.shape == (3, 6)


@pytest.mark.usefixtures("installed")
def test_the_process_that_records_for_the_window_connects_them_and_lets_nothing_move(tmp_path: Path) -> None:
    rig = read_rig(rig_file(tmp_path, cameras=2))
    with Acquisition(rig) as acquisition:
        models = {role: identity.model for role, identity in acquisition.devices.items()}
    assert models == {
        "force sensor": "bench sensor",
        "robot": "bench arm",
        "camera camera1": "bench camera",
        "camera camera2": "bench camera",
    }


@pytest.mark.usefixtures("installed")
def test_settings_of_a_script_are_refused_in_one_line_by_the_process_that_records(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = read_rig(rig_file(tmp_path, cameras=1))
    monkeypatch.setattr(import_module("bench_devices").SensorSettings, "__module__", "__main__")
    script = sys.modules["__main__"]
    monkeypatch.setattr(
        script, "SensorSettings", import_module("bench_devices").SensorSettings, raising=False
    )
    with pytest.raises(Exception, match="belong into an installed package") as caught, Acquisition(rig):
        pass
    assert type(caught.value).__name__ == "SessionError"
