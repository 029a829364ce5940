"""``retract study``: the paper's tables redone, those of recorded phantoms, and the gap of a published table."""

import argparse
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.cli.workers import add_scheduler_option, workers_of
from daq.export import export_experiment
from daq.progress import Progress
from daq.recording.folder import INFO_FILE
from daq.versions import package_versions
from estimator.errors import InputError
from estimator.experiment import Experiment, read_case, read_experiment
from estimator.studies.paper_tables.catalogue import ALL, DRAWS, STUDIES, studies_named
from estimator.studies.phantom_tables.bench import BenchTest, read_bench
from estimator.studies.phantom_tables.layout import layout_text
from estimator.studies.phantom_tables.own_surface import own_surface
from estimator.studies.phantom_tables.recorded import found_of, recorded, recorded_cases
from estimator.studies.phantom_tables.report import phantom_blocks, write_curves
from estimator.studies.published_gap.checking.chosen import causes_named, check_map
from estimator.studies.published_gap.diagnosis import diagnose_gap
from estimator.studies.published_gap.published import paper_table, read_table
from estimator.studies.published_gap.redone import redo_experiments, redone_json, redone_text
from estimator.studies.published_gap.reporting.report import write_gap
from estimator.studies.published_gap.reporting.telling import checks_json, checks_text, gap_json, gap_text
from estimator.studies.running.campaign import run_cases
from estimator.studies.running.store import OutcomeStore
from estimator.studies.tables.report import write_studies
from estimator.studies.tables.study import Study, result_of
from estimator.studies.tables.telling import study_json, study_text
from estimator.workers import Workers

GAP = "gap"

_EXAMPLES = """  retract study table1
  retract study all --output runs/studies          goes on there after a stop
  retract study table3 --draws 5 --workers 2
  retract study all --scheduler tcp://192.168.0.5:8786
  retract study sessions/* --bench "P07=36210±2620" --bench P08=tests/p08.csv   tables VI to VIII of your phantoms
  retract study phantoms/liver/phantom.toml        the liver's table for a surface of your own
  retract study gap                                which effects would have made the paper's estimator report its tables
  retract study gap published.toml --output runs/gap   the same for anybody's table of E and nu by condition"""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(
        verbs, "study", "redo the paper's tables, or make those of your phantoms", _EXAMPLES, run
    )
    parser.add_argument(
        "what",
        nargs="+",
        metavar="STUDY|SESSION|EXPERIMENT|PHANTOM",
        help=f"{', '.join(STUDIES)} or {ALL}; or recorded sessions, experiments or folders of experiments; or a "
        "phantom.toml, of which the liver's study is made; "
        f"or {GAP}, with a published TABLE.toml or TABLE.csv, else the paper's tables VI and VII",
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("studies"),
        metavar="DIR",
        help="page, pictures, data and every finished case, where the same command goes on (default: %(default)s)",
    )
    parser.add_argument("--workers", type=int, metavar="N", help="cases at a time (default: one a core)")
    add_scheduler_option(parser)
    parser.add_argument(
        "--bench",
        action="append",
        default=[],
        metavar="PHANTOM=E±S|FILE",
        help="bench test of a recorded phantom's silicone: E and its deviation in Pa, or a record as for "
        "retract uniaxial; repeat for several",
    )
    parser.add_argument(
        "--redo",
        action="store_true",
        help=f"with {GAP}: redo the table's experiments with the leading model acting, estimated its way and ours",
    )
    parser.add_argument(
        "--check",
        action="append",
        default=[],
        metavar="CAUSE|A+B",
        help=f"with {GAP}: simulate what the map of this cause, or of two together, is learnt from and checked on, and "
        "tell how far it is off; repeat for several",
    )
    parser.add_argument(
        "--draws", type=int, default=DRAWS, metavar="N", help="of what is drawn (default: %(default)s)"
    )


def run(options: argparse.Namespace) -> Result:
    """Carry out the studies, and tell their tables."""
    workers = workers_of(options.scheduler, options.workers, "--workers")
    store = OutcomeStore(options.output / "cases")
    if options.check and GAP not in options.what:
        raise InputError(f"--check belongs to {GAP}; write retract study {GAP} --check {options.check[0]}")
    if GAP in options.what:
        return _gap(options, store, workers)
    bench = {test.phantom: test for test in map(read_bench, options.bench)}
    with progress() as tell:
        studies = _studies(options, tell)
        _check_bench(bench, studies)
        cases = [case for study in studies for case in study.cases]
        outcomes = iter(run_cases(cases, store, workers, tell))
        results = [result_of(study, [next(outcomes) for _ in study.cases]) for study in studies]
    found = [pair for result in results for pair in found_of(result)]
    further = phantom_blocks(found, bench) if found else []
    files = write_studies(results, options.output, package_versions(), further)
    files += write_curves(found, options.output)
    text = [study_text(result) for result in results]
    text += [*([layout_text(found, bench)] if found else []), f"Report: {files[0]}"]
    data = {result.study.name: study_json(result) for result in results}
    return Result("\n\n".join(text), {"studies": data, "files": [str(file) for file in files]})


def _gap(options: argparse.Namespace, store: OutcomeStore, workers: Workers) -> Result:
    """Diagnose the paper's tables, or one that a file gives."""
    tables = [what for what in options.what if what != GAP]
    if len(tables) > 1 or len(options.what) - len(tables) > 1:
        raise InputError(f"{GAP} takes one published table; name one .toml or .csv file, or none")
    table = read_table(Path(tables[0])) if tables else paper_table()
    if chosen := causes_named(options.check):
        with progress() as tell:
            checks = check_map(table.set_up, chosen, store, workers, tell)
        return Result(checks_text(checks), {"checks": checks_json(checks)})
    with progress() as tell:
        diagnosis = diagnose_gap(table, store, workers, tell)
        redone = redo_experiments(diagnosis, store, workers, tell) if options.redo else []
    files = write_gap(diagnosis, redone, options.output, package_versions())
    text = "\n\n".join(
        [gap_text(diagnosis), *([redone_text(redone)] if redone else []), f"Report: {files[0]}"]
    )
    data = {**gap_json(diagnosis), "redone": redone_json(redone), "files": [str(file) for file in files]}
    return Result(text, data)


def _check_bench(bench: Mapping[str, BenchTest], studies: Sequence[Study]) -> None:
    phantoms = sorted({case.experiment.phantom_id for study in studies for case in recorded_cases(study)})
    if odd := [name for name in bench if name not in phantoms]:
        raise InputError(
            f"--bench {odd[0]}: no such phantom was recorded; there are {', '.join(phantoms) or 'none here'}"
        )


def _studies(options: argparse.Namespace, tell: Progress) -> list[Study]:
    named = [what for what in options.what if what in (*STUDIES, ALL)]
    if len(named) == len(options.what):
        return studies_named(named, options.draws)
    phantoms = [Path(what) for what in options.what if Path(what).suffix == ".toml" and Path(what).is_file()]
    if phantoms:
        if len(phantoms) != len(options.what):
            raise InputError(f"'{phantoms[0]}' states a phantom; give such files alone, or none")
        return [own_surface(file) for file in phantoms]
    folders = [Path(what) for what in options.what if what not in named]
    if missing := [folder for folder in folders if not folder.is_dir()]:
        raise InputError(
            f"'{missing[0]}' is neither a study ({', '.join(STUDIES)}, {ALL}, {GAP}) nor a folder; name one of them"
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
