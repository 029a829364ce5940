"""What is said of an effect that the verdict does not name, and of where the cause lies."""

import numpy as np
import pytest

from estimator.diagnosis.conclusions.findings import sizes_beside
from estimator.diagnosis.conclusions.localisation import shares_of_blocks
from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.fitting.case import Linearisation
from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.search.screening import Trial
from estimator.effects.catalogue import CATALOGUE

MATERIAL = Hypothesis(15e3, 0.45)
DIRECTIONS = np.linalg.qr(np.random.default_rng(9).normal(size=(300, 3)))[0]
PER_METRE = 1e5  # deviations of noise by which the measurements move per m/N


def yielding() -> Trial:
    """A gripper that yields, which it cannot do backwards, seen along one direction of the measurements."""
    effect = next(one for one in CATALOGUE if one.name == "gripper_compliance:translation")
    null = MATERIAL.with_effect(effect, {"compliance": 0.0})
    free = tuple(c for c in free_parameters(null) if c.effect == 0)
    return Trial(Signature(effect, {}, free, (PER_METRE * DIRECTIONS[:, 2:],)), 0.0, null)


@pytest.mark.parametrize(("seen", "expected"), [(12.0, 12.0 / PER_METRE), (-12.0, 0.0)])
def test_a_size_that_an_effect_cannot_have_is_not_told(seen: float, expected: float) -> None:
    misfit = seen * DIRECTIONS[:, 2]
    fit = Linearisation(MATERIAL, free_parameters(MATERIAL), (), (misfit,), (DIRECTIONS[:, :2],), (), ())
    sizes = sizes_beside(fit, yielding())
    assert sizes.names == ("compliance",)
    assert sizes.value[0] == pytest.approx(expected, rel=1e-2)
    assert sizes.std[0] == pytest.approx(1.0 / PER_METRE, rel=1e-2)
    assert sizes.chi2_drop == pytest.approx(144.0 if expected else 0.0, rel=1e-2)


def test_something_unknown_lies_where_it_is_recognised_and_else_in_what_block_could_do_the_like() -> None:
    told = {"unknown": 0.7, "force_bias": 0.2, "none": 0.1}
    alike = {"force": 0.5, "vision": 0.5}
    groups = {"force_bias": "force", "camera_scale": "vision"}
    assert shares_of_blocks(told, alike, groups, "robot")["robot"] == pytest.approx(0.7)
    unrecognised = shares_of_blocks(told, alike, groups, None)
    assert unrecognised["force"] == pytest.approx(0.2 + 0.35)
    assert unrecognised["vision"] == pytest.approx(0.35)
