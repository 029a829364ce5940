"""A laboratory with a hidden cause: the blind maker's simulator gives the data of any manoeuvre, without real time."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from daq.files.atomic import appearing
from daq.investigation.laboratory import as_measured
from daq.investigation.manoeuvre import KINDS, Kind, Manoeuvre
from daq.progress import Progress
from daq.rig import Rig, Specimen
from daq.trajectories import Trajectory
from daq.trajectories.planned import planned_experiment
from daq.virtual_rig.layout import Addresses, rig_description
from estimator.blind.making.case import hidden_scene
from estimator.blind.making.plan import Planned
from estimator.blind.making.scenes.noise import with_noise
from estimator.blind.making.scenes.retraction import Rows
from estimator.blind.making.scenes.scene import Readings, Scene
from estimator.blind.making.scenes.setup import Setup
from estimator.blind.making.scenes.simulate import FINE, TRIAL, Carried, CarriedBody, read
from estimator.blind.making.scenes.sizing import stated_rest
from estimator.blind.making.scenes.stated import stated_mounting
from estimator.errors import EstimatorError, SolverError
from estimator.experiment import Environment, Experiment, write_experiment
from robot_drivers.errors import MotionRefusedError

FloatArray = NDArray[np.float64]

_NOBODY = Addresses(1, 2, 3, 4, 5, 6, ("tcp://127.0.0.1:1", "tcp://127.0.0.1:2"))
# Of a marker plate against the grid of the board.
_MARKERS = 0.3
_MARKERS_UP_M = 0.005
_GRID_M = (-0.03, -0.01, 0.01, 0.03)
# What befalls single beads of the tissue befalls no marker and no board.
_OF_BEADS = {"fiducial_mislabel", "fiducial_misread"}


class NotSimulatedError(EstimatorError):
    """The maker's simulator finds no equilibrium somewhere in a manoeuvre."""


@lru_cache(maxsize=1)
def _hidden(case: Planned, quick: bool) -> tuple[Setup, Scene]:
    """Draw a case once for all that is done with it: its size takes a dozen coarse runs."""
    return hidden_scene(case, quick)


class HiddenLaboratory:
    """The virtual rig's limits and layout around the phantom and the devices of a blind case.

    Parameters
    ----------
    case : of the usual phantom
    folder : of the experiments
    quick : on a very coarse mesh, for trials
    """

    kinds: Sequence[Kind] = KINDS

    def __init__(self, case: Planned, folder: Path, quick: bool = False) -> None:
        self._setup, self._scene = _hidden(case, quick)
        self._case = case
        self._folder = folder
        self._body = CarriedBody(self._scene.mechanics, self._setup.beads, TRIAL if quick else FINE)
        self._first: Readings | None = None
        self.largest_force = 0.0
        phantom, anchors, grasp = stated_mounting(self._setup.mechanics)
        specimen = Specimen(
            self._setup.phantom_id,
            phantom,
            anchors,
            grasp,
            Environment(),
            tuple((x, y, z) for x, y, z in self._setup.beads.tolist()),
        )
        self.rig: Rig = replace(rig_description(_NOBODY, Path("stereo.toml")), specimen=specimen)

    def planned(self, manoeuvre: Manoeuvre, like: Experiment) -> Experiment:
        """Return the rows of a manoeuvre, those on the way among them, as blind cases have them."""
        rows = planned_experiment(
            manoeuvre.trajectory(), self.rig.specimen, self._setup.sensor, like.order + 1
        )
        return as_measured(manoeuvre, rows, self._looked_at(manoeuvre, like.fiducials_rest))

    def carry_out(self, manoeuvre: Manoeuvre, order: int, progress: Progress) -> Path:
        """Simulate a manoeuvre, and write its experiment.

        Raises
        ------
        MotionRefusedError
            The simulator finds no equilibrium somewhere in it.
        """
        progress(manoeuvre.words, 0, 1)
        try:
            return self.measured(manoeuvre.trajectory(), order, manoeuvre)
        except NotSimulatedError as error:
            raise MotionRefusedError(f"it cannot be simulated ({error}); nothing has moved") from error

    def measured(self, trajectory: Trajectory, order: int, manoeuvre: Manoeuvre | None = None) -> Path:
        """Simulate a trajectory, on tissue unless the manoeuvre strains none, and write its experiment."""
        plan = planned_experiment(trajectory, self.rig.specimen, self._setup.sensor, order)
        rows = Rows(
            plan.trajectory_kind,
            order,
            plan.time,
            plan.phase,
            plan.step,
            plan.position,
            Rotation.from_quat(plan.quaternion_wxyz, scalar_first=True),
        )
        if manoeuvre is None or manoeuvre.strains:
            scene, reading = self._scene, self._strained(rows)
            self._first = self._first or reading
            rest = stated_rest(self._setup, scene, [self._first])
            self.largest_force = max(
                self.largest_force, float(np.linalg.norm(reading.wrench[:, :3], axis=1).max())
            )
        else:
            at_rest = (
                stated_rest(self._setup, self._scene, [self._first]) if self._first else self._setup.beads
            )
            rest = self._looked_at(manoeuvre, at_rest)
            scene, reading = self._unstrained_scene(), self._unstrained(rows, manoeuvre, rest)
        (sensed,) = read(scene, Carried((reading,), 0, 0))
        random = np.random.default_rng([*self._case.seed, 1000 + order])
        noisy = with_noise(sensed, self._setup.sensor, self._setup.noise, random)
        name = f"{order:02d}_{trajectory.kind}"
        experiment = replace(
            plan,
            name=name,
            fiducials_rest=rest,
            position=noisy.position,
            wrench=noisy.wrench,
            fiducials=noisy.beads,
        )
        if manoeuvre is not None and manoeuvre.kind == "tool_poses":
            experiment = as_measured(manoeuvre, experiment, rest)
        with appearing(self._folder / name) as draft:
            write_experiment(experiment, draft)
        return self._folder / name

    def _strained(self, rows: Rows) -> Readings:
        try:
            return self._body.along(rows)
        except SolverError as error:
            raise NotSimulatedError(str(error)) from error

    def _looked_at(self, manoeuvre: Manoeuvre, beads: FloatArray) -> FloatArray:
        """Return the places (m, 3), m, of what the cameras see at rest."""
        if manoeuvre.kind not in ("board", "empty_motion"):
            return beads
        grid = np.array([[x, y, 0.0] for y in _GRID_M for x in _GRID_M])
        if manoeuvre.kind == "board":
            return grid + np.array([0.0, 0.0, 0.005])
        return (
            np.asarray(self.rig.specimen.grasp.centre) + _MARKERS * grid + np.array([0.0, 0.0, _MARKERS_UP_M])
        )

    def _unstrained_scene(self) -> Scene:
        return Scene(self._scene.mechanics) if _OF_BEADS & set(self._case.labels) else self._scene

    def _unstrained(self, rows: Rows, manoeuvre: Manoeuvre, places: FloatArray) -> Readings:
        """Return what true instruments read while no tissue is strained."""
        true = rows
        for change in self._scene.mechanics.motion:
            true = change(true)
        arms = places - np.asarray(self.rig.specimen.grasp.centre)
        if manoeuvre.kind == "empty_motion":
            seen = np.stack([true.position + true.rotation.apply(arm) for arm in arms], axis=1)
        else:
            where = self._first.beads[0] if manoeuvre.kind == "still" and self._first else places
            seen = np.broadcast_to(where, (len(rows.time), *where.shape)).copy()
        return Readings(rows, np.zeros((len(rows.time), 6)), seen)
