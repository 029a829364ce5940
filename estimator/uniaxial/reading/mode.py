"""Whether a test pulled or pushed: from the user's word, the file's words, the geometry, the signs, or the curve.

Machines write a compression positive as often as negative, so a positive strain tells nothing by itself.
"""

from dataclasses import dataclass

import numpy as np

from estimator.errors import InputError
from estimator.uniaxial.records import FloatArray, Mode

_LAW_FITS = 0.015  # root mean square over the range of stress
_TELLS_APART = 3.0
_LEAST_BEND = 0.2
_HARDLY_BENT = 0.25
_NEAR_ONE = 0.95


@dataclass(frozen=True, slots=True)
class Decision:
    """The mode, what told it, and whether that is supposed rather than stated."""

    mode: Mode
    reason: str
    supposed: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What tells the mode, the strongest first.

    Attributes
    ----------
    stated : the user's word
    in_titles : mode and title of a column that says it
    in_facts : mode and line above the table that says it
    height_grows : whether a column of the specimen's height grows or falls
    strain_sign, stress_sign : that the file gives to loading
    lengthening : title of a column that speaks of lengthening
    strain, stress : (n,) magnitudes of the first loading
    """

    stated: Mode | None
    in_titles: tuple[Mode, str] | None
    in_facts: tuple[Mode, str] | None
    height_grows: bool | None
    strain_sign: float
    stress_sign: float
    lengthening: str
    strain: FloatArray
    stress: FloatArray


def decide_mode(evidence: Evidence, where: str) -> Decision:
    """Decide.

    Raises
    ------
    InputError
        Nothing tells the mode, or what tells it is contradictory.
    """
    reach = float(evidence.strain.max())
    if evidence.stated is not None:
        decision = Decision(evidence.stated, "--mode")
    elif evidence.in_titles is not None:
        decision = _by_titles(evidence, where)
    elif evidence.in_facts is not None:
        decision = Decision(evidence.in_facts[0], f"the line {evidence.in_facts[1]!r}")
    elif evidence.height_grows is not None:
        decision = (
            Decision("tension", "the specimen's length, which grows")
            if evidence.height_grows
            else Decision("compression", "the specimen's height, which falls")
        )
    elif evidence.strain_sign < 0 and evidence.stress_sign < 0:
        decision = Decision("compression", "the signs: strain and stress are both negative")
    else:
        decision = _by_shape(evidence, where)
    if decision.mode == "compression" and reach >= 1:
        raise InputError(
            f"{where}: {decision.reason} tells a compression, and strain reaches {reach:.3g}, where nothing is left of "
            "the specimen; check the unit of strain and the gauge length, or add --mode tension"
        )
    return decision


def _by_titles(evidence: Evidence, where: str) -> Decision:
    assert evidence.in_titles is not None
    mode, title = evidence.in_titles
    decision = Decision(mode, f"the column {title!r}")
    if mode == "compression" or not evidence.strain_sign < 0:
        return decision
    # a negative "tensile strain" is a compression, and the curve has to bear it out
    shape = shape_of(evidence.strain, evidence.stress)
    if shape != "compression" and not (shape is None and evidence.stress_sign < 0):
        raise InputError(
            f"{where}: {title!r} runs negative, which speaks of compression; add --mode tension or --mode compression"
        )
    return Decision("compression", f"the signs: {title!r} and stress run negative", supposed=True)


def _by_shape(evidence: Evidence, where: str) -> Decision:
    reach = float(evidence.strain.max())
    if reach >= 1:
        return Decision("tension", f"a strain of {reach:.3g}, which no compression reaches")
    shape = shape_of(evidence.strain, evidence.stress)
    if shape == "tension" and evidence.strain_sign * evidence.stress_sign > 0:
        return Decision(
            "tension",
            "the curve, which does not stiffen as in compression; nothing in the file says it",
            True,
        )
    if shape == "compression":
        return Decision(
            "compression", "the curve, which stiffens as in compression; nothing in the file says it", True
        )
    if evidence.lengthening and shape is None and evidence.strain_sign > 0 and evidence.stress_sign > 0:
        return Decision(
            "tension", f"the column {evidence.lengthening!r}, which grows; nothing else says it", True
        )
    raise InputError(
        f"{where}: nothing tells whether the test pulled or pushed; add --mode tension or --mode compression"
    )


def shape_of(strain: FloatArray, stress: FloatArray) -> Mode | None:
    """Return the mode that the curve's shape tells, None where it is not decisive.

    Nominal stress of an incompressible solid rises ever faster in compression, and in tension ever slower at first. A
    curve that bends much less than a Neo-Hookean one in compression tells tension. One that stiffens may be a tissue in
    tension as well, so that only the very curve of compression tells compression.

    Parameters
    ----------
    strain, stress : (n,) magnitudes of the first loading
    """
    x, y = strain, stress
    span = float(np.ptp(y))
    if len(x) < 8 or span <= 0 or float(x.max()) >= 1:
        return None
    pushed, pulled = (_neo_hookean(x, mode) for mode in ("compression", "tension"))
    misfit_pushed, misfit_pulled = _misfit(pushed, y) / span, _misfit(pulled, y) / span
    bend, error = _bend(x, y)
    expected, _ = _bend(x, pushed)
    if expected >= _LEAST_BEND and bend + 3 * error < _HARDLY_BENT * expected:
        return "tension"
    if misfit_pushed <= _LAW_FITS and misfit_pulled >= _TELLS_APART * misfit_pushed and float(x.max()) >= 0.1:
        return "compression"
    return None


def _neo_hookean(strain: FloatArray, mode: str) -> FloatArray:
    stretch = 1 + strain if mode == "tension" else 1 - np.minimum(strain, _NEAR_ONE)
    return np.asarray(np.abs(stretch - stretch**-2))


def _misfit(shape: FloatArray, stress: FloatArray) -> float:
    design = np.stack([shape, np.ones_like(shape)], axis=1)
    values = np.linalg.lstsq(design, stress)[0]
    return float(np.sqrt(np.mean((design @ values - stress) ** 2)))


def _bend(strain: FloatArray, stress: FloatArray) -> tuple[float, float]:
    """Return by which share a curve's chord slope grows over its range, by a parabola, and the standard error."""
    x = strain / strain.max()
    design = np.stack([np.ones_like(x), x, x**2], axis=1)
    values = np.linalg.lstsq(design, stress)[0]
    rest = float(np.sum((design @ values - stress) ** 2)) / max(len(x) - 3, 1)
    error = float(np.sqrt(np.linalg.pinv(design.T @ design)[2, 2] * rest))
    total = float(values[1] + values[2])
    return float(values[2]) / total, error / abs(total)
