"""The scripts of ``examples/`` that drive devices, in a reduced form."""

from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from daq.devices import FORCE_SENSOR, with_plugins
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.virtual_rig.processes import VirtualRigSettings
from estimator.plugins import Plugin

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture
def example(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """One of the scripts, imported."""
    monkeypatch.syspath_prepend(EXAMPLES)
    return import_module(request.param)


def script(name: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("example", [name], indirect=True)


@script("own_device")
def test_a_device_of_one_s_own_is_read_and_is_a_driver_that_a_rig_file_may_name(example: ModuleType) -> None:
    assert example.main(samples=20) == pytest.approx([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    plugin = Plugin(FORCE_SENSOR.entry_points, "line_sensor", "line-sensor 1.0", example.DRIVER)
    assert "line_sensor" in {driver.name for driver in with_plugins(FORCE_SENSOR, [plugin])}


@script("own_device")
@pytest.mark.parametrize("settings", [{"port": 0}, {"port": 70000}, {"port": 1, "rate_hz": 0.0}])
def test_its_settings_refuse_what_cannot_be(example: ModuleType, settings: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="must be"):
        example.LineSensorSettings(**settings)


@script("record_on_virtual_rig")
def test_a_script_records_on_the_virtual_rig(example: ModuleType, tmp_path: Path) -> None:
    springs = SpringPhantom(GRASP_CENTRE, placed_beads(1))
    experiment = example.main(tmp_path, VirtualRigSettings(springs, seed=1, frames_per_s=4.0), steps=1)
    assert np.ptp(experiment.position[:, 0]) == pytest.approx(2e-3, abs=1e-4)
    assert (tmp_path / "session").is_dir()
