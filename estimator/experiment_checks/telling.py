"""What was found, as lines for a person and as data for a program."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from estimator.experiment_checks.checking import CHECKS, Checked
from estimator.experiment_checks.finding import Finding


def as_text(checked: Sequence[Checked]) -> str:
    """Return one line for each finding, and one for each folder of which there is nothing to say."""
    return "\n".join(line for one in checked for line in _lines(one))


def as_data(checked: Sequence[Checked]) -> dict[str, Any]:
    """Return the same for a program."""
    return {
        "wrong": any(one.wrong for one in checked),
        "checks": list(CHECKS),
        "folders": [
            {
                "folder": str(one.folder),
                "grade": grade_of(one),
                "findings": [{**asdict(finding), "where": finding.where} for finding in one.findings],
            }
            for one in checked
        ],
    }


def grade_of(checked: Checked) -> str:
    """Return the worst grade of a folder."""
    grades = {finding.grade for finding in checked.findings}
    return next((grade for grade in ("wrong", "suspicious") if grade in grades), "fine")


def _lines(checked: Checked) -> list[str]:
    if not checked.findings and checked.experiment is None:
        return []  # nothing between the experiments of a case
    lines = [
        f"{finding.grade:10}  {_place(checked, finding)}: {_said(finding)}" for finding in checked.findings
    ]
    if grade_of(checked) == "fine":
        lines.append(f"{'fine':10}  {checked.folder}: {len(CHECKS)} checks, nothing to say")
    return lines


def _place(checked: Checked, finding: Finding) -> str:
    return f"{checked.folder}/{finding.where}" if finding.where else str(checked.folder)


def _said(finding: Finding) -> str:
    return f"{finding.what}; {finding.do}" if finding.do else finding.what
