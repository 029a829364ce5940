"""Break valid files of every kind in seeded ways, and judge how reader and verb refuse them.

A form that is refused has to end with exit status 2 and one line on standard error; nothing may be written, changed or
executed. A form that is still valid is counted and left alone.

Examples::

    python -m daq.bad_input --count 100
    python -m daq.bad_input --seed 7 --only STL plan --count 1000
    python -m daq.bad_input --seed 7 --only plan --first 31 --count 1 --tell   one form again, with what it is told

The exit status is 1 where something was found.
"""

import argparse
import sys
import time
from collections.abc import Sequence

from daq.bad_input.campaign import Finding, Tally, run_kind
from daq.bad_input.judging import Form, Verdict
from daq.bad_input.kinds import KINDS
from robot_drivers.fuzzing.bounds import limit_memory


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a campaign."""
    parser = argparse.ArgumentParser(
        prog="python -m daq.bad_input",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    names = [kind.name for kind in KINDS]
    parser.add_argument("--count", type=int, default=100, help="forms of each kind (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="default %(default)s")
    parser.add_argument("--first", type=int, default=0, help="number of the first form")
    parser.add_argument(
        "--only", nargs="+", choices=names, default=names, metavar="KIND", help=", ".join(names)
    )
    parser.add_argument("--tell", action="store_true", help="write what every form is told to standard error")
    options = parser.parse_args(arguments)
    if options.count < 1 or options.first < 0:
        parser.error("--count must be positive, --first not negative")
    limit_memory()
    begin_s = time.monotonic()
    tallies = []
    for kind in (kind for kind in KINDS if kind.name in options.only):
        numbers = range(options.first, options.first + options.count)
        tallies.append(run_kind(kind, options.seed, numbers, _write if options.tell else _keep_silent))
        sys.stderr.writelines(f"{_told(finding)}\n" for finding in tallies[-1].findings)
    sys.stdout.write(f"{_table(tallies)}\n{time.monotonic() - begin_s:.0f} s\n")
    return 1 if any(tally.findings for tally in tallies) else 0


def _table(tallies: Sequence[Tally]) -> str:
    lines = [f"{'kind':22} {'forms':>7} {'refused':>8} {'valid':>7} {'findings':>9}"]
    for tally in tallies:
        lines.append(_row(tally.kind.name, tally.forms, tally.refused, len(tally.findings)))
    forms, refused = sum(tally.forms for tally in tallies), sum(tally.refused for tally in tallies)
    lines.append(_row("all", forms, refused, sum(len(tally.findings) for tally in tallies)))
    return "\n".join(lines)


def _row(name: str, forms: int, refused: int, findings: int) -> str:
    return f"{name:22} {forms:7d} {refused:8d} {forms - refused:7d} {findings:9d}"


def _told(finding: Finding) -> str:
    form, verdict = finding.form, finding.verdict
    return (
        f"FINDING in {form.kind.name}, {verdict.damage}: {verdict.complaint}\n"
        f"  again: --seed {form.seed} --only '{form.kind.name}' --first {form.number} --count 1"
    )


def _write(form: Form, verdict: Verdict) -> None:
    outcome = "refused" if verdict.refused else "valid  "
    sys.stderr.write(f"{form.kind.name} {form.number} {verdict.damage}: {outcome} {verdict.told.strip()}\n")


def _keep_silent(_form: Form, _verdict: Verdict) -> None:
    return


if __name__ == "__main__":
    sys.exit(main())
