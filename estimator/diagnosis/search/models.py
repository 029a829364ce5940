"""The table of models: no cause, one or two, each without and with something unknown beside.

Every model has a log prior, a log evidence and a verdict. Its prior is that of its causes, of a second one and its
choice among all labels. It also pays for what signatures that are inexact feign: a share of what the causes explain
may look like a second cause, or like something unknown beside them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import Literal

import numpy as np

from estimator.diagnosis.evidence.cross_validation import lost_on_held_out
from estimator.diagnosis.evidence.feigned import feigned_evidence, may_be_feigned
from estimator.diagnosis.evidence.lack_of_fit import rough_remainder
from estimator.diagnosis.evidence.marginal_likelihood import evidence_of_unknown
from estimator.diagnosis.evidence.noise_floor import white_floor
from estimator.diagnosis.evidence.posterior import log_priors
from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.model.hypothesis import negligible_effects
from estimator.diagnosis.model.labels import NONE, UNKNOWN
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.family import explained_by_other_forms

Standing = Literal["believed", "explains too little", "foretells worse", "leaves too much"]


@dataclass(frozen=True)
class Model:
    """One row of the table.

    Attributes
    ----------
    causes : labels
    unknown : whether there is something unknown beside them
    log_prior : with what inexact signatures, and for a second cause the mesh's own error, may feign taken off
    log_evidence : log marginal likelihood
    verdict : whether it is believed beside the best model with fewer causes and beside something unknown, or why not
    """

    causes: tuple[str, ...]
    unknown: bool
    log_prior: float
    log_evidence: float
    verdict: Standing

    @property
    def explains_more(self) -> bool:
        """Whether it explains enough more than fewer causes."""
        return self.verdict in ("believed", "leaves too much")


@dataclass(frozen=True, eq=False)
class ModelTable:
    """The models of a case, each beside those that it has to beat.

    Attributes
    ----------
    context : with the fitted baseline
    none, unknown : log evidence of no cause, without and with something unknown
    signatures : of the catalogue, beside the baseline
    """

    context: Context
    none: float
    unknown: float
    signatures: Sequence[Signature] = ()

    def without_cause(self, rough: float) -> tuple[Model, Model]:
        """Return the models without a cause; ``rough`` is what no smooth misfit explains of the baseline's."""
        prior = log_priors(self.context.catalogue.labels, self.context.settings.evidence)
        more = max(self.unknown, self.none + rough)
        plain: Standing = "leaves too much" if rough else "believed"
        beside: Standing = "believed" if rough else "explains too little"
        return (
            Model((), False, prior[NONE], self.none, plain),
            Model((), True, prior[UNKNOWN], more, beside),
        )

    def with_one(self, one: Candidate) -> Model:
        """Return the model of a single cause."""
        return Model(one.labels, False, self._log_prior_of_one(), one.log_evidence, "believed")

    def beside(self, model: Model, refitted: Candidate, explained_by_unknown: float = 0.0) -> Model:
        """Return the model with the same causes and something unknown beside them.

        Parameters
        ----------
        model, refitted : without it, and its hypothesis refitted
        explained_by_unknown : what an effect without a label among the causes raises the log evidence by
        """
        explained = model.log_evidence - self.none - explained_by_unknown
        more = self.remainder(refitted)
        asked = self.asked_of_unknown(explained)
        return replace(
            model,
            unknown=True,
            log_prior=model.log_prior - asked,
            log_evidence=model.log_evidence + more,
            verdict="believed" if more >= asked else "explains too little",
        )

    def with_two(self, one: Candidate, pairs: Sequence[Candidate], unknown_leads: bool) -> list[Model]:
        """Return the models of pairs of causes, held against the best one alone and against something unknown."""
        prior = self._log_prior_of_one()
        return [
            Model(
                pair.labels,
                False,
                prior - self._asked_beside(one, pair),
                pair.log_evidence,
                self._standing(one, pair, unknown_leads),
            )
            for pair in pairs
        ]

    def _log_prior_of_one(self) -> float:
        catalogue, settings = self.context.catalogue, self.context.settings.evidence
        return log_priors(catalogue.labels, settings)[catalogue.labels[0]]

    def _standing(self, one: Candidate, pair: Candidate, unknown_leads: bool) -> Standing:
        """Tell whether two causes are believed, or why not.

        Any two explain a part of what no effect alone does: they must leave no more than noise, or less beyond it than
        the second one explains, and where the unknown leads, less than they explain beyond that. Experiments left
        out are to be foretold no worse than by one alone. A second one smaller than anybody would care for is none.
        """
        settings = self.context.settings
        ahead, gain = pair.log_evidence - self.unknown, pair.log_evidence - one.log_evidence
        left = 0.5 * self.beyond_noise(pair)
        little = left < gain + settings.search.shared and (not unknown_leads or left < ahead)
        negligible = any(effect.label not in one.labels for effect in negligible_effects(pair.fit.hypothesis))
        found: Standing = "believed"
        if negligible or gain < self._asked_beside(one, pair):
            found = "explains too little"
        elif any(
            lost_on_held_out(pair.fit, fit, settings.evidence) for fit in (self.context.baseline, one.fit)
        ):
            found = "foretells worse"
        elif not (ahead > settings.search.decisive and (little or self.is_whole(pair))):
            found = "leaves too much"
        return found

    def explained(self, one: Candidate) -> float:
        """Return by how much a candidate raises the log evidence over that of no cause."""
        return max(one.log_evidence - self.none, 0.0)

    def asked_of_two(self, first: Candidate, labels: Collection[str]) -> float:
        """Return by how much two causes with these labels must raise the log evidence beyond a first one.

        That is what the prior of a second one and its choice among all labels cost, and the share of what the first one
        explains that its inexactness may leave for another, and what other forms of it would explain. Beside 40 single
        causes of 9 to 370 σ in their right form others promised 4.9 at the most, those of negligible size 2.8; but 14
        beside friction, and 71 beside relaxation, where a bead lay at the corner of the jaws. Of 32 more, diagnosed
        blind, one was believed to have a second cause that is not there: it added 8.0.
        """
        settings, explained = self.context.settings, self.explained(first)
        inexact = max(effect.inexactness for effect in first.fit.hypothesis.effects)
        choice = float(np.log(len(self.context.catalogue.labels)))
        asked = choice - float(np.log(settings.evidence.prior_of_a_pair)) + inexact * explained
        asked += self.of_family(first)
        if first.labels[0] not in labels:
            asked += choice  # both of its causes are chosen anew
        return max(asked, self.asked_of_unknown(explained)) if UNKNOWN in labels else asked

    @cached_property
    def of_family(self) -> Callable[[Candidate], float]:
        """By how much what else its own label could do raises a candidate's log evidence."""
        return cache(partial(explained_by_other_forms, self.context, self.signatures))

    def _asked_beside(self, one: Candidate, pair: Candidate) -> float:
        """Return what a refitted pair must gain over one of its causes: what the mesh's own error could feign added."""
        context = self.context
        further = [effect for effect in pair.fit.hypothesis.effects if effect.label not in one.labels]
        asked = self.asked_of_two(one, pair.labels)
        if any(map(may_be_feigned, further)):
            asked += feigned_evidence(context.case, one.fit, context.error, pair.fit.predicted)
        return asked

    def asked(self, two: Model) -> float:
        """Return by how much a model of two causes was asked to raise the log evidence."""
        return self._log_prior_of_one() - two.log_prior

    def asked_of_unknown(self, explained: float) -> float:
        """Return what must be gained by something unknown beside causes that explain so much, or by a cause beside it.

        What is recognised outside the catalogue has one of many forms, none of them its own, and leaves a little too.
        """
        settings = self.context.settings.search
        return max(settings.decisive, settings.remainder * explained)

    def least_of_two(self, alone: Candidate) -> float:
        """Return the log evidence that two causes must promise beside the best one alone: others lie in a hollow."""
        return alone.log_evidence - self.context.settings.search.another_hollow * self.explained(alone)

    def smooth_remainder(self, one: Candidate) -> float:
        """Return by how much something unknown beside a candidate raises the log evidence, but for single readings."""
        return evidence_of_unknown(self.context.case, one.fit, self.context.error) - one.log_evidence

    def remainder(self, one: Candidate) -> float:
        """Return by how much something unknown beside a candidate raises the log evidence."""
        floor, settings = white_floor(self.context.case), self.context.settings.evidence
        return max(self.smooth_remainder(one), rough_remainder(one.fit.residual, floor, settings))

    def is_whole(self, one: Candidate) -> bool:
        """Tell whether a candidate leaves no more than noise: with something unknown it is no more probable.

        That is sharper than its sum of squares, of which the errors that rows share are a part as well: in right forms
        the log evidence differed by -2.4 to 0.5 on 15 cases, in others by 30 and more.
        """
        return self.smooth_remainder(one) < self.context.settings.search.strong

    def beyond_noise(self, one: Candidate) -> float:
        """Return by how much the sum of squares that a candidate leaves exceeds that of noise."""
        values = sum(len(residual) for residual in one.fit.residual)
        return one.fit.chi2 - values * white_floor(self.context.case) ** 2

    def may_be_two(self, leader: Candidate, promised: float) -> bool:
        """Tell whether a second cause could explain more than it leaves, by what two promise to first order.

        Any two effects explain a part of what no effect alone does; errors that rows share may be left as well.
        """
        settings = self.context.settings.search
        gain = settings.kept * max(promised - leader.log_evidence, 0.0)
        return 0.5 * self.beyond_noise(leader) - gain < gain + settings.shared
