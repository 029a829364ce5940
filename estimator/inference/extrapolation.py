"""A prediction at other parameter values near those it was solved for."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from estimator.fem.equilibrium.observation import Observation, at_modulus
from estimator.inference.free_parameter import FreeParameter
from estimator.inference.material_parameters import YOUNGS_MODULUS


def extrapolated(
    observation: Observation,
    parameters: Sequence[FreeParameter],
    before: Mapping[str, float],
    after: Mapping[str, float],
) -> Observation:
    """Return the observation for the values ``after`` from that for ``before``.

    By Young's modulus it goes as :func:`~estimator.fem.equilibrium.observation.at_modulus` says, by the others linearly
    in their internal variables. Derivatives go along; ``field_by`` stays as it was.

    Parameters
    ----------
    parameters : all of the material
    """
    modulus = YOUNGS_MODULUS.name
    wrench, fiducials = observation.wrench, observation.fiducials
    wrench_by, fiducials_by = dict(observation.wrench_by), dict(observation.fiducials_by)
    for parameter in parameters:
        name = parameter.name
        if name == modulus:
            continue
        old, new = parameter.at(before[name]), parameter.at(after[name])
        change = old.slope * (new.internal - old.internal)
        wrench = wrench + change * observation.wrench_by[name]
        fiducials = fiducials + change * observation.fiducials_by[name]
        steeper = old.slope / new.slope
        wrench_by[name] = steeper * observation.wrench_by[name]
        fiducials_by[name] = steeper * observation.fiducials_by[name]
    wrench_by[modulus] = wrench_by[modulus] + (wrench - observation.wrench) / before[modulus]
    moved = replace(
        observation, wrench=wrench, fiducials=fiducials, wrench_by=wrench_by, fiducials_by=fiducials_by
    )
    return at_modulus(moved, before[modulus], after[modulus])
