"""Whether a test pulled or pushed: from the user's word, the file's words, the geometry, the signs, or the curve.

Machines write a compression positive as often as negative, so a positive strain tells nothing by itself.
"""

from dataclasses import dataclass

import numpy as np

from estimator.errors import InputError
from estimator.uniaxial.loading import noise_of
from estimator.uniaxial.records import FloatArray, Mode

_FIRST_PART = 0.3  # of strain: what a law does at large strain does not tell the mode
_LEAST_REACH = 0.1
# Bends that tell a mode, over the Neo-Hookean one in tension and in compression.
_BENDS_DOWN = (0.3, 1.9)
_BENDS_UP = (0.85, 1.25)
_STIFF_BY_THEN, _STRAIGHT = 0.5, 0.02  # strain, and misfit over the range of stress
_LAW_FITS = 0.006  # root mean square over the range of stress
_IN_NOISE = 2.0
_TELLS_APART = 3.0
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
    in_names : mode and name, of the file, its sheet or the specimen, that says it
    strain, stress : (n,) magnitudes of the first loading
    """

    stated: Mode | None
    in_titles: tuple[Mode, str] | None
    in_facts: tuple[Mode, str] | None
    height_grows: bool | None
    strain_sign: float
    stress_sign: float
    lengthening: str
    in_names: tuple[Mode, str] | None
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
    elif evidence.in_names is not None:
        mode, name = evidence.in_names
        decision = Decision(mode, f"the name {name!r}; nothing else in the file says it", supposed=True)
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
            "the curve, which bends as in tension; nothing in the file says it",
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

    To second order nominal stress of every incompressible isotropic solid is E (e - k e²) of signed strain e, with k of
    1 (Neo-Hookean) to 2. So the first part of its curve bends down in tension and up in compression, by an amount that
    does not depend on the law. A foam in compression bends down much more. What bends up may be a tissue in tension,
    too, so that only the very curve of a Neo-Hookean solid tells compression. A straight line may be either, unless it
    is straight up to strains where everything that is compressed has become stiff.

    Parameters
    ----------
    strain, stress : (n,) magnitudes of the first loading
    """
    span, reach = float(np.ptp(stress)), float(strain.max())
    if span <= 0 or reach >= 1:
        return None
    if reach >= _STIFF_BY_THEN and _misfit(strain, stress) <= _STRAIGHT * span:
        return "tension"
    first = strain <= _FIRST_PART
    x, y = strain[first], stress[first]
    if len(x) < 8 or float(x.max()) < _LEAST_REACH or float(np.ptp(y)) <= 0:
        return None
    bend, error = _bend(x, y)
    down, up = (_bend(x, _neo_hookean(x, mode))[0] for mode in ("tension", "compression"))
    if _within(bend, error, (_BENDS_DOWN[0] * down, _BENDS_DOWN[1] * down)):
        return "tension"
    misfits = {
        mode: _misfit(_neo_hookean(strain, mode), stress) / span for mode in ("compression", "tension")
    }
    follows = misfits["compression"] <= max(_LAW_FITS, _IN_NOISE * noise_of(stress) / span)
    tells_apart = misfits["tension"] >= _TELLS_APART * misfits["compression"]
    if follows and tells_apart and _within(bend, error, (_BENDS_UP[0] * up, _BENDS_UP[1] * up)):
        return "compression"
    return None


def _within(value: float, error: float, bounds: tuple[float, float]) -> bool:
    """Tell whether a value lies between bounds, and its error is small against their distance."""
    return min(bounds) <= value <= max(bounds) and 3 * error <= abs(bounds[1] - bounds[0]) / 2


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
