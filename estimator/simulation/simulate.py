"""Fill the observations of planned experiments from a forward model, with the noise that their sensors state.

The mesh and the element are finer than an estimation's, so that estimating from the result commits no inverse crime.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.diagnosis.model.solution import Solution, mechanics_of
from estimator.diagnosis.sensitivity.readings import predicted_readings
from estimator.effects.effect import Readings
from estimator.effects.shared.instants import bead_constant
from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.experiment.as_modelled import as_modelled
from estimator.fem.boundary.platens import platens_of
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.discretisation.elements import ElementKind
from estimator.forward.meshing import mesh_experiment
from estimator.forward.model import Progress
from estimator.materials.material import Material
from estimator.simulation.acting import ActingEffect
from estimator.simulation.carried_load import solve_carrying
from estimator.simulation.truth import Truth, truth_of


@dataclass(frozen=True, slots=True)
class Resolution:
    """The mesh of the simulated phantom.

    Attributes
    ----------
    grading, kind : of a block
    of_surface : what tetrahedra take their sizes from; None for the same
    """

    grading: Grading
    kind: ElementKind = "hex64"
    of_surface: Grading | None = None

    def problem(self, experiment: Experiment) -> RetractionProblem:
        """Mesh a phantom.

        Raises
        ------
        InputError
            It cannot be meshed.
        """
        grading = self.grading
        if experiment.phantom.surface is not None and self.of_surface is not None:
            grading = self.of_surface
        return mesh_experiment(experiment, grading, self.kind)


# Cubic elements: 0.05 % in force and 10 µm in fiducials from the converged solution on the paper's block.
TRUTH_GRADING = Grading(grasp_m=1e-3, anchor_m=3e-3, largest_m=15e-3, growth=2.5, layers=1)
# Tetrahedra of second order: finer than those of an estimate, as far as memory allows, for each state keeps its factor.
_SURFACE_TRUTH_GRADING = Grading(grasp_m=1e-3, anchor_m=3e-3, largest_m=10e-3, growth=2.0, layers=1)
TRUE_RESOLUTION = Resolution(TRUTH_GRADING, "hex64", _SURFACE_TRUTH_GRADING)


def simulate_case(
    planned: Sequence[Experiment],
    material: Material,
    seed: int,
    acting: Sequence[ActingEffect] = (),
    progress: Progress | None = None,
    resolution: Resolution = TRUE_RESOLUTION,
) -> list[Experiment]:
    """Return the experiments as their sensors would have seen them, done one after the other on one phantom.

    The gripper follows the planned poses but for what the effects say; its reported position, the wrench and the
    fiducials carry white noise of the stated standard deviations. What the tissue remembers goes with it from one
    experiment to the next.

    Parameters
    ----------
    planned : of one mounting, in their order; the pose columns are the motion, or the wrench columns the load that a
        free gripper carries; the observations are ignored
    material : of the whole phantom
    seed : of the noise
    acting : effects on that phantom
    progress : called with (load steps solved, load steps in all)
    resolution : of the simulated phantom

    Raises
    ------
    InputError
        The phantom cannot be meshed, or an effect names a fiducial that is not there, or needs plates that are not.
    SolverError
        The motion has no equilibrium, or does not settle under its own load.
    """
    planned = [as_modelled(experiment) for experiment in planned]
    exact = exact_readings(planned, material, acting, progress, resolution)
    return [
        _recorded(experiment, seen, np.random.default_rng([seed, number]))
        for number, (experiment, seen) in enumerate(zip(planned, exact, strict=True))
    ]


def simulate_exactly(
    planned: Sequence[Experiment],
    material: Material,
    acting: Sequence[ActingEffect] = (),
    progress: Progress | None = None,
    resolution: Resolution = TRUE_RESOLUTION,
) -> list[Experiment]:
    """Return the experiments as sensors without noise would have seen them; as :func:`simulate_case`.

    They still state the noise that was planned.
    """
    exact = exact_readings(planned, material, acting, progress, resolution)
    return [
        replace(experiment, wrench=seen.wrench, fiducials=seen.fiducials, path=None)
        for experiment, seen in zip(planned, exact, strict=True)
    ]


def exact_readings(
    planned: Sequence[Experiment],
    material: Material,
    acting: Sequence[ActingEffect] = (),
    progress: Progress | None = None,
    resolution: Resolution = TRUE_RESOLUTION,
) -> list[Readings]:
    """Return what the sensors of the experiments would have read without noise; as :func:`simulate_case`."""
    _check_beads(planned, acting)
    problem = resolution.problem(planned[0])
    _check_platens(problem, acting)
    truth = truth_of(material, acting)
    return [_readings(solution, truth) for solution in solve_carrying(problem, planned, truth, progress)]


def _readings(solution: Solution, truth: Truth) -> Readings:
    experiment = solution.load_steps.experiment
    exact = np.zeros((len(experiment.time), 6 + experiment.fiducials[0].size))
    return predicted_readings(mechanics_of(solution), truth, exact)


def _recorded(planned: Experiment, seen: Readings, random: np.random.Generator) -> Experiment:
    """Add the sensors' noise."""
    sensor = planned.sensor
    deviation = np.repeat([sensor.force_std, sensor.torque_std], 3)
    position, quaternion = planned.position, planned.quaternion_wxyz
    if planned.driven == "load":
        position, quaternion = seen.position, seen.rotation.as_quat(scalar_first=True, canonical=True)
    if sensor.orientation_std:
        turn = Rotation.from_rotvec(random.normal(0.0, sensor.orientation_std, position.shape))
        reported = turn * Rotation.from_quat(quaternion, scalar_first=True)
        quaternion = reported.as_quat(scalar_first=True, canonical=True)
    return replace(
        planned,
        position=position + random.normal(0.0, sensor.position_std, position.shape),
        quaternion_wxyz=quaternion,
        wrench=seen.wrench + deviation * random.normal(size=seen.wrench.shape),
        fiducials=seen.fiducials + random.normal(0.0, sensor.fiducial_std, seen.fiducials.shape),
        path=None,
    )


def _check_platens(problem: RetractionProblem, acting: Sequence[ActingEffect]) -> None:
    for one in acting:
        if one.effect.needs_platens and platens_of(problem) is None:
            raise InputError(
                f"effect {one.effect.name}: needs a body between two plates; anchor one whole end of the phantom, and "
                "grasp the other"
            )


def _check_beads(planned: Sequence[Experiment], acting: Sequence[ActingEffect]) -> None:
    beads = len(planned[0].fiducials_rest)
    for one in acting:
        for constant in one.effect.constants:
            number = one.values[constant.name]
            if constant == bead_constant(constant.name) and not round(number) < beads:
                raise InputError(
                    f"effect {one.effect.name}: {constant.name} = {number:g}, but the {beads} fiducials are "
                    f"numbered 0 to {beads - 1}"
                )
