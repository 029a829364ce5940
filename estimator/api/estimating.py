"""Estimation from a script, and an estimate that shows itself."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from estimator.api.experiments import several
from estimator.api.tables import dataframe
from estimator.experiment import model
from estimator.fit import result
from estimator.fit.budget.systematic import Stated
from estimator.fit.estimate import estimate as fit_experiments
from estimator.fit.linearisation import Progress
from estimator.fit.losses import loss_named
from estimator.fit.nuisances import USUAL
from estimator.fit.settings import FitSettings
from estimator.inference.free_parameter import NormalPrior
from estimator.materials import Law, law_named

if TYPE_CHECKING:
    from estimator.api.drawings import Drawing


@dataclass(frozen=True, eq=False, repr=False)
class Estimate(result.Estimate):
    """What an estimation found; the attributes are those of :class:`estimator.fit.result.Estimate`."""

    def to_dict(self) -> dict[str, Any]:
        """Return what ``retract estimate --json`` prints; SI units."""
        return self.as_json()

    def to_dataframe(self) -> Any:
        """Return a ``pandas.DataFrame`` with a row for each parameter of the material; SI units.

        Raises
        ------
        InputError
            pandas is not installed.
        """
        parameters = self.parameters
        return dataframe(
            {
                "parameter": list(parameters),
                "value": [one.value for one in parameters.values()],
                "std": [one.std for one in parameters.values()],
                "lower95": [one.interval95[0] for one in parameters.values()],
                "upper95": [one.interval95[1] for one in parameters.values()],
            },
            index="parameter",
        )

    def plot(self, kind: str = "wrench", experiment: int = 0) -> "Drawing":
        """Return a figure of the report.

        Parameters
        ----------
        kind : "wrench", "fiducials" or "body" of an experiment, "convergence" of the fit, "budget" where there is one
        experiment : number of the experiment, from 0

        Raises
        ------
        InputError
            There is no such figure.
        """
        from estimator.api.drawings import Draw, chosen
        from estimator.report.estimation import writing as report
        from estimator.report.estimation.body_plot import draw_body
        from estimator.report.estimation.budget import WIDTH_IN
        from estimator.report.estimation.budget_plot import draw_budget, height_in
        from estimator.report.estimation.convergence_plot import draw_convergence
        from estimator.report.estimation.fiducial_plot import draw_fiducials
        from estimator.report.estimation.wrench_plot import draw_wrench

        fit, budget = self.fits[experiment], self.budget
        of_budget: dict[str, tuple[Draw, tuple[float, float]]] = {}
        if budget is not None:
            of_budget["budget"] = (partial(draw_budget, budget=budget), (WIDTH_IN, height_in(budget)))
        return chosen(
            {
                "wrench": (partial(draw_wrench, fit=fit), report.WRENCH_SIZE_IN),
                "fiducials": (partial(draw_fiducials, fit=fit), report.FIDUCIALS_SIZE_IN),
                "body": (partial(draw_body, mesh=self.mesh, fit=fit), report.BODY_SIZE_IN),
                "convergence": (
                    partial(draw_convergence, estimate=self, truth=None),
                    report.CONVERGENCE_SIZE_IN,
                ),
                **of_budget,
            },
            kind,
        )

    def __repr__(self) -> str:
        from estimator.report.estimation.findings import parameter_texts

        return f"<Estimate {'; '.join(parameter_texts(self))}>"

    def _repr_html_(self) -> str:
        from estimator.report import page
        from estimator.report.estimation import findings

        sentences = [f"{', '.join(findings.parameter_texts(self))}.", findings.verdict(self)]
        return "".join([*map(page.headline, sentences), page.warnings(findings.caveats(self))])


def estimate(
    experiments: model.Experiment | Sequence[model.Experiment],
    *,
    law: str | Law = "neo_hookean",
    fixed: Mapping[str, float] | None = None,
    priors: Mapping[str, tuple[float, float] | None] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    loss: str = "linear",
    nuisances: Collection[str] = USUAL,
    profile: bool = False,
    budget: bool | Mapping[str, float] = False,
    progress: Progress | None = None,
) -> Estimate:
    """Estimate the parameters of the tissue from experiments of one phantom in one mounting.

    Parameters go by their names: ``youngs_modulus`` (Pa), ``poisson_ratio``, those of the law's shape. Each is
    estimated that is not fixed.

    Parameters
    ----------
    experiments : one or several
    law : of :mod:`estimator.materials` by name, or of your own
    fixed : parameters that are known
    priors : mean and standard deviation of what is known beforehand; None for nothing. Of Poisson's ratio a weak one is
        supposed, 0.40 to 0.49, and the result tells how much of the answer it is
    bounds : lower and upper
    loss : of the residuals: "linear", "huber" or "cauchy"
    nuisances : what is unknown besides, of :data:`estimator.fit.nuisances.NUISANCES`
    profile : whether intervals come from the profile likelihood
    budget : whether there is to be a budget of uncertainty; or the standard uncertainties, by name, of errors that the
        model does not have (:data:`estimator.fit.budget.systematic.SYSTEMATIC`), where others are not to be assumed
    progress : called with what is being done, how much of it is done, and how much there is

    Raises
    ------
    InputError
        The experiments are not of one mounting, the phantom cannot be meshed, or a name or a value is refused.
    FitError
        The data do not determine the parameters, or the fit does not converge.
    SolverError
        The motion has no equilibrium at the first guess.

    Examples
    --------
    >>> from estimator import Experiment, estimate, simulate
    >>> planned = Experiment.of_block([(0, 0, 0), (0.003, 0, 0), (0.006, 0, 0)])
    >>> measured = simulate(planned, youngs_modulus=15e3, mesh="coarse")
    >>> found = estimate(measured, fixed={"poisson_ratio": 0.45}, nuisances=["tare"])
    >>> bool(abs(found.youngs_modulus.value / 15e3 - 1) < 0.05)
    True
    >>> found.to_dict()["fixed"]
    ['poisson_ratio']
    """
    settings = replace(
        material_settings(law, fixed, priors, bounds),
        loss=loss_named(loss),
        nuisances=frozenset(nuisances),
        intervals="profile" if profile else "linear",
        budget=None if budget is False else Stated({} if budget is True else dict(budget)),
    )
    found = fit_experiments(several(experiments), progress, settings)
    return Estimate(**{field.name: getattr(found, field.name) for field in fields(result.Estimate)})


def material_settings(
    law: str | Law,
    fixed: Mapping[str, float] | None,
    priors: Mapping[str, tuple[float, float] | None] | None,
    bounds: Mapping[str, tuple[float, float]] | None,
) -> FitSettings:
    """Return what a fit is to know of the material."""
    return FitSettings(
        law=law_named(law) if isinstance(law, str) else law,
        fixed=dict(fixed or {}),
        priors={name: pair and NormalPrior(*pair) for name, pair in (priors or {}).items()},
        bounds=dict(bounds or {}),
    )
