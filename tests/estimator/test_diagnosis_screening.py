"""Which effects are looked for at all: those whose ground, hold or sensor is there."""

from dataclasses import replace

import pytest
from bare_contexts import bare_context
from retraction_cases import SMALL_BLOCK

from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.fitting.case import Case
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.screening import Trial, can_show, leading_trials
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.effects.catalogue import default_catalogue
from estimator.effects.effect import Effect
from estimator.experiment.model import SurfaceBelow
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment

CATALOGUE = (*default_catalogue().effects, *default_catalogue().outsiders)
COARSE = Grading(grasp_m=5e-3, anchor_m=8e-3, largest_m=15e-3, growth=2.0, layers=1)


def looked_for(below: SurfaceBelow) -> set[str]:
    """Names of the effects that are looked for in a block with that below it."""
    block = replace(SMALL_BLOCK, environment=replace(SMALL_BLOCK.environment, surface_below=below))
    context = bare_context(case=Case((block,), mesh_experiment(block, COARSE), (), (), ()))
    return {effect.name for effect in CATALOGUE if can_show(effect, context)}


@pytest.mark.parametrize("part", ["support_friction", "unknown:sticky_patch", "unknown:air_pocket"])
def test_what_a_table_does_is_looked_for_only_where_there_is_one(part: str) -> None:
    gone = looked_for("table") - looked_for("none")
    assert [name for name in gone if name.startswith(part)]
    assert all(effect.needs_table for effect in CATALOGUE if effect.name in gone)
    assert looked_for("none") < looked_for("table")


def trial_of(effect: Effect, log_evidence: float) -> Trial:
    start = Hypothesis(1e4, 0.45).with_effect(effect, {})
    return Trial(Signature(effect, {}, (), ()), log_evidence, start)


@pytest.mark.parametrize(("gain", "refitted"), [(60.0, True), (20.0, False)])
def test_what_sets_in_at_thresholds_is_refitted_behind_however_many_if_it_promises_something(
    gain: float, refitted: bool
) -> None:
    first_forms = {effect.label: effect for effect in reversed(CATALOGUE)}
    sliding = next(effect for effect in first_forms.values() if effect.at_thresholds)
    others = [effect for effect in first_forms.values() if not effect.at_thresholds][:12]
    trials = [trial_of(effect, 100.0 - n) for n, effect in enumerate(others)] + [trial_of(sliding, gain)]
    settings = DiagnosisSettings().search
    chosen = leading_trials(trials, 0.0, settings)
    assert (trials[-1] in chosen) == refitted
    assert [one for one in chosen if one is not trials[-1]] == trials[: settings.candidates]
