"""The reference from docstrings, for a few modules; all of them take a minute."""

import runpy
import sys
from pathlib import Path

import pytest
from doc_commands import ROOT

make = runpy.run_path(str(ROOT / "docs" / "reference.py"))["main"]


def test_it_has_a_page_for_a_module_with_its_units_and_sources(tmp_path: Path) -> None:
    modules = ("robot_drivers.protocols", "estimator.materials.gent")
    assert make([str(tmp_path), *(f"--module={name}" for name in modules)]) == 0
    page = (tmp_path / "robot_drivers" / "protocols.html").read_text(encoding="utf-8")
    assert "ForceSensor" in page
    assert "ns" in page
    assert "A. N. Gent" in (tmp_path / "estimator" / "materials" / "gent.html").read_text(encoding="utf-8")


def test_a_docstring_that_cannot_be_read_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "broken_module.py").write_text('import warnings\nwarnings.warn("a complaint", UserWarning)\n')
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    assert make([str(tmp_path / "pages"), "--module=broken_module"]) == 1
    assert "a complaint" in capsys.readouterr().err
