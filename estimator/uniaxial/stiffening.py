"""From which strain on a record bears a stiffening law: where such a law predicts larger strains better.

Inside the fitted range a law with one parameter more always fits better. Fitted up to a strain and held against
strains up to twice that, it may well predict worse; stiffening is claimed only where it does not.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.errors import InputError
from estimator.materials import LAWS
from estimator.uniaxial.fit import fit_record
from estimator.uniaxial.law_fit import FEWEST_ROWS
from estimator.uniaxial.records import UniaxialRecord

# Each fitted range ends at one of these strains; the compression of a cylinder is hardly homogeneous beyond the last.
_RANGES = {"tension": (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0), "compression": (0.05, 0.1, 0.15, 0.2, 0.3)}
_BASELINE = "neo_hookean"
_STIFFENING = ("yeoh2", "gent", "ogden1")
# A law that is right takes most of the error away; chance takes some.
_LEAST_CLOSURE = 0.5


@dataclass(frozen=True, slots=True)
class Rung:
    """One fitted range, from zero strain on.

    Attributes
    ----------
    strain_fit, strain_test : magnitudes; rows up to the first were fitted, from there to the second held out
    law : the stable stiffening law that fits best within the range
    closure_fit, closure_held_out : share of the Neo-Hookean error that it takes away, negative where it adds to it
    """

    strain_fit: float
    strain_test: float
    law: str
    closure_fit: float
    closure_held_out: float

    @property
    def claimed(self) -> bool:
        """Whether the held-out strains bear stiffening out."""
        return self.closure_held_out >= _LEAST_CLOSURE


def stiffening_ladder(record: UniaxialRecord) -> tuple[Rung, ...]:
    """Fit growing ranges of strain and hold each against the strains up to twice as far.

    Raises
    ------
    InputError
        The record is too short for any range.
    FitError
        A law cannot be fitted.
    """
    magnitude = np.abs(record.strain)
    ends = [
        end
        for end in _RANGES[record.mode]
        if np.sum(magnitude <= end) >= FEWEST_ROWS and 2 * end <= magnitude.max()
    ]
    if not ends:
        raise InputError(
            f"{record.name}: {len(magnitude)} rows up to a strain of {magnitude.max():.3g} are too few to tell "
            "stiffening; give a longer record"
        )
    return tuple(_rung(record, end) for end in ends)


def _rung(record: UniaxialRecord, end: float) -> Rung:
    fit = fit_record(
        record, [LAWS[name] for name in (_BASELINE, *_STIFFENING)], strain_fit=end, strain_test=2 * end
    )
    by_name = {ranked.fit.law.name: ranked for ranked in fit.ranking}
    baseline = by_name.pop(_BASELINE)
    chosen = min(by_name.values(), key=lambda ranked: (not ranked.stable, ranked.rms_fit))
    return Rung(
        strain_fit=end,
        strain_test=2 * end,
        law=chosen.fit.law.name,
        closure_fit=1 - chosen.rms_fit / baseline.rms_fit,
        closure_held_out=1 - chosen.rms_test / baseline.rms_test,
    )


def stiffens_from(ladder: Sequence[Rung]) -> float | None:
    """Return the strain from which on every longer range bears stiffening out; None where the longest does not."""
    onset = None
    for rung in reversed(ladder):
        if not rung.claimed:
            break
        onset = rung.strain_fit
    return onset
