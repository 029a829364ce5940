"""``retract faults``: complete sessions on the virtual rig with a fault at a random instant, judged one by one."""

import argparse
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.errors import DaqError

if TYPE_CHECKING:
    from daq.faults.fault import Fault
    from daq.faults.trial import Outcome

_EXAMPLES = """  retract faults --seed 1 --runs 500 --jobs 3
  retract faults --list                          what is done, and what is right for it
  retract faults --seed 1 --runs 20 --only disk
  retract faults --seed 1 --run 137              one run once more

A campaign that was stopped goes on where it was: its results stand line by line in a file."""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    summary = "break complete sessions on the virtual rig by faults at random instants, and judge what comes of them"
    parser = add_verb(verbs, "faults", summary, _EXAMPLES, run)
    parser.add_argument("--seed", type=int, default=1, help="of all chance (default: %(default)s)")
    parser.add_argument("--runs", type=int, default=25, metavar="N", help="sessions (default: %(default)s)")
    parser.add_argument(
        "--jobs", type=int, default=1, metavar="N", help="rigs at once (default: %(default)s)"
    )
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="WORDS",
        help="faults whose name contains this; repeatable",
    )
    parser.add_argument(
        "--run", type=int, dest="single", metavar="K", help="do run K of the campaign once more"
    )
    parser.add_argument("--list", action="store_true", help="tell the faults and what is right for each")
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="of the results (default: runs/faults/seed_SEED.jsonl)"
    )


def run(options: argparse.Namespace) -> Result:
    """Carry out what is missing of a campaign, and judge all of it."""
    if sys.platform != "linux":
        raise DaqError(
            "the fault campaign fills disks and stops programs as only Linux lets it; run it there"
        )
    from daq.faults.campaign import fault_of, named, single_run

    if options.runs < 1 or options.jobs < 1 or (options.single is not None and options.single < 0):
        raise DaqError("--runs and --jobs must be at least 1, --run at least 0")
    faults = named(options.only)
    if options.list:
        lines = [
            f"{fault.label}\n{textwrap.indent(textwrap.fill(fault.right, 100), '    ')}" for fault in faults
        ]
        return Result("\n".join(lines), {"faults": {fault.label: fault.right for fault in faults}})
    if options.single is not None:
        fault = fault_of(options.single, faults)
        return _judged([single_run(options.seed, options.single, fault)], faults)
    return _campaign(options, faults)


def _campaign(options: argparse.Namespace, faults: "Sequence[Fault]") -> Result:
    from daq.faults.campaign import Abandoned, carry_out_all, fault_of, keep, read_results

    path = options.out or Path("runs") / "faults" / f"seed_{options.seed}.jsonl"
    done = {
        run: outcome
        for run, outcome in read_results(path, options.seed).items()
        if run < options.runs and outcome.fault == fault_of(run, faults).label
    }
    missing = [run for run in range(options.runs) if run not in done]
    abandoned = []
    with progress() as tell:
        for result in carry_out_all(options.seed, missing, faults, options.jobs):
            if isinstance(result, Abandoned):
                abandoned.append(f"run {result.run}, {result.why}")
                continue
            keep(path, result)
            done[result.run] = result
            tell(f"{len(done)} of {options.runs}: {result.fault}", len(done), options.runs)
    return _judged(list(done.values()), faults, abandoned)


def _judged(
    outcomes: "Sequence[Outcome]", faults: "Sequence[Fault]", abandoned: "Sequence[str]" = ()
) -> Result:
    from daq.faults.table import as_data, complaints, rows, text

    found, wrong = rows(outcomes, faults), [*abandoned, *complaints(outcomes, faults)]
    load = max((outcome.load for outcome in outcomes), default=0.0)
    words = f"{len(outcomes)} runs, {len(wrong)} complaints; load of the machine up to {load:.1f}"
    data = {
        "runs": len(outcomes),
        "passed": not wrong,
        "faults": as_data(found),
        "complaints": wrong,
        "load": load,
    }
    return Result("\n".join([text(found), *wrong, words]), data, 1 if wrong else 0)
