"""What is handed over of sensors and cameras does to observations what the effects themselves do."""

import ast
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from estimator import Experiment
from estimator.effects.catalogue import CATALOGUE, OUTSIDERS
from estimator.effects.effect import Effect, Readings
from estimator.effects.shared.sensor_steps import sensor_steps_of
from estimator.handover import observations as handed
from estimator.handover.observations import Observations, as_recorded

TOLD = [
    effect
    for effect in (*CATALOGUE, *OUTSIDERS)
    if "readings" in effect.acts_on and hasattr(effect, "sensor_steps")
]


def readings(order: int = 2) -> Readings:
    random = np.random.default_rng(5)
    planned = Experiment.of_block(np.linspace((0, 0, 0), (0.01, 0.002, 0), 9), order=order)
    shape = planned.fiducials.shape
    rotation = Rotation.from_rotvec(np.linspace((0, 0, 0), (0.3, -0.2, 0.5), 9))
    return Readings(
        planned,
        planned.position + random.normal(0, 1e-3, (9, 3)),
        rotation,
        planned.position,
        random.normal(0, 2, (9, 6)),
        planned.fiducials + random.normal(0, 3e-3, shape),
        random.normal(0, 0.3, 6),
        planned.fiducials_rest + random.normal(0, 1e-3, shape[1:]),
    )


def values_of(effect: Effect) -> dict[str, float]:
    """Every amplitude at a usual size, every constant at a place of its own."""
    values = {a.name: min(a.scale * (0.7 + 0.1 * n), a.upper) for n, a in enumerate(effect.amplitudes)}
    places = {
        "order": 2.0,
        "time": 3.5,
        "bead": 4.0,
        "first": 1.0,
        "second": 7.0,
        "source": 2.0,
        "target": 4.0,
    }
    for constant in effect.constants:
        middle = constant.grid[len(constant.grid) // 2] if constant.grid else 0.4
        values[constant.name] = places.get(constant.name, middle)
    return values


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("effect", TOLD, ids=lambda effect: effect.name)
def test_steps_do_what_the_effect_does(effect: Effect, order: int) -> None:
    seen, values = readings(order), values_of(effect)
    steps = sensor_steps_of(effect, seen.experiment, values)
    assert steps is not None
    expected = effect.readings(seen, values)
    found = as_recorded(
        Observations(
            seen.experiment.time,
            seen.position,
            seen.rotation.as_matrix(),
            seen.wrench,
            seen.fiducials,
            seen.experiment.fiducials_rest,
            seen.reported_position,
            seen.rest_wrench,
            seen.rest_fiducials,
        ),
        steps,
    )
    np.testing.assert_allclose(found.wrench, expected.wrench, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.beads, expected.fiducials, rtol=0, atol=1e-12)


def test_every_labelled_sensor_and_camera_cause_can_be_handed_over() -> None:
    of_sensors = [effect for effect in CATALOGUE if effect.stage in ("force", "vision")]
    assert [effect.name for effect in of_sensors if not hasattr(effect, "sensor_steps")] == []


def test_an_effect_that_has_not_told_its_steps_says_so() -> None:
    silent = [e for e in (*CATALOGUE, *OUTSIDERS) if "readings" in e.acts_on and e not in TOLD]
    assert silent
    assert all(sensor_steps_of(effect, readings().experiment, {}) is None for effect in silent)


def test_the_copied_file_needs_numpy_alone() -> None:
    tree = ast.parse(Path(handed.__file__).read_text(encoding="utf-8"))
    modules = {
        name.split(".")[0]
        for node in ast.walk(tree)
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [node.module or ""]
            if isinstance(node, ast.ImportFrom)
            else []
        )
    }
    assert modules - set(sys.stdlib_module_names) == {"numpy"}


def test_a_step_of_another_version_is_refused_by_its_name() -> None:
    seen = readings()
    rows = Observations(
        seen.experiment.time,
        seen.position,
        seen.rotation.as_matrix(),
        seen.wrench,
        seen.fiducials,
        seen.fiducials[0],
    )
    with pytest.raises(ValueError, match="no step is called 'smell'"):
        as_recorded(rows, [{"kind": "smell"}])
