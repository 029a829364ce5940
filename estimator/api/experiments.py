"""Experiments as a script meets them: read from folders, planned in memory, shown as tables and curves."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from estimator.api.tables import dataframe, known
from estimator.errors import InputError
from estimator.experiment import model, reading
from estimator.experiment.observations import columns_of
from estimator.fem.boundary.motion import GripperPose
from estimator.studies.paper_tables.block import GRASP_CENTRE, block

if TYPE_CHECKING:
    from estimator.api.drawings import Drawing


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Experiment(model.Experiment):
    """One retraction of one phantom: what was stated of it, and n rows of observations of m fiducials.

    SI units, tissue frame: z up, origin at the phantom's centre at rest. The attributes are those of
    :class:`estimator.experiment.model.Experiment`.

    Examples
    --------
    >>> from estimator import Experiment
    >>> pull = Experiment.of_block([(0, 0, 0), (0.002, 0, 0), (0.004, 0, 0)], name="a pull")
    >>> pull
    <Experiment 'a pull' of 'virtual': 3 rows in 2 s, the gripper goes 4.0 mm far, 16 fiducials>
    >>> pull.position.shape, pull.wrench.shape, pull.fiducials.shape
    ((3, 3), (3, 6), (3, 16, 3))
    >>> pull.to_dict()["observations"]["px"]
    [0.04, 0.042, 0.044]
    """

    @classmethod
    def of(cls, experiment: model.Experiment) -> "Experiment":
        """Return an experiment of the package's inside as one that shows itself."""
        if isinstance(experiment, cls):
            return experiment
        return cls(**{field.name: getattr(experiment, field.name) for field in fields(model.Experiment)})

    @classmethod
    def of_block(
        cls,
        displacement_m: ArrayLike,
        turn_rad: ArrayLike | None = None,
        *,
        name: str = "pull",
        order: int = 1,
    ) -> "Experiment":
        """Plan a retraction of a block of 100 × 100 × 10 mm, anchored at x = −50 mm and gripped at x = 40 mm.

        Parameters
        ----------
        displacement_m : (n, 3) of the gripper from rest, m; a row each second, the first at rest
        turn_rad : (n, 3) rotation vectors of the gripper, rad; none where left out
        name, order : of the experiment

        Returns
        -------
        Experiment whose wrench is zero and whose fiducials stay: nothing is measured yet.

        Raises
        ------
        InputError
            The arrays are no rows of three numbers, as many each, or the first row is not at rest.
        """
        way = _rows_of_three("displacement_m", displacement_m)
        turn = np.zeros_like(way) if turn_rad is None else _rows_of_three("turn_rad", turn_rad)
        if len(turn) != len(way) or len(way) < 2 or way[0].any() or turn[0].any():
            raise InputError(
                f"displacement_m has {len(way)} rows and turn_rad {len(turn)}; give as many of each, two or more, "
                "the first of them zero: at rest"
            )
        poses = [
            GripperPose(np.add(GRASP_CENTRE, moved), Rotation.from_rotvec(turned))
            for moved, turned in zip(way, turn, strict=True)
        ]
        planned = cls.of(block(poses))
        values = {field.name: getattr(planned, field.name) for field in fields(model.Experiment)}
        return cls(**{**values, "name": name, "order": order})

    def to_dict(self) -> dict[str, Any]:
        """Return facts and observations as plain values, None where nothing was measured; keys as in the folder."""
        return {
            "name": self.name,
            "phantom_id": self.phantom_id,
            "order": self.order,
            "trajectory": self.trajectory_kind,
            "fiducials_rest": self.fiducials_rest.tolist(),
            "observations": {
                name: [known(value) for value in column] for name, column in columns_of(self).items()
            },
        }

    def to_dataframe(self) -> Any:
        """Return the observations as a ``pandas.DataFrame`` with the columns of ``observations.csv``, by time.

        Raises
        ------
        InputError
            pandas is not installed.
        """
        return dataframe(columns_of(self), index="time")

    def plot(self) -> "Drawing":
        """Return a matplotlib figure of the gripper's way, the force and the torque against time."""
        from estimator.api.drawings import drawing
        from estimator.report.drawing.experiment_plot import SIZE_IN, draw_experiment

        return drawing(lambda sheet: draw_experiment(sheet, self), SIZE_IN)

    def __repr__(self) -> str:
        facts = ", ".join(self._facts().values())
        return f"<Experiment {self.name!r} of {self.phantom_id!r}: {facts}>"

    def _repr_html_(self) -> str:
        from estimator.report.page import facts

        return facts(f"{self.name} of {self.phantom_id}", self._facts())

    def _facts(self) -> dict[str, str]:
        way = np.linalg.norm(self.position - self.position[0], axis=1).max()
        rows, beads = len(self.time), len(self.fiducials_rest)
        return {
            "observations": f"{rows} {'row' if rows == 1 else 'rows'} in {self.time[-1] - self.time[0]:.3g} s",
            "motion": f"the gripper goes {1e3 * way:.1f} mm far",
            "seen": f"{beads} {'fiducial' if beads == 1 else 'fiducials'}",
        }


def read_experiment(path: Path | str) -> Experiment:
    """Read and check one experiment folder, as ``retract export`` and ``retract simulate`` write it.

    Raises
    ------
    InputError
        Something is missing, unreadable or implausible; the message names file, line and column or key.

    Examples
    --------
    >>> from estimator import Experiment, read_experiment
    >>> from estimator.experiment import write_experiment
    >>> planned = Experiment.of_block([(0, 0, 0), (0.002, 0, 0)])
    >>> folder = write_experiment(planned, tmp_path / "pull").path
    >>> read_experiment(folder)
    <Experiment 'pull' of 'virtual': 2 rows in 1 s, the gripper goes 2.0 mm far, 16 fiducials>
    """
    return Experiment.of(reading.read_experiment(path))


def read_case(path: Path | str) -> list[Experiment]:
    """Read a folder of experiments of one phantom in one mounting, in their order; one experiment is a list of one.

    Raises
    ------
    InputError
        The folder holds no experiment, or experiments of several phantoms; or as :func:`read_experiment`.

    Examples
    --------
    >>> from estimator import Experiment, read_case
    >>> from estimator.experiment import write_experiment
    >>> for order, name in enumerate(("pull", "again"), start=1):
    ...     planned = Experiment.of_block([(0, 0, 0), (0.002, 0, 0)], name=name, order=order)
    ...     _ = write_experiment(planned, tmp_path / "case" / name)
    >>> [experiment.name for experiment in read_case(tmp_path / "case")]
    ['pull', 'again']
    """
    return [Experiment.of(experiment) for experiment in reading.read_case(path)]


def several(experiments: model.Experiment | Sequence[model.Experiment]) -> Sequence[model.Experiment]:
    """Return experiments, be they one or more."""
    return [experiments] if isinstance(experiments, model.Experiment) else experiments


def _rows_of_three(name: str, values: ArrayLike) -> np.ndarray[Any, np.dtype[np.float64]]:
    rows = np.asarray(values, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 3 or not np.isfinite(rows).all():
        raise InputError(f"{name} has the shape {rows.shape}; give n rows of three finite numbers")
    return rows
