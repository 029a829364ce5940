"""Experiments of one phantom, and what is kept of fits of them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from daq.virtual_rig.layout import SPECIMEN
from estimator.experiment import Experiment, Phantom, SensorNoise, write_experiment
from estimator.fit import coverage
from estimator.geometry.shapes import block_surface
from estimator.result_lines import append_result
from estimator.studies.running.case import Outcome, Parametric, Row
from estimator.studies.running.store import OutcomeStore
from estimator.surfaces.writing import write_stl

_STEPS = 6
_STEP_M = 2e-3


def experiment(folder: Path) -> None:
    """Write one experiment, ``pull``, of a block."""
    write_experiment(retraction("pull", 1), folder / "pull")


def experiment_of_surface(folder: Path) -> None:
    """Write one experiment, ``pull``, of a body given as a surface."""
    write_stl(block_surface(SPECIMEN.phantom.size_m, (3, 3, 1)), folder / "body.stl")
    body = Phantom("surface", SPECIMEN.phantom.size_m, folder / "body.stl")
    write_experiment(replace(retraction("pull", 1), phantom=body), folder / "pull")


def case(folder: Path) -> None:
    """Write a case of two experiments."""
    for order, name in enumerate(("pull", "again"), start=1):
        write_experiment(retraction(name, order), folder / "case" / name)


def coverage_results(folder: Path) -> None:
    """Write ``sets.jsonl``, the outcomes of three data sets of the coverage, the last of which failed."""
    truth = {"youngs_modulus": 1e4, "poisson_ratio": 0.45}
    intervals = {"youngs_modulus": (9e3, 1.1e4), "poisson_ratio": (0.44, 0.46)}
    for seed in range(2):
        append_result(folder / "sets.jsonl", coverage.Outcome(seed, truth, truth, intervals, 1.0))
    append_result(folder / "sets.jsonl", coverage.Outcome(2, truth, {}, {}, float("nan"), "no convergence"))


class KnownCase(Parametric):
    """A case of a study that is known already."""

    name = "known"

    def __repr__(self) -> str:
        return "KnownCase()"

    def run(self) -> Row:
        """Return nothing: its outcome is kept."""
        return {}


def outcome(folder: Path) -> None:
    """Write the kept outcome of a case of a study."""
    row: Row = {"youngs_modulus": 15e3, "poisson_ratio": 0.45, "seconds": 2.5, "remark": "stopped early"}
    OutcomeStore(folder).write(KnownCase(), Outcome(row))


def retraction(name: str, order: int) -> Experiment:
    """Return a pull of a block in which the beads follow the gripper by their share of the way."""
    rest = np.array(SPECIMEN.fiducials_m)[:4]
    way = _STEP_M * np.arange(_STEPS + 1)
    moved = np.outer(way, [1.0, 0.0, 0.0])
    share: Sequence[float] = [0.2, 0.4, 0.6, 0.8]
    return Experiment(
        name=name,
        phantom_id="P07",
        order=order,
        phantom=SPECIMEN.phantom,
        anchors=SPECIMEN.anchors,
        grasp=SPECIMEN.grasp,
        trajectory_kind="pull",
        environment=SPECIMEN.environment,
        sensor=SensorNoise(0.02, 5e-4, 5e-5, 3e-5),
        fiducials_rest=rest,
        time=np.linspace(0.0, 9.0, len(way)),
        phase=("hold",) * len(way),
        step=np.arange(len(way)),
        position=np.array(SPECIMEN.grasp.centre) + moved,
        quaternion_wxyz=Rotation.identity(len(way)).as_quat(scalar_first=True),
        wrench=np.outer(way / way[-1], [-3.0, 0.1, 0.2, 0.002, 0.01, 0.03]),
        fiducials=rest + np.multiply.outer(way, [1.0, 0.0, 0.1])[:, None, :] * np.array(share)[None, :, None],
    )
