"""Diagnosis from a script, and a diagnosis that shows itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import TYPE_CHECKING, Any

from estimator.api.estimating import material_settings
from estimator.api.experiments import several
from estimator.api.tables import dataframe
from estimator.diagnosis import result
from estimator.diagnosis.conclusions.as_json import as_json
from estimator.diagnosis.diagnose import diagnose as diagnose_experiments
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import Catalogue
from estimator.experiment import model
from estimator.fit.linearisation import Progress
from estimator.materials import Law

if TYPE_CHECKING:
    from estimator.api.drawings import Drawing


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(result.Diagnosis):
    """What a diagnosis found; the attributes are those of :class:`estimator.diagnosis.result.Diagnosis`."""

    @classmethod
    def of(cls, diagnosis: result.Diagnosis) -> "Diagnosis":
        """Return a diagnosis of the package's inside as one that shows itself."""
        return cls(**{field.name: getattr(diagnosis, field.name) for field in fields(result.Diagnosis)})

    def to_dict(self) -> dict[str, Any]:
        """Return what ``retract diagnose --json`` prints; SI units."""
        return as_json(self)

    def to_dataframe(self) -> Any:
        """Return a ``pandas.DataFrame`` with a row for each effect, the most probable first.

        Raises
        ------
        InputError
            pandas is not installed.
        """
        found = sorted(self.effects.values(), key=lambda one: -one.probability)
        return dataframe(
            {
                "effect": [one.label for one in found],
                "form": [one.form for one in found],
                "group": [one.group for one in found],
                "state": [one.state for one in found],
                "probability": [one.probability for one in found],
                "chi2_drop": [one.chi2_drop for one in found],
                "closure_held_out": [one.closure_held_out for one in found],
            },
            index="effect",
        )

    def plot(self, kind: str = "causes", experiment: int = 0) -> "Drawing":
        """Return a figure of the report.

        Parameters
        ----------
        kind : "causes" with their probabilities, "gap" before and after, "where" it lies; or of one experiment "map"
            (the beads from above), "wrench" or "residuals"
        experiment : number of the experiment, from 0

        Raises
        ------
        InputError
            There is no such figure.
        """
        from estimator.api.drawings import chosen
        from estimator.report.diagnosis import writing as report
        from estimator.report.diagnosis.causes_plot import draw_causes
        from estimator.report.diagnosis.gap_plot import draw_gap
        from estimator.report.diagnosis.heat_map import draw_heat_maps
        from estimator.report.diagnosis.map_plot import draw_map
        from estimator.report.diagnosis.where_plot import draw_where
        from estimator.report.diagnosis.wrench_plot import draw_wrenches

        trace = self.traces[experiment]
        return chosen(
            {
                "causes": (partial(draw_causes, diagnosis=self), report.causes_size_in(self)),
                "gap": (partial(draw_gap, diagnosis=self), report.gap_size_in(self)),
                "where": (partial(draw_where, where=self.where), report.where_size_in(self.where)),
                "map": (partial(draw_map, diagnosis=self, trace=trace), report.MAP_IN),
                "wrench": (partial(draw_wrenches, trace=trace), report.WRENCH_IN),
                "residuals": (partial(draw_heat_maps, trace=trace), report.HEAT_IN),
            },
            kind,
        )

    def __repr__(self) -> str:
        from estimator.report.diagnosis.findings import verdict_sentence

        return f"<Diagnosis: {verdict_sentence(self)}>"

    def _repr_html_(self) -> str:
        from estimator.report import page
        from estimator.report.diagnosis import findings, tables

        sentences = [
            findings.verdict_sentence(self),
            *findings.explanations(self),
            findings.gap_sentence(self.gap),
        ]
        return "".join([*map(page.headline, sentences), tables.effect_table(self), tables.gap_table(self)])


def diagnose(
    experiments: model.Experiment | Sequence[model.Experiment],
    progress: Progress | None = None,
    *,
    catalogue: Catalogue | None = None,
    settings: DiagnosisSettings | None = None,
    law: str | Law = "neo_hookean",
    fixed: Mapping[str, float] | None = None,
    priors: Mapping[str, tuple[float, float] | None] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
) -> Diagnosis:
    """Diagnose the gap between the model and the experiments of one phantom in one mounting.

    Effects that other installed packages declare are looked for as well. It takes a minute or two, on every core.

    Parameters
    ----------
    experiments : one or several, with the same phantom, anchors, grasp and fiducials
    progress : called with what is being done, how much of it is done, and how much there is
    catalogue : the effects that are looked for; by default this project's and those of installed packages
    settings : of every number that is not physics, each with its unit, kind and reason
    law, fixed, priors, bounds : of the tissue, as :func:`estimator.estimate` takes them; shape parameters that are not
        fixed are fitted to a few states, and kept

    Raises
    ------
    InputError
        The phantom cannot be meshed.
    FitError
        The baseline cannot be fitted.
    SolverError
        The baseline has no equilibrium.

    Examples
    --------
    >>> from estimator import Experiment, diagnose, simulate
    >>> planned = Experiment.of_block([(0, 0, 0), (0.003, 0, 0), (0.006, 0, 0), (0.009, 0, 0)])
    >>> measured = simulate(planned, effects=["camera_scale=0.02"], mesh="coarse")
    >>> found = diagnose(measured)
    >>> sorted(found.to_dict())[:4]
    ['credible_set', 'effects', 'gap', 'material']
    >>> figure = found.plot("causes")
    """
    return Diagnosis.of(
        diagnose_experiments(
            several(experiments),
            progress,
            catalogue=catalogue,
            settings=settings,
            material=material_settings(law, fixed, priors, bounds),
        )
    )
