"""Where a gap lies: by channel, by phase, by block of the rig, and in the plane."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.model.labels import NONE, UNKNOWN
from estimator.diagnosis.result import Where
from estimator.diagnosis.search.candidate import Candidate
from estimator.effects.blocks import BLOCK_OF_GROUP, Group

FloatArray = NDArray[np.float64]

_CHANNELS = ("fx", "fy", "fz", "tx", "ty", "tz", "fiducials_x", "fiducials_y", "fiducials_z")


def where_of(
    case: Case,
    baseline: Linearisation,
    probabilities: Mapping[str, float],
    leading: Mapping[str, float],
    groups: Mapping[str, Group],
    chosen: Candidate | None,
) -> Where:
    """Return where the gap lies.

    Parameters
    ----------
    case, baseline : whose misfit it is
    probabilities : of each answer
    leading : the same among the catalogue's labels alone, which place the share of an unknown that was not recognised
    groups : of each label
    chosen : the fit with the causes in; None where there are none
    """
    blocks = shares_of_blocks(probabilities, leading, groups, _group_of_unknown(chosen))
    channels, steps = _excess(case, baseline)
    centre, deviation, radius = _place(case, chosen)
    return Where(channels, steps, blocks, centre, deviation, radius)


def shares_of_blocks(
    probabilities: Mapping[str, float],
    leading: Mapping[str, float],
    groups: Mapping[str, Group],
    recognised: Group | None,
) -> dict[str, float]:
    """Return the probability that the cause lies in each block of the rig.

    ``recognised`` is the group of what is recognised as unknown, which then lies there; the other parameters are as in
    :func:`where_of`.
    """
    of_group = dict.fromkeys(BLOCK_OF_GROUP, 0.0)
    for label, probability in probabilities.items():
        if label not in (NONE, UNKNOWN):
            of_group[groups[label]] += probability
    if recognised is not None:
        of_group[recognised] += probabilities[UNKNOWN]
    else:
        for label, share in leading.items():
            of_group[groups[label]] += share * probabilities[UNKNOWN]
    blocks = dict.fromkeys(BLOCK_OF_GROUP.values(), 0.0)
    for group, probability in of_group.items():
        blocks[BLOCK_OF_GROUP[group]] += probability
    return blocks


def _group_of_unknown(chosen: Candidate | None) -> Group | None:
    """Return the group of the effect without a label in a hypothesis; None where there is none."""
    effects = chosen.fit.hypothesis.effects if chosen is not None else ()
    return next((effect.group for effect in effects if effect.label == UNKNOWN), None)


def _excess(case: Case, fit: Linearisation) -> tuple[dict[str, float], dict[str, float]]:
    """Return the shares of χ² beyond the noise by channel, and by experiment and phase."""
    by_channel, by_phase = dict.fromkeys(_CHANNELS, 0.0), {}
    for r, whitening, experiment in zip(fit.residual, case.whitenings, case.experiments, strict=True):
        row, channel = np.nonzero(whitening.seen)
        excess = r**2 - 1.0
        kind = np.where(channel < 6, channel, 6 + (channel - 6) % 3)
        for number, name in enumerate(_CHANNELS):
            by_channel[name] += float(excess[kind == number].sum())
        phases = np.array(experiment.phase)[row]
        for phase in dict.fromkeys(experiment.phase):
            by_phase[f"{experiment.name}/{phase}"] = float(excess[phases == phase].sum())
    return _shares(by_channel), _shares(by_phase)


def _shares(excess: Mapping[str, float]) -> dict[str, float]:
    positive = {name: max(value, 0.0) for name, value in excess.items()}
    total = sum(positive.values()) or 1.0
    return {name: value / total for name, value in positive.items()}


def _place(
    case: Case, chosen: Candidate | None
) -> tuple[tuple[float, float, float] | None, tuple[float, float, float] | None, float | None]:
    """Return centre, its standard deviation and radius of a cause that has a place in the plane."""
    centre, deviation, radius = None, None, None
    if chosen is not None:
        hypothesis = chosen.fit.hypothesis
        effects = zip(hypothesis.effects, hypothesis.values, strict=True)
        places = ((effect.name, effect.place(case.problem, values)) for effect, values in effects)
        name, found = next(((one, place) for one, place in places if place is not None), ("", None))
        if found is not None:
            (x, y, z), radius = found
            centre = (float(x), float(y), float(z))
            deviation = _of_centre(chosen, name)
    return centre, deviation, radius


def _of_centre(chosen: Candidate, effect: str) -> tuple[float, float, float] | None:
    """Return the standard deviation of the centre of an effect; None where it is not free in the plane."""
    deviation = dict(zip((c.name for c in chosen.fit.free_parameters), chosen.deviations, strict=True))
    x, y = (deviation.get(f"{effect}.centre_{axis}") for axis in "xy")
    return None if x is None or y is None else (float(x), float(y), 0.0)
