import threading
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from fake_devices import FakeCamera, FakeForceSensor, FakeRobot

from daq.devices import Devices
from daq.errors import RigError, SoftwareStopError, TrajectoryError
from daq.plans import Plan, Trial, finished, read_plan, run_plan, runs
from daq.progress import silent
from daq.recording.folder import read_info
from daq.rig import Rig, write_rig
from daq.session.session import run_session
from daq.virtual_rig.layout import REST_TOOL, Addresses, rig_description
from daq.virtual_rig.rendering.scene import flea2_pair

SHORT = Trial("pull", steps=1, return_steps=1, step_length_m=0.002, settle_s=0.0, measure_s=0.02)


class Laboratory:
    """Fake devices at rest, and plans whose sessions take two seconds."""

    def __init__(self, folder: Path) -> None:
        calibration = folder / "stereo.toml"
        flea2_pair().save(calibration)
        rig = rig_description(Addresses(1, 2, 3, 4, 5, 6, ("tcp://a:1", "tcp://b:2")), calibration)
        self.rig: Rig = replace(rig, limits=replace(rig.limits, speed_m_s=5.0))
        self.force, self.robot = FakeForceSensor(), FakeRobot(REST_TOOL)
        self.devices = Devices(self.force, self.robot, {"left": FakeCamera(), "right": FakeCamera()})
        self.folder, self.journal = folder, folder / "plan.journal.json"

    def plan(self, *trials: Trial) -> Plan:
        return Plan(trials, sessions=self.folder / "sessions", name="{trial}_{trajectory}_{repeat}")

    def run(self, plan: Plan) -> Iterator[Path]:
        record = partial(run_session, self.rig, self.devices)
        return run_plan(plan, self.rig, record, silent, self.journal, self.folder)


@pytest.fixture
def laboratory(tmp_path: Path) -> Laboratory:
    return Laboratory(tmp_path)


def test_an_interrupted_plan_goes_on_with_the_first_trial_that_is_not_finished(
    laboratory: Laboratory,
) -> None:
    plan = laboratory.plan(replace(SHORT, repeat=2), replace(SHORT, trajectory="twist_and_pull"))
    first = next(laboratory.run(plan))
    assert first.name == "1_pull_1"
    overload = threading.Timer(1.0, lambda: laboratory.force.wrench.put(0, 99.0))
    overload.start()
    with pytest.raises(SoftwareStopError):
        list(laboratory.run(plan))
    overload.join()
    laboratory.force.wrench[:] = 0.0
    laboratory.robot.resume()
    laboratory.robot.pose = REST_TOOL
    rest = list(laboratory.run(plan))
    assert [session.name for session in rest] == ["1_pull_2_again1", "2_twist_and_pull_1"]
    assert [read_info(session).order for session in rest] == [2, 3]
    assert list(laboratory.run(plan)) == []
    assert len(finished(laboratory.journal)) == 3


def test_a_mistake_in_the_last_trial_is_told_before_anything_moves(laboratory: Laboratory) -> None:
    plan = laboratory.plan(SHORT, Trial("none.csv"))
    with pytest.raises(TrajectoryError, match=r"none\.csv"):
        next(laboratory.run(plan))
    assert laboratory.robot.poses == []


def test_an_edited_trial_is_due_again_and_an_inserted_one_moves_nobody() -> None:
    before = {run.key for run in runs(Plan((SHORT, SHORT)))}
    inserted = [run.key for run in runs(Plan((Trial("lift"), SHORT, replace(SHORT, notes="wet"))))]
    assert set(inserted[1:]) == before
    edited = [run.key for run in runs(Plan((replace(SHORT, steps=2),)))]
    assert not set(edited) & before


def test_a_plan_file_is_read_and_its_mistakes_are_told_with_their_line(tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    head = 'format = "retraction-plan/1"\n'
    path.write_text(
        head + 'sessions = "all"\n[[trials]]\ntrajectory = "pull"\nrepeat = 3\nholds_s = [3.0, 8.0]\n'
    )
    plan = read_plan(path)
    assert plan.sessions == tmp_path / "all"
    assert [(run.number, run.repeat) for run in runs(plan)] == [(1, 1), (1, 2), (1, 3)]
    assert len(plan.trials[0].lay_out(tmp_path).steps) == 18
    for text, told in (
        (head + '[[trials]]\ntrajectory = "pull"\nrepeats = 3\n', r"line 4: .*repeats is no known key"),
        (head + '[[trials]]\ntrajectory = "pull"\nrepeat = 0\n', "repeat and rounds must be at least 1"),
        (head + 'name = "{when}"\n[[trials]]\ntrajectory = "pull"\n', "name template '{when}'"),
        (head, "lacks the key trials"),
    ):
        path.write_text(text)
        with pytest.raises(RigError, match=told):
            read_plan(path)


@pytest.mark.parametrize(
    ("trial", "told"),
    [
        (Trial("push"), "trajectory 'push' is unknown; name one of pull"),
        (Trial("lift", steps=3), "'lift' takes no steps"),
        (Trial("mine.csv", angle_rad=1.0), "'mine.csv' takes no angle_rad"),
    ],
)
def test_what_a_trajectory_does_not_know_is_refused(tmp_path: Path, trial: Trial, told: str) -> None:
    with pytest.raises(TrajectoryError, match=told):
        trial.lay_out(tmp_path)


def test_the_example_of_the_documentation_runs(
    laboratory: Laboratory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (Path(__file__).parents[2] / "docs" / "recording.md").read_text(encoding="utf-8")
    example = text.split("```python\n")[1].split("```")[0]
    assert len(example.strip().splitlines()) <= 15
    write_rig(laboratory.rig, tmp_path / "lab.toml")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("daq.rig.make_devices", lambda rig: laboratory.devices)
    exec(compile(example, "recording.md", "exec"), {})
    assert sorted(path.name for path in Path("sessions").iterdir()) == ["pull_1", "pull_2"]
    assert read_info(Path("sessions") / "pull_2").order == 2
