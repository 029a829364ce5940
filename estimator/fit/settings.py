"""What a fit is asked for: the law, what is known of its parameters, the objective, the loss and the nuisances."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np

from estimator.errors import InputError
from estimator.fit.budget.systematic import Stated
from estimator.fit.losses import LINEAR, Loss
from estimator.fit.nuisances import USUAL, floating
from estimator.inference.free_parameter import FreeParameter, NormalPrior, Prior
from estimator.inference.material_parameters import USUAL_PRIORS, law_parameters
from estimator.materials import NeoHookean
from estimator.materials.law import Law
from estimator.materials.material import Material

Objective = Literal["likelihood", "paper"]
Intervals = Literal["linear", "profile"]
OBJECTIVES: tuple[Objective, ...] = get_args(Objective)


@dataclass(frozen=True)
class FitSettings:
    """How to fit; the default is E and ν of the Neo-Hookean law by maximum likelihood.

    Every parameter of the law is free that is not fixed. Parameters go by their names: ``youngs_modulus`` (Pa),
    ``poisson_ratio``, and those of the law's shape.

    Attributes
    ----------
    law : of the tissue
    fixed : values of the parameters that are not estimated
    priors : of free parameters; None for a flat one. Of ν it is a weak one by default, see
        :data:`~estimator.inference.material_parameters.USUAL_RATIO`; the paper's objective has none
    bounds : lower and upper, within those that the parameter has anyway
    loss : of a row's residual in units of its noise
    nuisances : names from :data:`~estimator.fit.nuisances.NUISANCES`
    objective : ``"likelihood"``: residuals weighted by the covariances of the sensors, nuisances integrated out, by
        Gauss–Newton; ``"paper"``: sums of squares, by sequential quadratic programming, see
        :mod:`estimator.fit.paper`
    prior_weight : by how many times the measurements scatter more than stated: as much surer beside them are all
        priors, and where the robot says that the gripper is
    budget : what is known of errors that the model does not have, for a budget of uncertainty; None for no budget
    intervals : from the curvature at the optimum, or ``"profile"``: from the profile likelihood

    Raises
    ------
    InputError
        A name is unknown, a value outside its bounds, a prior without width, or nothing is free.
    """

    law: Law = field(default_factory=NeoHookean)
    fixed: Mapping[str, float] = field(default_factory=dict)
    priors: Mapping[str, NormalPrior | None] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    loss: Loss = LINEAR
    nuisances: frozenset[str] = USUAL
    objective: Objective = "likelihood"
    intervals: Intervals = "linear"
    prior_weight: float = 1.0
    budget: Stated | None = None

    def __post_init__(self) -> None:
        known = {parameter.name: parameter for parameter in law_parameters(self.law)}
        _check_names(self.law, known, [*self.fixed, *self.priors, *self.bounds])
        for name, (lower, upper) in self.bounds.items():
            widest = known[name]
            if not widest.lower <= lower < upper <= widest.upper:
                raise InputError(
                    f"bounds of {name}: {lower:g} to {upper:g} must ascend and lie within "
                    f"{widest.lower:g} to {widest.upper:g}"
                )
        for name, value in self.fixed.items():
            if not known[name].lower <= value <= known[name].upper:
                raise InputError(
                    f"{name} = {value:g} is outside {known[name].lower:g} to {known[name].upper:g}; "
                    "fix it within"
                )
        for name, prior in self.priors.items():
            if name in self.fixed or (prior is not None and not prior.std > 0):
                raise InputError(
                    f"prior of {name}: it needs a deviation above zero and a parameter that is not fixed"
                )
        if not self.free:
            raise InputError("every parameter is fixed; leave at least one free")
        stated = any(prior is not None for prior in self.priors.values())
        if self.objective == "paper" and (stated or self.loss != LINEAR or self.intervals == "profile"):
            raise InputError(
                "the paper's objective knows neither priors, nor robust losses, nor likelihoods to profile; "
                "leave them out, or take the likelihood as objective"
            )
        floating(self.nuisances)

    @property
    def free(self) -> tuple[FreeParameter, ...]:
        """The parameters to estimate with their bounds and priors, at values from which a fit begins."""
        return tuple(
            self._given(parameter)
            for parameter in law_parameters(self.law)
            if parameter.name not in self.fixed
        )

    @property
    def start(self) -> dict[str, float]:
        """Values of all parameters from which a fit begins: the fixed ones, prior means, or the usual ones."""
        given = map(self._given, law_parameters(self.law))
        return {**{parameter.name: parameter.value for parameter in given}, **self.fixed}

    def material(self, values: Mapping[str, float]) -> Material:
        """Return the material with these values of all parameters."""
        return material_of(self.law, values)

    def _given(self, parameter: FreeParameter) -> FreeParameter:
        lower, upper = self.bounds.get(parameter.name, (parameter.lower, parameter.upper))
        bounded = replace(parameter, lower=lower, upper=upper, prior=self._prior_of(parameter.name))
        stated = self.priors.get(parameter.name)
        return bounded.at(parameter.value if stated is None else stated.mean)

    def _prior_of(self, name: str) -> Prior | None:
        usual = None if self.objective == "paper" else USUAL_PRIORS.get(name)
        prior = self.priors.get(name, usual)
        return None if prior is None else replace(prior, std=prior.std / self.prior_weight)


def material_of(law: Law, values: Mapping[str, float]) -> Material:
    """Return the material with this law and these values of all its parameters."""
    shape = [values[parameter.name] for parameter in law.shape_parameters]
    return Material(law, values["youngs_modulus"], values["poisson_ratio"], np.array(shape, dtype=np.float64))


def _check_names(law: Law, known: Iterable[str], named: Iterable[str]) -> None:
    for name in named:
        if name not in known:
            raise InputError(f"the {law.name} law has no parameter '{name}'; it has {', '.join(known)}")
