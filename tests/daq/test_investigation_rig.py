"""An investigation on a rig: every manoeuvre is a recorded session and its experiment."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest
from investigation_bench import RIG, ScriptedExaminer, ScriptedOperator
from session_bench import Bench
from synthetic_session import SyntheticSession

from daq.investigation.laboratory import RigLaboratory
from daq.investigation.loop import Investigation, Rules
from daq.investigation.manoeuvre import Manoeuvre
from daq.investigation.offered import OPENING
from daq.progress import Progress, silent
from daq.recording.folder import SessionInfo, read_info
from daq.session.session import Label, run_session
from daq.trajectories import Trajectory
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from estimator.experiment import read_experiment
from robot_drivers.protocols import Pose

POSES = [Pose((GRASP_CENTRE[0] + 0.004 * step, *GRASP_CENTRE[1:])) for step in range(2)]


class Recorder:
    """Writes a session of two poses in the place of a recording."""

    def __init__(self) -> None:
        self.asked: list[tuple[Trajectory, Path, Label]] = []

    def __call__(self, trajectory: Trajectory, folder: Path, label: Label, progress: Progress) -> SessionInfo:
        self.asked.append((trajectory, folder, label))
        SyntheticSession(POSES, SpringPhantom(GRASP_CENTRE, placed_beads(0))).write(folder)
        return read_info(folder)


@pytest.mark.parametrize(
    ("manoeuvre", "beads_count"),
    [(Manoeuvre("pull", amplitude_m=0.004), True), (Manoeuvre("tool_poses", amplitude_m=0.005), False)],
    ids=lambda one: getattr(one, "name", str(one)),
)
def test_a_manoeuvre_is_a_session_and_its_experiment(
    manoeuvre: Manoeuvre, beads_count: bool, tmp_path: Path
) -> None:
    recorder = Recorder()
    laboratory = RigLaboratory(RIG, recorder, tmp_path, "N. N.")
    first = laboratory.carry_out(manoeuvre, 2, silent)
    ((trajectory, session, label),) = recorder.asked
    assert trajectory == manoeuvre.trajectory()
    assert session.parent == tmp_path / "sessions"
    assert (label.order, label.operator, label.notes) == (2, "N. N.", manoeuvre.words)
    measured = read_experiment(first)
    assert np.isfinite(measured.wrench).all()
    assert np.isfinite(measured.fiducials).any() == beads_count
    planned = laboratory.planned(manoeuvre, measured)
    windows = [step for step in trajectory.steps if step.measure_s > 0]
    assert len(planned.time) == len(windows)
    assert np.isfinite(planned.fiducials).any() == beads_count


def test_a_session_that_was_broken_off_stays_and_its_repetition_has_a_folder_of_its_own(
    tmp_path: Path,
) -> None:
    manoeuvre = Manoeuvre("pull", amplitude_m=0.004)
    broken_off = tmp_path / "sessions" / f"01_{manoeuvre.name}"
    broken_off.mkdir(parents=True)
    recorder = Recorder()
    RigLaboratory(RIG, recorder, tmp_path).carry_out(manoeuvre, 1, silent)
    assert recorder.asked[0][1].name == f"{broken_off.name}_again1"
    assert list(broken_off.iterdir()) == []


def test_a_rig_whose_robot_refuses_everything_moves_nothing_and_says_why_of_each(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.robot.reach_m = bench.robot.pose.position[0] + 0.001
    laboratory = RigLaboratory(bench.rig, partial(run_session, bench.rig, bench.devices), tmp_path / "found")
    operator = ScriptedOperator()
    outcome = Investigation(
        laboratory, operator, Rules(), tmp_path / "found", ScriptedExaminer(), silent
    ).run()
    assert outcome.ending == "everything refused"
    assert [one.manoeuvre for one in outcome.journal.dropped] == list(OPENING)
    assert all("beyond the reach" in one.why for one in operator.heard)
    assert bench.robot.poses == []
    assert not (tmp_path / "found" / "sessions").exists()
