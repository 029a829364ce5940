"""``retract benchmark make``: sealed cases for the diagnosis, and for anyone."""

import argparse
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.cli.workers import add_scheduler_option, workers_of
from estimator.blind.making.effects.catalogue import FORM_SETS
from estimator.blind.making.making import make_cases
from estimator.blind.making.plan import BODIES, CHOICES, DEFAULT_FORM_SET, deck_size, plan
from estimator.blind.making.scenes.sizing import LEVELS
from estimator.blind.sealing.secret_seed import SEED_FILE, secret_seed

_MAKE_EXAMPLES = """  retract benchmark make --seed 7 --out sealed/cases --keys sealed/keys
  retract benchmark make --seed 8 --out trial --cases 3 --only none viscoelasticity --quick
  retract benchmark make --seed 50 --forms catalogue --out again
  retract benchmark make --seed 9 --body organ_with_parts --out organs
  retract benchmark make --seed secret --out challenge/cases --keys challenge/keys"""
_SECRET = "secret"


def add_make(actions: Verbs) -> None:
    """Add the action."""
    parser = add_verb(
        actions, "make", "make cases whose answers lie apart from them", _MAKE_EXAMPLES, run_make
    )
    parser.add_argument(
        "--seed",
        type=_seed,
        required=True,
        metavar="N|secret",
        help="the same seed gives the same cases, and their keys to whoever guesses it; secret draws one that nobody "
        f"can guess, and keeps it in {SEED_FILE} among the keys",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", required=True, help="folder of the cases")
    parser.add_argument(
        "--keys", type=Path, metavar="DIR", help="folder of the answers (default: beside DIR, named DIR-keys)"
    )
    parser.add_argument(
        "--cases", type=int, default=deck_size(), metavar="N", help="how many (default: %(default)s)"
    )
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="LABEL", help=f"limit them to some of: {', '.join(CHOICES)}"
    )
    parser.add_argument(
        "--level", nargs="+", default=[], metavar="LEVEL", help=f"limit sizes to some of: {', '.join(LEVELS)}"
    )
    parser.add_argument(
        "--forms",
        choices=FORM_SETS,
        default=DEFAULT_FORM_SET,
        help="whose forms of the effects: those that the catalogue of the diagnosis was written beside, on the usual "
        "phantoms, as all seeds to 52 have them; those of the literature, on phantoms, beads, channels, speeds, "
        "holds and noise of all kinds; or both in turn, on such (default: %(default)s)",
    )
    parser.add_argument(
        "--body",
        choices=BODIES,
        default="",
        help="limit the phantoms to organs with a cavity and a stiffer region, both stated, wherever the effects allow "
        "one; the key tells (default: blocks, organs and cylinders)",
    )
    parser.add_argument("--processes", type=int, metavar="N", help="cases at a time (default: one a core)")
    add_scheduler_option(parser)
    parser.add_argument("--quick", action="store_true", help="on a coarse mesh, for trials")


def run_make(options: argparse.Namespace) -> Result:
    """Make the cases that are not there yet."""
    keys = options.keys or options.out.with_name(f"{options.out.name}-keys")
    workers = workers_of(options.scheduler, options.processes, "--processes")
    seed = secret_seed(keys) if options.seed == _SECRET else options.seed
    cases = plan(seed, options.cases, options.only, options.level, options.forms, options.body)
    with progress() as tell:
        done = make_cases(cases, options.out, keys, workers=workers, quick=options.quick, progress=tell)
    lines = [
        f"{len(done.made)} cases made in {options.out}, {len(done.present)} were there; answers in {keys}"
    ]
    lines += [f"not made: {reason}" for reason in done.failed.values()]
    if done.set_hash:
        lines.append(
            f"the set is committed to by {done.set_hash}; publish that with the cases, and keep the keys"
        )
    data = {
        "cases": str(options.out),
        "keys": str(keys),
        "made": list(done.made),
        "present": list(done.present),
        "failed": done.failed,
        "set": done.set_hash,
    }
    return Result("\n".join(lines), data, status=1 if done.failed else 0)


def _seed(text: str) -> int | str:
    if text == _SECRET:
        return text
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is neither a whole number from 0 on nor {_SECRET!r}")
    return int(text)
