"""``retract study``: the paper's tables redone, and those of the laboratory's own phantoms."""

import argparse
from collections.abc import Sequence
from functools import partial
from hashlib import sha256
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.export import export_experiment
from daq.progress import Progress
from daq.recording.folder import INFO_FILE
from daq.versions import package_versions
from estimator.errors import InputError
from estimator.experiment import Experiment, read_case, read_experiment
from estimator.studies.campaign import run_cases
from estimator.studies.catalogue import ALL, DRAWS, STUDIES, studies_named
from estimator.studies.cluster import dask_cluster
from estimator.studies.recorded import recorded
from estimator.studies.report import write_studies
from estimator.studies.store import OutcomeStore
from estimator.studies.study import Study, result_of
from estimator.studies.telling import study_json, study_text
from estimator.workers import worker_pool

_EXAMPLES = """  retract study table1
  retract study all --output runs/studies          goes on there after a stop
  retract study table3 --draws 5 --workers 2
  retract study all --scheduler tcp://192.168.0.5:8786
  retract study sessions/* --output runs/phantoms  E and nu by phantom, trajectory and repeat"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(
        verbs, "study", "redo the paper's tables, or make those of your phantoms", _EXAMPLES, run
    )
    parser.add_argument(
        "what",
        nargs="+",
        metavar="STUDY|SESSION|EXPERIMENT",
        help=f"{', '.join(STUDIES)} or {ALL}; or recorded sessions, experiments or folders of experiments",
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("studies"),
        metavar="DIR",
        help="page, pictures, data and every finished case, where the same command goes on (default: %(default)s)",
    )
    parser.add_argument("--workers", type=int, metavar="N", help="cases at a time (default: one a core)")
    parser.add_argument(
        "--scheduler",
        metavar="tcp://HOST:PORT",
        help="run the cases on the workers of this Dask scheduler instead",
    )
    parser.add_argument(
        "--draws", type=int, default=DRAWS, metavar="N", help="of what is drawn (default: %(default)s)"
    )


def run(options: argparse.Namespace) -> Result:
    """Carry out the studies, and tell their tables."""
    if options.workers is not None and options.workers < 1:
        raise InputError(f"--workers {options.workers}: at least one is needed")
    start = (
        partial(dask_cluster, options.scheduler)
        if options.scheduler
        else partial(worker_pool, options.workers)
    )
    with progress() as tell:
        studies = _studies(options, tell)
        cases = [case for study in studies for case in study.cases]
        outcomes = iter(run_cases(cases, OutcomeStore(options.output / "cases"), start, tell))
        results = [result_of(study, [next(outcomes) for _ in study.cases]) for study in studies]
    files = write_studies(results, options.output, package_versions())
    text = [study_text(result) for result in results] + [f"Report: {files[0]}"]
    data = {result.study.name: study_json(result) for result in results}
    return Result("\n\n".join(text), {"studies": data, "files": [str(file) for file in files]})


def _studies(options: argparse.Namespace, tell: Progress) -> list[Study]:
    named = [what for what in options.what if what in (*STUDIES, ALL)]
    if len(named) == len(options.what):
        return studies_named(named, options.draws)
    folders = [Path(what) for what in options.what if what not in named]
    if missing := [folder for folder in folders if not folder.is_dir()]:
        raise InputError(
            f"'{missing[0]}' is neither a study ({', '.join(STUDIES)}, {ALL}) nor a folder; name one of them"
        )
    if named:
        raise InputError(f"'{named[0]}' is a study, '{folders[0]}' a folder; give studies or folders alone")
    return [recorded(_experiments(folders, options.output / "experiments", tell))]


def _experiments(folders: Sequence[Path], exported: Path, tell: Progress) -> list[Experiment]:
    """Read experiments and cases as they are; synchronise sessions, each once, into ``exported``."""
    found: list[Experiment] = []
    for folder in folders:
        if not (folder / INFO_FILE).exists():
            found += read_case(folder)
            continue
        target = exported / _name_of(folder)
        if target.exists():
            found.append(read_experiment(target))
        else:
            exported.mkdir(parents=True, exist_ok=True)
            found.append(export_experiment(folder, target, tell)[0])
    return found


def _name_of(session: Path) -> str:
    """Return a name for a session that no session of another folder has."""
    place = str(session.resolve())
    return f"{session.resolve().name}-{sha256(place.encode()).hexdigest()[:8]}"
