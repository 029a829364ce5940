"""Many broken forms of every kind, and what came of them."""

import shutil
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

from daq.bad_input.judging import Form, Verdict, judge
from daq.bad_input.kind import Kind


@dataclass(frozen=True, slots=True)
class Finding:
    """A form that was not refused as it has to be."""

    form: Form
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class Tally:
    """Counts of one kind, and what was found in it."""

    kind: Kind
    forms: int = 0
    refused: int = 0
    findings: tuple[Finding, ...] = field(default=())


def run_kind(
    kind: Kind,
    seed: int,
    numbers: Iterable[int],
    tell: Callable[[Form, Verdict], None] = lambda form, verdict: None,
) -> Tally:
    """Judge the forms of these numbers."""
    forms = refused = 0
    findings: list[Finding] = []
    with tempfile.TemporaryDirectory(prefix="bad-input-") as folder:
        kind.write(Path(folder))
        with tempfile.TemporaryDirectory(prefix="bad-input-") as copy:
            shutil.copytree(folder, copy, dirs_exist_ok=True)
            kind.read(Path(copy))  # the input has to be valid before it is broken
        for number in numbers:
            form = Form(kind, seed, number)
            verdict = judge(form, Path(folder))
            forms, refused = forms + 1, refused + verdict.refused
            if verdict.complaint:
                findings.append(Finding(form, verdict))
            tell(form, verdict)
    return Tally(kind, forms, refused, tuple(findings))
