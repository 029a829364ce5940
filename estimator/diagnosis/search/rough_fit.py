"""Where the diagnosis begins: the baseline's material, roughly."""

from dataclasses import replace

from estimator.diagnosis.model.hypothesis import LARGEST_POISSON_RATIO, Hypothesis
from estimator.experiment import Experiment
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fit.estimate import fit_few_states
from estimator.fit.linearisation import silent
from estimator.fit.measurements import state_means
from estimator.fit.settings import FitSettings
from estimator.forward.meshing import mesh_experiment
from estimator.forward.model import ForwardModel
from estimator.inference.free_parameter import FreeParameter
from estimator.inference.material_parameters import POISSON_RATIO, YOUNGS_MODULUS

_FIRST_GRADING = Grading(grasp_m=3e-3, anchor_m=8e-3, largest_m=25e-3, growth=3.0, layers=1)


def rough_fit(experiments: tuple[Experiment, ...], material: FitSettings) -> Hypothesis:
    """Fit the baseline to a few states on a coarse mesh; what shape its law has there is kept.

    Parameters
    ----------
    experiments : of one mounting
    material : the law, and what is known of its parameters beforehand

    Raises
    ------
    InputError
        The phantom cannot be meshed.
    FitError
        The measurements do not determine the material.
    SolverError
        A state has no equilibrium at the first guess.
    """
    model = ForwardModel(mesh_experiment(experiments[0], _FIRST_GRADING), experiments)
    iterates, _ = fit_few_states(model, state_means(experiments, model.schedules), silent, material)
    values = iterates[-1].values
    free = tuple(
        _followed(one) for one in material.free if one.name in (YOUNGS_MODULUS.name, POISSON_RATIO.name)
    )
    at = {**values, **{one.name: one.at(values[one.name]).value for one in free}}
    return Hypothesis(
        at[YOUNGS_MODULUS.name],
        at[POISSON_RATIO.name],
        law=material.law,
        shape=tuple(at[parameter.name] for parameter in material.law.shape_parameters),
        free_material=free,
    )


def _followed(parameter: FreeParameter) -> FreeParameter:
    """Return a free parameter of the material within what a diagnosis can follow."""
    too_stiff = parameter.name == POISSON_RATIO.name and parameter.lower < LARGEST_POISSON_RATIO
    return replace(parameter, upper=min(parameter.upper, LARGEST_POISSON_RATIO)) if too_stiff else parameter
