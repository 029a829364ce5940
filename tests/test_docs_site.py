"""The site that ``docs/build.py`` makes: whole, with nothing from elsewhere, and refused where something is wrong."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from doc_commands import ROOT

PACKAGES = ("robot_drivers", "estimator.materials")  # all of them take minutes
# What a browser would fetch of itself from another address, in a page or in a style sheet.
FROM_ELSEWHERE = re.compile(
    r"""<(?:script|img|iframe|link\s+rel="(?:stylesheet|preload|icon)")[^>]*\s(?:src|href)="(?:https?:)?//"""
    r"""|(?:url\(|@import\s+)["']?(?:https?:)?//"""
)


def build(project: Path, folder: Path, *packages: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(project / "docs" / "build.py"), str(folder)]
    options = [f"--package={name}" for name in packages]
    return subprocess.run([*command, *options], check=False, capture_output=True, text=True, timeout=250)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    made = build(ROOT, folder, *PACKAGES)
    assert (made.returncode, made.stderr) == (0, "")
    return folder


def page(site: Path, name: str) -> str:
    return (site / "docs" / f"{name}.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "text",
    [
        '<link rel="stylesheet" type="text/css" href="https://fonts.example/a.css" />',
        '<script defer src="//cdn.example/mathjax.js"></script>',
        '@import "https://fonts.example/a.css";',
        "src: url(https://fonts.example/a.woff2)",
    ],
)
def test_what_a_browser_would_fetch_is_found(text: str) -> None:
    assert FROM_ELSEWHERE.search(text)


def test_its_front_page_leads_to_the_sections(site: Path) -> None:
    assert "docs/README.html" in (site / "index.html").read_text(encoding="utf-8")
    front = page(site, "README")
    for section in ("tutorial", "how-to", "explanation", "reference", "gallery", "decisions/README"):
        assert f'href="{section}.html"' in front


def test_formulas_are_drawn_by_the_browser_itself(site: Path) -> None:
    assert "<mfrac" in page(site, "method/conclusions")
    assert "$$" not in page(site, "method/conclusions")


def test_the_reference_has_units_sources_and_signatures(site: Path) -> None:
    devices = page(site, "reference/robot_drivers")
    assert "ForceSensor" in devices
    assert "receive stamp on the host clock, ns" in devices
    assert "A. N. Gent" in page(site, "reference/estimator.materials")


def test_it_reads_without_a_network(site: Path) -> None:
    files = [
        path for path in site.rglob("*") if path.suffix in (".html", ".css") and ".work" not in path.parts
    ]
    assert len(files) > 40
    found = {str(path.relative_to(site)) for path in files if FROM_ELSEWHERE.search(path.read_text("utf-8"))}
    assert found == set()


@pytest.fixture
def small_project(tmp_path: Path) -> Path:
    """A project of one page and one package, with this one's settings."""
    project = tmp_path / "project"
    shutil.copytree(ROOT / "docs" / "site", project / "docs" / "site")
    for name in ("docs/build.py", "pyproject.toml", "CITATION.cff", "LICENSE"):
        shutil.copy2(ROOT / name, project / name)
    beside_the_code = ("robot_drivers/abb/rapid/README.md", "robot_drivers/universal_robots/script/README.md")
    for name in ("CHANGELOG.md", "CONTRIBUTING.md", *beside_the_code):
        (project / name).parent.mkdir(parents=True, exist_ok=True)
        (project / name).write_text("# A page\n", encoding="utf-8")
    (project / "docs" / "README.md").write_text("# The front page\n", encoding="utf-8")
    contents = """root: docs/README
entries:
- file: CHANGELOG
- file: CONTRIBUTING
- file: robot_drivers/abb/rapid/README
- file: robot_drivers/universal_robots/script/README
- glob: docs/reference/*
"""
    (project / "docs" / "site" / "_toc.yml").write_text(contents, encoding="utf-8")
    (project / "documented").mkdir()
    (project / "documented" / "__init__.py").write_text('"""A package."""\n', encoding="utf-8")
    return project


def test_a_small_project_is_made(small_project: Path, tmp_path: Path) -> None:
    made = build(small_project, tmp_path / "out", "documented")
    assert (made.returncode, made.stderr) == (0, "")


@pytest.mark.parametrize(
    ("file", "text", "complaint"),
    [
        ("docs/README.md", "# A page\n\n[nowhere](nowhere.md)\n", "nowhere.md"),
        ("docs/README.md", "# A page\n\n[a heading](../CHANGELOG.md#none)\n", "none"),
        ("docs/stray.md", "# In no section\n", "stray"),
        ("documented/__init__.py", '"""A docstring with ``half a quotation."""\n', "literal"),
        ("documented/__init__.py", "import a_module_that_is_not_there\n", "a_module_that_is_not_there"),
    ],
    ids=["link", "anchor", "page in no section", "docstring", "import"],
)
def test_what_is_wrong_is_told(
    small_project: Path, tmp_path: Path, file: str, text: str, complaint: str
) -> None:
    (small_project / file).write_text(text, encoding="utf-8")
    made = build(small_project, tmp_path / "out", "documented")
    assert made.returncode == 1
    assert complaint in made.stderr
