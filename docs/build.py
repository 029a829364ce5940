"""Make the documentation site: ``python docs/build.py FOLDER``, then open FOLDER/index.html.

The pages are those of docs/, the reference is made of the docstrings, and the contents are in docs/site/_toc.yml.
Nothing is fetched. It ends with status 1 where a link leads nowhere, a page is in no section, or a docstring cannot
be read. A second call makes only what has changed.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SITE = ROOT / "docs" / "site"
ROOMS = ("robot_drivers", "estimator", "daq", "gui")
# What the site takes from outside docs/, at the same relative places, so that the same links hold.
BESIDE = (
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "CITATION.cff",
    "LICENSE",
    "robot_drivers/abb/rapid/README.md",
    "robot_drivers/universal_robots/script/README.md",
)

# The front page is docs/README.md, which is that of the folder as well.
TO_THE_FRONT_PAGE = (
    '<!doctype html><meta http-equiv="refresh" content="0; url=docs/README.html"><title>Documents</title>'
)


def main(arguments: list[str]) -> int:
    """Make the site and return the exit status."""
    parser = argparse.ArgumentParser(description="Make the documentation site.")
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="of the site")
    parser.add_argument(
        "--package",
        action="append",
        metavar="NAME",
        help="the reference of this one only; repeat for several",
    )
    options = parser.parse_args(arguments)
    folder = options.folder.resolve()
    source = folder / ".work" / "source"
    gather(source)
    packages = tuple(options.package or all_packages())
    write_reference(source / "docs" / "reference", packages)
    # libraries look for a display when they are imported
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    sys.path.insert(0, str(ROOT))
    from sphinx.cmd.build import build_main

    folder.mkdir(parents=True, exist_ok=True)
    (folder / "index.html").write_text(TO_THE_FRONT_PAGE, encoding="utf-8")
    where = ["-c", str(SITE), "-d", str(folder / ".work" / "doctrees"), str(source), str(folder)]
    return build_main(["--quiet", "--fail-on-warning", *where])


def gather(source: Path) -> None:
    """Copy the pages to ``source``, with their times, so that what has not changed is not made anew."""
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(
        ROOT / "docs", source / "docs", ignore=shutil.ignore_patterns("site", "*.py", "__pycache__")
    )
    for name in BESIDE:
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, source / name)


def all_packages() -> list[str]:
    """Return every package of the rooms, in order."""
    folders = [place.parent for room in ROOMS for place in sorted((ROOT / room).rglob("__init__.py"))]
    return [".".join(folder.relative_to(ROOT).parts) for folder in folders]


def write_reference(folder: Path, packages: tuple[str, ...]) -> None:
    """Write a page for each package that has its docstrings taken, and those of its modules."""
    folder.mkdir(parents=True, exist_ok=True)
    for package in packages:
        place = ROOT.joinpath(*package.split("."))
        modules = [
            path.stem for path in sorted(place.glob("*.py")) if path.stem not in ("__init__", "__main__")
        ]
        parts = [(package, package, "="), *((name, f"{package}.{name}", "-") for name in modules)]
        text = "\n".join(
            f"{title}\n{line * len(title)}\n\n.. automodule:: {module}\n" for title, module, line in parts
        )
        (folder / f"{package}.rst").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
