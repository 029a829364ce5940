"""Fits laws to a uniaxial record over small strains and ranks them by their error at larger ones.

The error inside the fitted range falls with every parameter that a law has. The error beyond it tells whether
the law is the cause of the curve or merely bends like it.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.materials import LAWS
from estimator.materials.law import Law
from estimator.uniaxial.law_fit import FEWEST_ROWS, FloatArray, LawFit, fit_law, specimen_stretch
from estimator.uniaxial.records import DEFAULT_STRAIN_FIT, UniaxialRecord
from estimator.uniaxial.stress import is_stable


@dataclass(frozen=True, slots=True)
class RankedLaw:
    """A fitted law and how it did.

    Attributes
    ----------
    fit : the law with its parameters
    rms_fit : root mean square error over the fitted rows, Pa
    rms_test : the same over the held-out rows; infinite where the law admits no such strain
    stable : whether its stress grows with stretch in uniaxial, equibiaxial and planar tests, up to the
        largest strain that it was held against
    """

    fit: LawFit
    rms_fit: float
    rms_test: float
    stable: bool


@dataclass(frozen=True, slots=True)
class UniaxialFit:
    """All laws on one record, the smallest held-out error first; of equals the simpler one.

    Strains are magnitudes: rows in [``strain_from``, ``strain_fit``] were fitted, rows in
    (``strain_fit``, ``strain_test``] held out.
    """

    record: UniaxialRecord
    strain_from: float
    strain_fit: float
    strain_test: float
    rows_fit: int
    rows_test: int
    ranking: tuple[RankedLaw, ...]
    caveats: tuple[str, ...]

    @property
    def best(self) -> RankedLaw:
        """The best ranked law that is stable; the best ranked where none is."""
        return next((ranked for ranked in self.ranking if ranked.stable), self.ranking[0])

    def closure(self, ranked: RankedLaw) -> float | None:
        """Return the share of the Neo-Hookean held-out error that a law removes; None without that law."""
        for baseline in self.ranking:
            if baseline.fit.law.name == "neo_hookean":
                return 1 - ranked.rms_test / baseline.rms_test
        return None


def fit_record(
    record: UniaxialRecord,
    laws: Iterable[Law] = tuple(LAWS.values()),
    *,
    strain_from: float = 0.0,
    strain_fit: float | None = None,
    strain_test: float | None = None,
    slack_limit: float = 0.0,
) -> UniaxialFit:
    """Fit every law to a range of strain and rank them by their error beyond it.

    Parameters
    ----------
    strain_from, strain_fit, strain_test : magnitudes of engineering strain. By default the fit runs up to 0.5
        in tension, about the largest local strain of a retraction, and up to 0.2 in compression, where
        barrelling grows with strain; the test up to twice that. Both end earlier where the record does.
    slack_limit : largest slack (or, negative, pre-load) in strain that the fit may find; 0 holds it at zero.

    Raises
    ------
    InputError
        The ranges do not ascend, or hold too few rows.
    FitError
        A law cannot be fitted.
    """
    magnitude = np.abs(record.strain)
    reach = float(magnitude.max())
    fit_to = _default_range(record, magnitude, strain_from) if strain_fit is None else strain_fit
    test_to = min(2 * fit_to, reach) if strain_test is None else strain_test
    if not 0 <= strain_from < fit_to < test_to < np.inf:
        raise InputError(
            f"strain ranges {strain_from:g} to {fit_to:g} to {test_to:g} do not ascend; "
            f"choose others (the record ends at {reach:g})"
        )
    if not 0 <= slack_limit < fit_to:
        raise InputError(f"slack limit {slack_limit:g} is not between 0 and the fitted strain {fit_to:g}")
    fitted = (magnitude >= strain_from) & (magnitude <= fit_to)
    held_out = (magnitude > fit_to) & (magnitude <= test_to)
    if fitted.sum() < FEWEST_ROWS or not held_out.any():
        raise InputError(
            f"{fitted.sum()} rows to fit (of {FEWEST_ROWS} needed) and {held_out.sum()} beyond them; "
            f"widen the ranges of strain (the record ends at {reach:g})"
        )
    ranking = [_judge(law, record, fitted, held_out, slack_limit) for law in laws]
    ranking.sort(key=lambda ranked: (float(f"{ranked.rms_test:.4g}"), len(ranked.fit.parameters)))
    return UniaxialFit(
        record=record,
        strain_from=strain_from,
        strain_fit=fit_to,
        strain_test=test_to,
        rows_fit=int(fitted.sum()),
        rows_test=int(held_out.sum()),
        ranking=tuple(ranking),
        caveats=_caveats(record, ranking, slack_limit),
    )


def _default_range(record: UniaxialRecord, magnitude: FloatArray, strain_from: float) -> float:
    """Return the strain up to which laws are fitted: half a record that is short, more of one with few rows."""
    fit_to = min(DEFAULT_STRAIN_FIT[record.mode], float(magnitude.max()) / 2)
    fitted = np.sort(magnitude[magnitude >= strain_from])
    if strain_from >= fit_to or len(fitted) <= FEWEST_ROWS + 1:
        return fit_to
    return max(fit_to, float(fitted[FEWEST_ROWS - 1]))


def _judge(
    law: Law,
    record: UniaxialRecord,
    fitted: NDArray[np.bool_],
    held_out: NDArray[np.bool_],
    slack_limit: float,
) -> RankedLaw:
    fit = fit_law(law, record.strain[fitted], record.stress[fitted], slack_limit)
    rms_test = fit.rms_error(record.strain[held_out], record.stress[held_out])
    used = record.strain[held_out if np.isfinite(rms_test) else fitted]
    return RankedLaw(
        fit=fit,
        rms_fit=fit.rms_error(record.strain[fitted], record.stress[fitted]),
        rms_test=rms_test,
        stable=is_stable(law, _shape(fit), _farthest(used, fit)),
    )


def _shape(fit: LawFit) -> FloatArray:
    return np.array([parameter.value for parameter in fit.shape])


def _farthest(strain: FloatArray, fit: LawFit) -> float:
    slack = 0.0 if fit.slack is None else fit.slack.value
    stretch = specimen_stretch(strain, slack)
    return float(stretch[np.argmax(np.abs(np.log(stretch)))])


def _caveats(record: UniaxialRecord, ranking: list[RankedLaw], slack_limit: float) -> tuple[str, ...]:
    caveats = []
    moduli = [ranked.fit.youngs_modulus for ranked in ranking]
    low, high = min(m.value for m in moduli), max(m.value for m in moduli)
    if high - low > 2 * float(np.median([m.std for m in moduli])):
        caveats.append(
            f"E ranges from {low / 1e3:.3g} to {high / 1e3:.3g} kPa over the laws: the choice of the law "
            "outweighs the standard errors, which do not contain it."
        )
    if record.strain_from_crosshead and slack_limit == 0:
        caveats.append(
            "Strain is the machine's travel: slack and grip slip are in it and bend the curve's beginning. "
            "Free the slack, or fit from a strain above it, and see whether E holds."
        )
    if record.mode == "compression":
        caveats.append(_friction_caveat(record))
    unstable = [ranked.fit.law.name for ranked in ranking if not ranked.stable]
    if unstable:
        caveats.append(
            f"Unstable in another mode of deformation: {', '.join(unstable)}. A description of this curve, "
            "not a law to compute with."
        )
    return tuple(caveats)


def _friction_caveat(record: UniaxialRecord) -> str:
    """Bound by a bonded disc (A. N. Gent and P. B. Lindley, Proc. Inst. Mech. Eng. 173 (1959) 111)."""
    text = (
        "The fit assumes faces that slide freely. Where they stick, the specimen barrels and reads too stiff"
    )
    if record.shape_factor is None:
        return f"{text}, by a factor up to 1 + 2 S², S = diameter / (4 height)."
    factor = 1 + 2 * record.shape_factor**2
    return f"{text}, by a factor up to 1 + 2 S² = {factor:.2f} (S = {record.shape_factor:.2f})."
