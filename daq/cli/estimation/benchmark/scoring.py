"""``retract benchmark run`` and ``score``: answer sealed cases, and tell how well they were answered."""

import argparse
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.cli.workers import add_scheduler_option, workers_of
from estimator.blind.scoring.diagnoses import read_diagnoses
from estimator.blind.scoring.entries.writing import write_entry
from estimator.blind.scoring.running import answer_cases
from estimator.blind.scoring.score import score_answers
from estimator.blind.scoring.telling import check_writable, score_text, write_score
from estimator.blind.sealing.commitment import read_commitment
from estimator.diagnosis.diagnose import diagnose

_RUN_EXAMPLES = """  retract benchmark run sealed/cases
  retract benchmark run sealed/cases --out answers --processes 2
  retract benchmark run sealed/cases --scheduler tcp://192.168.0.5:8786
  retract benchmark run sealed/cases --out answers --entry ours.json"""
_SCORE_EXAMPLES = """  retract benchmark score sealed/cases-answers sealed/keys
  retract benchmark score thresholds.json sealed/keys
  retract benchmark score answers sealed/keys --output score.html --json
  retract benchmark score monday/answers monday/keys --also friday/answers friday/keys"""

_OURS = {
    "name": "retract diagnose",
    "authors": ["the project that keeps the benchmark"],
    "method": "Inverse finite elements: every cause of the catalogue is fitted to the measurements beside E and ν, and "
    "compared by its evidence.",
}


def add_run(actions: Verbs) -> None:
    """Add the action that diagnoses the cases."""
    parser = add_verb(actions, "run", "diagnose cases without their answers", _RUN_EXAMPLES, _run)
    parser.add_argument("cases", type=Path, metavar="DIR", help="folder of the cases")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="ANSWERS",
        help="folder of the answers (default: beside DIR, named DIR-answers)",
    )
    parser.add_argument(
        "--processes",
        type=int,
        default=1,
        metavar="N",
        help="cases at a time (default: %(default)s; a diagnosis uses all cores by itself)",
    )
    add_scheduler_option(parser)
    parser.add_argument(
        "--entry",
        type=Path,
        metavar="FILE",
        help="write all answers as an entry beside those of others (retraction-answers/1)",
    )


def add_score(actions: Verbs) -> None:
    """Add the action that compares answers and keys."""
    parser = add_verb(actions, "score", "compare the answers with the keys", _SCORE_EXAMPLES, _score)
    parser.add_argument(
        "answers",
        type=Path,
        metavar="ANSWERS",
        help="folder of the diagnosis's answers, or a file of anyone's (retraction-answers/1)",
    )
    parser.add_argument(
        "keys", type=Path, metavar="KEYS", help="folder of the keys; every opening is counted in it"
    )
    parser.add_argument(
        "--also",
        type=Path,
        nargs=2,
        action="append",
        default=[],
        metavar=("ANSWERS", "KEYS"),
        help="another set, scored together with the first; may be given more than once",
    )
    parser.add_argument(
        "--output",
        type=Path,
        metavar="FILE",
        help="write a page (.html), or the confusion as a picture (.png)",
    )


def _run(options: argparse.Namespace) -> Result:
    answers = options.out or options.cases.with_name(f"{options.cases.name}-answers")
    workers = workers_of(options.scheduler, options.processes, "--processes")
    in_turn = options.processes == 1 and not options.scheduler
    with progress() as tell:
        done = answer_cases(
            diagnose, options.cases, answers, workers=None if in_turn else workers, progress=tell
        )
    lines = [f"{len(done.done)} cases diagnosed, {len(done.present)} had been; answers in {answers}"]
    lines += [f"no answer to {name}: {reason}" for name, reason in done.failed.items()]
    if options.entry is not None and done.failed:
        lines.append(
            f"{options.entry}: not written, for an entry answers every case; run again, or diagnose the rest"
        )
    elif options.entry is not None:
        write_entry(read_diagnoses(answers), read_commitment(options.cases), _OURS, options.entry)
        lines.append(f"entry in {options.entry}")
    data = {
        "answers": str(answers),
        "answered": list(done.done),
        "present": list(done.present),
        "failed": done.failed,
    }
    return Result("\n".join(lines), data, status=1 if done.failed else 0)


def _score(options: argparse.Namespace) -> Result:
    if options.output is not None:
        check_writable(options.output)
    sets = [(options.answers, options.keys), *((answers, keys) for answers, keys in options.also)]
    found = score_answers(sets)
    if options.output is not None:
        names = ", ".join(answers.name for answers, _ in sets)
        write_score(found, options.output, title=f"Score of {names}")
    return Result(score_text(found), found.as_json())
