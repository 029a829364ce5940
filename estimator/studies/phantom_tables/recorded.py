"""Tables VI and VII: the laboratory's own phantoms, by trajectory and repeat."""

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256

from estimator.experiment import Experiment
from estimator.fit.estimate import estimate
from estimator.studies.paper_tables.fitting import row_of
from estimator.studies.running.case import Row
from estimator.studies.tables.study import Group, Level, Study


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
        if one.phantom.surface is not None:
            data.update(one.phantom.surface.read_bytes())
        for table in (one.fiducials_rest, one.position, one.quaternion_wxyz, one.wrench, one.fiducials):
            data.update(table.tobytes())
        return f"recorded retraction {data.hexdigest()}"

    def run(self) -> Row:
        """Estimate as ``retract estimate`` does."""
        found = estimate([self.experiment])
        return row_of(found, remark=f"residual/noise {found.noise_ratio:.2f}")


def recorded(experiments: Sequence[Experiment]) -> Study:
    """Return the study of recorded experiments: a group for each phantom, a level for each trajectory."""
    phantoms: dict[str, dict[str, list[RecordedRetraction]]] = {}
    for one in experiments:
        kind = one.trajectory_kind if one.trajectory_kind != "other" else one.name
        phantoms.setdefault(one.phantom_id, {}).setdefault(kind, []).append(RecordedRetraction(one))
    groups = tuple(
        Group(
            f"phantom {phantom}",
            tuple(Level(kind.replace("_", " "), tuple(cases)) for kind, cases in kinds.items()),
            None,
        )
        for phantom, kinds in phantoms.items()
    )
    return Study(
        "recorded",
        "Tables VI and VII: recorded retractions",
        (
            "One estimate from each retraction, by the likelihood; the spread is over the repeats of a trajectory.",
        ),
        groups,
    )
