"""In which block something unknown lies: the one whose effects, all at once, could do what it does."""

import numpy as np
import pytest
from bare_contexts import bare_context, no_error_in
from numpy.typing import NDArray

from estimator.diagnosis.evidence.blocks import evidence_of_blocks, shares_of_unknown
from estimator.diagnosis.evidence.discrepancy import Discrepancy
from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.fitting.case import Linearisation
from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.screening import moments_beside
from estimator.effects.catalogue import CATALOGUE, OUTSIDERS

FloatArray = NDArray[np.float64]

MATERIAL = Hypothesis(15e3, 0.45)
DIRECTIONS = np.linalg.qr(np.random.default_rng(7).normal(size=(400, 12)))[0]
# Anything smooth of the wrench lies along three of them, of the fiducials along three others.
WRENCH, FIDUCIALS = DIRECTIONS[:, 6:9], DIRECTIONS[:, 9:12]
ERROR = no_error_in(Discrepancy((WRENCH, FIDUCIALS), (np.ones(3), np.ones(3))))
# Deviations of noise by which an effect of the usual size moves the measurements.
USUAL = 30.0


def signature(name: str, *directions: FloatArray) -> Signature:
    effect = next(one for one in (*CATALOGUE, *OUTSIDERS) if one.name == name)
    null = MATERIAL.with_effect(effect, {amplitude.name: 0.0 for amplitude in effect.amplitudes})
    free = [c for c in free_parameters(null) if c.effect == 0][: len(directions)]
    columns = np.column_stack([USUAL * d / c.prior_scale for d, c in zip(directions, free, strict=True)])
    return Signature(effect, {}, tuple(free), (columns,))


SIGNATURES = [
    signature("camera_scale:uniform", DIRECTIONS[:, 2]),
    signature("unknown:slanted_view", DIRECTIONS[:, 3]),
    signature("motion_scale:translation", (DIRECTIONS[:, 2] + DIRECTIONS[:, 4]) / np.sqrt(2.0)),
    signature("force_axis_gain:fx", DIRECTIONS[:, 5]),
]


def shares(misfit: FloatArray, power: float = 0.3) -> dict[str, float]:
    base = Linearisation(MATERIAL, free_parameters(MATERIAL), (), (misfit,), (DIRECTIONS[:, :2],), (), ())
    context = bare_context(base, error=ERROR)
    moments = moments_beside(context, SIGNATURES)
    return shares_of_unknown(evidence_of_blocks(moments, base.free_parameters, SIGNATURES, ERROR), power)


def test_what_two_effects_of_a_block_do_together_lies_in_that_block_whether_they_have_labels_or_not() -> None:
    found = shares(20.0 * DIRECTIONS[:, 2] + 15.0 * DIRECTIONS[:, 3])
    assert max(found, key=lambda name: found[name]) == "vision"
    assert found["vision"] > 0.95
    assert sum(found.values()) == pytest.approx(1.0)


@pytest.mark.parametrize(("channels", "block"), [(WRENCH, "force"), (FIDUCIALS, "vision")])
def test_what_shows_in_the_channels_of_one_sensor_alone_lies_there(channels: FloatArray, block: str) -> None:
    found = shares(channels @ np.array([12.0, -9.0, 10.0]))
    assert max(found, key=lambda name: found[name]) == block
    assert found[block] > 0.9


def test_where_nothing_stands_out_no_block_does() -> None:
    found = shares(np.zeros(400))
    assert max(found.values()) < 2.0 / len(found)
