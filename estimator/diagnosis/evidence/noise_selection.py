"""How little is left of the errors that rows share, as far as the measurements bear it out at the best fit there is.

What may be left at most hides much: of what meshes leave, and of errors of the rest positions, which a mesh feigns. The
noise is chosen by the baseline, and anew once a cause is found: before that, its own misfit seems to be what is left.
Whatever was linearised stays as it is but for the discretisation's corrections, and is whitened anew.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from estimator.diagnosis.evidence.noise_evidence import FitInAnyNoise
from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.fitting.case import Case, Linearisation, predictions, residuals
from estimator.diagnosis.fitting.refit import refit
from estimator.diagnosis.noise.correlated_errors import CorrelatedErrors, beads_beside_rim
from estimator.diagnosis.noise.errors_left import ErrorsLeft


@dataclass(frozen=True, eq=False)
class CaseLeaving:
    """A case as it is where so much is left: called with the same, it returns the same object.

    Attributes
    ----------
    case : in any noise
    shared : of each experiment, the errors that its rows may share
    """

    case: Case
    shared: Sequence[CorrelatedErrors]

    def __call__(self, left: ErrorsLeft) -> Case:
        """Return the case with the noise that goes with what is left of the errors that rows share."""
        return self._made(left)

    @cached_property
    def _made(self) -> Callable[[ErrorsLeft], Case]:
        return cache(
            lambda left: replace(
                self.case, errors_left=left, whitenings=tuple(one.whitening(left) for one in self.shared)
            )
        )


def most_probable_noise(cases: CaseLeaving, case: Case, fit: Linearisation) -> Case:
    """Return that of cases, which differ in what may be left, in which the misfit of a fit is the most probable.

    One after the other, each bead beside the rim apart, with what is usual of those to come: more of meshes elsewhere
    would stand in for the rim, and more of either for the rest positions; these are therefore looked at again in the
    end. What meshes make of the grasp's edges stays: it is no bound but the most probable. ``case`` is the one of them
    in which the fit was made.
    """
    settings = case.settings.noise
    shares, usual = settings.shares_left, settings.usual_share_left

    corrected = replace(case, corrections=cases.case.corrections)
    fit_there = FitInAnyNoise.of(corrected, in_another_case(fit, case, corrected), cases.shared)
    log_density = cache(fit_there.log_density)

    def at_rest(left: ErrorsLeft) -> ErrorsLeft:
        return max((replace(left, at_rest=share) for share in shares), key=log_density)

    beads = len(case.experiments[0].fiducials_rest)
    likely = at_rest(ErrorsLeft(usual, (usual,) * beads, usual))
    beside = [beads_beside_rim(experiment, settings) for experiment in case.experiments]
    for bead in sorted(set().union(*beside)):
        before, after = likely.beside_rim[:bead], likely.beside_rim[bead + 1 :]
        likely = max(
            (replace(likely, beside_rim=(*before, share, *after)) for share in shares), key=log_density
        )
    likely = max((replace(likely, elsewhere=share) for share in shares), key=log_density)
    return cases(at_rest(likely))


def noise_cost(case: Case) -> float:
    """Return half the log determinant of the noise's covariance, up to a constant of the case."""
    return 0.5 * float(np.sum([whitening.log_determinant for whitening in case.whitenings]))


def in_another_case(fit: Linearisation, before: Case, after: Case) -> Linearisation:
    """Return the linearisation of one case in another, which differs in the noise and the discretisation's corrections.

    The derivatives stay those that they were but for the noise.
    """
    if after.corrections is not before.corrections:
        corrected = replace(before, corrections=after.corrections)
        fit = replace(
            fit,
            predicted=tuple(predictions(corrected, fit.mechanics, fit.hypothesis)),
            residual=tuple(residuals(corrected, fit.mechanics, fit.hypothesis)),
        )
    pairs = list(zip(after.whitenings, before.whitenings, strict=True))
    return replace(
        fit,
        residual=tuple(
            new.anew(r[:, None], old)[:, 0] for (new, old), r in zip(pairs, fit.residual, strict=True)
        ),
        jacobian=tuple(new.anew(c, old) for (new, old), c in zip(pairs, fit.jacobian, strict=True)),
        next_share=1.0,
    )


def refitted_anew(baseline: Linearisation, before: Case, after: Case) -> Linearisation:
    """Return the fitted baseline of one case as it is fitted in another, which differs as :func:`in_another_case` says.

    Raises
    ------
    SolverError
        A load step has no equilibrium.
    """
    return refit(
        after,
        baseline.hypothesis,
        in_another_case(baseline, before, after),
        after.settings.noise.evaluations_of_baseline,
    )


def signatures_anew(signatures: Sequence[Signature], before: Case, after: Case) -> list[Signature]:
    """Return signatures in one case as they are in another, which differs from it in the noise alone."""
    ends = np.cumsum([len(signature.free_parameters) for signature in signatures])[:-1]
    pairs = enumerate(zip(after.whitenings, before.whitenings, strict=True))
    # All at once: a product of large matrices takes a fraction of the time of hundreds of thin ones.
    blocks = [
        np.split(new.anew(np.hstack([one.columns[number] for one in signatures]), old), ends, axis=1)
        for number, (new, old) in pairs
    ]
    return [replace(one, columns=columns) for one, *columns in zip(signatures, *blocks, strict=True)]
