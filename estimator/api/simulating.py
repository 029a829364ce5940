"""Simulated experiments from a script."""

from collections.abc import Mapping, Sequence
from typing import Literal

from estimator.api.experiments import Experiment, several
from estimator.effects.effect import Effect
from estimator.experiment import model
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.model import Progress
from estimator.materials import Law, law_named
from estimator.materials.material import make_material
from estimator.simulation.acting import ActingEffect, acting_effect, read_effect
from estimator.simulation.simulate import TRUE_RESOLUTION, Resolution, simulate_case

# Quick and not very exact: for tests and for a first look.
_COARSE = Resolution(Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=20e-3, growth=3.0, layers=1), "hex27")

Acting = str | tuple[Effect, Mapping[str, float]]


def simulate(
    planned: model.Experiment | Sequence[model.Experiment],
    youngs_modulus: float = 15e3,
    poisson_ratio: float = 0.45,
    *,
    law: str | Law = "neo_hookean",
    shape: Sequence[float] = (),
    effects: Sequence[Acting] = (),
    seed: int = 0,
    mesh: Literal["fine", "coarse"] = "fine",
    progress: Progress | None = None,
) -> list[Experiment]:
    """Return the planned experiments as their sensors would have seen them, one after the other on one phantom.

    Parameters
    ----------
    planned : one or several of one mounting, in their order; their poses are the motion
    youngs_modulus, poisson_ratio : of the tissue, Pa and 1
    law, shape : a law of :mod:`estimator.materials` by name or of your own, and its shape parameters in order
    effects : what else acts: as ``retract simulate --effect`` takes it, or an effect with values of its parameters
    seed : of the sensors' noise
    mesh : "fine": within 0.05 % in force and 10 µm in fiducials; "coarse": for a first look
    progress : called with (visits solved, visits in all)

    Raises
    ------
    InputError
        A value is out of its range, a law or an effect is unknown, or the phantom cannot be meshed.
    SolverError
        The motion has no equilibrium.

    Examples
    --------
    >>> from estimator import Experiment, simulate
    >>> planned = Experiment.of_block([(0, 0, 0), (0.002, 0, 0), (0.004, 0, 0)])
    >>> (soft,) = simulate(planned, 6e3, mesh="coarse")
    >>> (slipped,) = simulate(planned, 6e3, effects=["gripper_slip=0.01,threshold=0.1"], mesh="coarse")
    >>> bool(abs(slipped.wrench[-1, 0]) < abs(soft.wrench[-1, 0]))
    True
    """
    material = make_material(
        law_named(law) if isinstance(law, str) else law, youngs_modulus, poisson_ratio, shape
    )
    resolution = TRUE_RESOLUTION if mesh == "fine" else _COARSE
    found = simulate_case(
        several(planned), material, seed, [_acting(one) for one in effects], progress, resolution
    )
    return [Experiment.of(experiment) for experiment in found]


def _acting(one: Acting) -> ActingEffect:
    return read_effect(one) if isinstance(one, str) else acting_effect(*one)
