"""What run.py tells while it installs, and how it goes on after an interruption."""

import importlib.util
import io
import os
from pathlib import Path
from types import ModuleType

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "run.py"
PIP_SAYS = """Collecting numpy==2.4.6 (from -r requirements.lock (line 12))
  Downloading numpy-2.4.6-cp311-cp311-manylinux_2_28_x86_64.whl.metadata (62 kB)
  Downloading numpy-2.4.6-cp311-cp311-manylinux_2_28_x86_64.whl (16.6 MB)
Processing ./wheels/scipy-1.17.1-cp311-cp311-manylinux_2_28_x86_64.whl
Collecting mcap==1.6.0 (from -r requirements.lock (line 543))
  Using cached mcap-1.6.0-py3-none-any.whl (400 kB)
Requirement already satisfied: rich==15.0.0 in ./site-packages
Installing collected packages: numpy, scipy, mcap
"""


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """run.py, with a .venv elsewhere."""
    spec = importlib.util.spec_from_file_location("run_py", SOURCE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "VENV", tmp_path)
    return module


def record(run: ModuleType, name: str, *, whole: bool = True) -> Path:
    """The record of an installed package; pip names the installer in it when all files are there."""
    library = "Lib" if run.WINDOWS else "lib/python3.11"
    place = run.VENV / library / "site-packages" / f"{name}-1.0.dist-info"
    place.mkdir(parents=True)
    (place / "METADATA").touch()
    if whole:
        (place / "INSTALLER").write_text("pip\n", encoding="utf-8")
    return Path(place)


def told(run: ModuleType, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """What is told when every line of pip's takes long."""
    shown = run.Installation()
    for line in io.StringIO(PIP_SAYS):
        shown._told_s -= 100.0
        shown.hear(line)
    record(run, "numpy")
    shown._told_s -= 100.0
    shown.hear("")
    shown.end()
    return [line.partition(": ")[2] for line in capsys.readouterr().err.splitlines()]


def test_packages_and_megabytes_are_told_line_by_line(
    run: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = told(run, capsys)
    assert lines[0] == "1 packages looked up, 0 MB fetched; now numpy"
    assert lines[2] == "1 packages looked up, 17 MB fetched; now numpy"
    assert lines[3] == "2 packages looked up, 17 MB fetched; now scipy"
    assert lines[6] == "4 packages looked up, 17 MB fetched; now rich"
    assert lines[-2:] == [
        "1 of 3 packages installed, 17 MB fetched",
        "3 of 3 packages installed, 17 MB fetched",
    ]


def test_a_package_on_which_pip_was_interrupted_is_installed_again(run: ModuleType) -> None:
    whole, half = record(run, "numpy"), record(run, "scipy", whole=False)
    run.forget_half_installed()
    assert whole.exists()
    assert not half.exists()


def test_modules_are_compiled_once_also_where_none_may_be_written_beside_the_sources(
    run: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    monkeypatch.setenv("PYTHONPYCACHEPREFIX", "")
    del os.environ["PYTHONPYCACHEPREFIX"]
    monkeypatch.setattr(run.signal, "signal", lambda number, handler: None)
    monkeypatch.setattr(run, "set_up", lambda lock: None)
    monkeypatch.setattr(run, "retract", lambda arguments: 0)
    assert run.main(["devices"]) == 0
    assert "PYTHONDONTWRITEBYTECODE" not in os.environ
    assert os.environ["PYTHONPYCACHEPREFIX"] == str(run.VENV / "compiled")
