"""``retract benchmark commit`` and ``reveal``: bind oneself to keys, and show later that they are those."""

import argparse
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb
from estimator.blind.scoring.keys import Key, open_keys
from estimator.blind.sealing.commitment import check_cases, check_keys, commit, read_commitment

_COMMIT_EXAMPLES = """  retract benchmark commit rig/cases rig/keys

Each key is given a random salt. Lists of hashes, keys.sha256 and cases.sha256, lie beside the cases then: publish them
with the cases, and keep the keys. retract benchmark make does the same by itself."""
_REVEAL_EXAMPLES = """  retract benchmark reveal sealed/cases sealed/keys

The cases are the published ones; that the keys are those they were committed to is checked before anything is shown."""


def add_commit(actions: Verbs) -> None:
    """Add the action that binds to keys."""
    summary = "commit cases of one's own to their keys: hashes to publish"
    parser = add_verb(actions, "commit", summary, _COMMIT_EXAMPLES, _commit)
    _add_set(parser)


def add_reveal(actions: Verbs) -> None:
    """Add the action that shows keys."""
    summary = "check keys against the published hashes, count the opening, and show them"
    parser = add_verb(actions, "reveal", summary, _REVEAL_EXAMPLES, _reveal)
    _add_set(parser)


def _add_set(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("cases", type=Path, metavar="CASES", help="folder of the cases")
    parser.add_argument("keys", type=Path, metavar="KEYS", help="folder of the keys")


def _commit(options: argparse.Namespace) -> Result:
    made = commit(options.cases, options.keys)
    text = f"{len(made.keys)} cases are committed to by {made.set_hash}; publish that with the cases, and keep the keys"
    return Result(text, {"set": made.set_hash, "cases": made.cases_hash, "keys": dict(made.keys)})


def _reveal(options: argparse.Namespace) -> Result:
    published = read_commitment(options.cases)
    check_cases(options.cases, published)
    check_keys(options.keys, published)
    keys, openings = open_keys(options.keys, "revealed")
    since = f", first at {openings.first.isoformat()}" if openings.first else ""
    lines = [f"{len(keys)} keys are those of {published.set_hash}; opened {openings.count} times{since}"]
    lines += [f"{name}: {_told(key)}" for name, key in keys.items()]
    data = {
        "set": published.set_hash,
        "openings": openings.count,
        "first_opened": openings.first.isoformat() if openings.first else None,
        "effects": {name: list(key.effects) for name, key in keys.items()},
    }
    return Result("\n".join(lines), data)


def _told(key: Key) -> str:
    causes = " and ".join(key.effects) or "none"
    family = f" ({key.family})" if key.family else ""
    return f"{causes}{family}; E {key.youngs_modulus / 1e3:.2f} kPa, ν {key.poisson_ratio:.4f}"
