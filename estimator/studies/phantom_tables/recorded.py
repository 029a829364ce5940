"""Tables VI to VIII: a laboratory's own phantoms, one estimate from each recorded retraction."""

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.experiment import Experiment, PaintedPatch
from estimator.fit.estimate import estimate
from estimator.studies.paper_tables.fitting import row_of
from estimator.studies.running.arrays import as_text, from_text
from estimator.studies.running.case import Row
from estimator.studies.tables.study import Group, Level, Study, StudyResult

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RecordedRetraction:
    """The estimate from one recorded experiment."""

    experiment: Experiment

    @property
    def name(self) -> str:
        """Which experiment."""
        return f"{self.experiment.phantom_id}, {self.experiment.path or self.experiment.name}"

    @property
    def identity(self) -> str:
        """What was stated and measured, whatever it is called."""
        one = self.experiment
        stated = (one.phantom, one.anchors, one.grasp, one.sensor)
        data = sha256(repr(stated).encode())
        for file in files_of(one):
            data.update(file.read_bytes())
        for table in (one.fiducials_rest, one.position, one.quaternion_wxyz, one.wrench, one.fiducials):
            data.update(table.tobytes())
        return f"recorded retraction and its prediction {data.hexdigest()}"

    def run(self) -> Row:
        """Estimate as ``retract estimate`` does, and keep what the model predicts."""
        found = estimate([self.experiment])
        return row_of(
            found,
            remark=f"residual/noise {found.noise_ratio:.2f}",
            predicted_force=as_text(found.fits[0].wrench[:, :3]),
            predicted_fiducials=as_text(found.fits[0].fiducials),
        )

    def predicted(self, row: Row) -> tuple[FloatArray, FloatArray]:
        """Return the forces (n, 3), N, and the fiducials (n, m, 3), m, that the model predicts."""
        shape = self.experiment.fiducials.shape
        return from_text(str(row["predicted_force"]), (-1, 3)), from_text(
            str(row["predicted_fiducials"]), shape
        )

    @property
    def anchoring(self) -> str:
        """How many sides are anchored, in words."""
        return {1: "one side", 2: "two sides"}.get(len(self.experiment.anchors), "several sides")

    @property
    def motion(self) -> str:
        """Which motion, in words."""
        one = self.experiment
        return (one.trajectory_kind if one.trajectory_kind != "other" else one.name).replace("_", " ")


def files_of(experiment: Experiment) -> list[Path]:
    """Return the files that say what the phantom is and where it is held: surfaces and paintings."""
    phantom = experiment.phantom
    held = (*experiment.anchors, *(one.box for one in experiment.directed), experiment.grasp.box)
    painted = [box.file for box in held if isinstance(box, PaintedPatch)]
    surface = [] if phantom.surface is None else [phantom.surface]
    return [*surface, *(region.surface for region in phantom.regions), *painted]


def recorded(experiments: Sequence[Experiment]) -> Study:
    """Return the study of recorded experiments: a group for each anchoring and phantom, a level for each motion."""
    sorted_in: dict[tuple[str, str], dict[str, list[RecordedRetraction]]] = {}
    for one in experiments:
        case = RecordedRetraction(one)
        motions = sorted_in.setdefault((one.phantom_id, case.anchoring), {})
        motions.setdefault(case.motion, []).append(case)
    groups = tuple(
        Group(
            f"phantom {phantom}, {anchoring} anchored",
            tuple(Level(motion, tuple(cases)) for motion, cases in motions.items()),
            None,
        )
        for (phantom, anchoring), motions in sorted_in.items()
    )
    return Study(
        "recorded",
        "Tables VI and VII: recorded retractions",
        (
            "One estimate from each retraction, by the likelihood; the spread is over the repeats of a motion.",
        ),
        groups,
    )


def recorded_cases(study: Study) -> list[RecordedRetraction]:
    """Return the recorded retractions of a study."""
    return [case for case in study.cases if isinstance(case, RecordedRetraction)]


def found_of(result: StudyResult) -> list[tuple[RecordedRetraction, Row]]:
    """Return the recorded retractions that gave an estimate, with what they found."""
    return [
        (case, outcome.row)
        for group in result.groups
        for level in group.levels
        for case, outcome in zip(level.level.cases, level.outcomes, strict=True)
        if isinstance(case, RecordedRetraction) and outcome.row is not None
    ]
