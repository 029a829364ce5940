"""``retract diagnose``: which effect causes the gap between model and measurement, where, and how far it closes."""

import argparse
from collections.abc import Callable
from pathlib import Path

from daq.cli.diagnosis.batch import diagnose_all, holds_cases
from daq.cli.diagnosis_documents import DATA_FILE, PAGE_FILE, data_of, data_text, page_of
from daq.cli.estimation.known import add_known_options, material_settings_of, with_noise_of
from daq.cli.file_options import add_what_a_file_may_leave_open, are_bench_tests
from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.cli.workers import add_scheduler_option
from estimator.diagnosis.diagnose import diagnose
from estimator.errors import InputError
from estimator.experiment import read_case
from estimator.experiment_checks.suspicions import naming_suspicions, suspicions_of
from estimator.report.diagnosis.findings import summary_text

_EXAMPLES = """  retract diagnose cases/P07
  retract diagnose cases/P07 --output runs/P07
  retract diagnose cases/P07/pull --json
  retract diagnose cases/P07 --fix poisson_ratio=0.49 --noise force_std=0.05
  retract diagnose cases/P07 --law yeoh2 --prior youngs_modulus=15000+-2000
  retract diagnose cases --output runs               every case in a folder; goes on there after a stop
  retract diagnose cases --output runs --scheduler tcp://192.168.0.5:8786
  retract diagnose tests/cycles.csv
  retract diagnose tests/slow.csv tests/fast.csv --mode shear

E and Poisson's ratio are fitted unless they are fixed; what the law's shape has beside them is fitted to a few states
of the experiments, and kept."""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    summary = "name the cause of the gap between model and measurement"
    parser = add_verb(verbs, "diagnose", summary, _EXAMPLES, run)
    parser.add_argument(
        "--output",
        type=Path,
        metavar="DIR",
        help=f"write {PAGE_FILE} and {DATA_FILE} into this folder, of several cases each into a folder of its own",
    )
    add_known_options(parser)
    parser.add_argument(
        "case",
        type=Path,
        nargs="+",
        metavar="CASE",
        help="folder of experiments of one phantom, or one experiment, or a folder of such folders; or files of "
        "bench tests of one material",
    )
    _add_file_options(parser)
    _add_batch_options(parser)


def _add_file_options(parser: argparse.ArgumentParser) -> None:
    add_what_a_file_may_leave_open(parser, ("tension", "compression", "shear"))


def _add_batch_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--processes",
        type=int,
        metavar="N",
        help="of a folder of cases, so many at a time (default: one, which uses all cores by itself)",
    )
    add_scheduler_option(parser)


def _refuse(options: argparse.Namespace, add: Callable[[argparse.ArgumentParser], None], kind: str) -> None:
    """Refuse what was given of the options that ``add`` adds: they are of another kind of input."""
    parser = argparse.ArgumentParser()
    add(parser)
    for name, default in vars(parser.parse_args([])).items():
        if getattr(options, name) != default:
            raise InputError(
                f"--{name.replace('_', '-')}: is of {kind}, and {options.case[0]} is none; leave it out"
            )


def run(options: argparse.Namespace) -> Result:
    """Diagnose, and tell the verdict."""
    if are_bench_tests(options.case):
        _refuse(options, add_known_options, "a folder of experiments")
        _refuse(options, _add_batch_options, "a folder of cases")
        # what reads and draws bench tests takes as long to import as everything else
        from daq.cli.diagnosis.bench_diagnosis import run_bench

        return run_bench(options)
    if len(options.case) > 1:
        raise InputError(
            f"{options.case[1]}: one folder is diagnosed at a time; several files of bench tests may be"
        )
    _refuse(options, _add_file_options, "a file of bench tests")
    material = material_settings_of(options)
    if holds_cases(options.case[0]):
        return diagnose_all(options, material)
    _refuse(options, _add_batch_options, "a folder of cases")
    experiments = with_noise_of(options, read_case(options.case[0]))
    if options.output is not None:
        options.output.mkdir(parents=True, exist_ok=True)
    with progress() as tell, naming_suspicions(options.case):
        found = diagnose(experiments, tell, material=material)
    data = {**data_of(found, experiments, material), "suspicious": suspicions_of(options.case)}
    told = [
        *(f"Surface: {note}" for note in data["surface"]),
        *(f"Suspicious: {one}" for one in data["suspicious"]),
    ]
    text = "\n".join([summary_text(found), *told])
    if options.output is not None:
        file = options.output / PAGE_FILE
        file.write_text(page_of(found, experiments, str(options.case[0])), encoding="utf-8")
        (options.output / DATA_FILE).write_text(data_text(data), encoding="utf-8")
        text += f"\nReport: {file}"
    return Result(text, data)
