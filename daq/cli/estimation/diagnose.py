"""``retract diagnose``: which effect causes the gap between model and measurement, where, and how far it closes."""

import argparse
import json
from collections.abc import Callable
from pathlib import Path

from daq.cli.estimation.known import add_known_options, material_settings_of, with_noise_of
from daq.cli.file_options import add_what_a_file_may_leave_open, are_bench_tests
from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.versions import package_versions
from estimator.diagnosis.conclusions.as_json import as_json
from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.search.baseline import GRADING
from estimator.errors import InputError
from estimator.experiment import read_case
from estimator.forward.meshing import surface_notes
from estimator.report.diagnosis.findings import summary_text

PAGE_FILE = "diagnosis.html"
DATA_FILE = "diagnosis.json"

_EXAMPLES = """  retract diagnose cases/P07
  retract diagnose cases/P07 --output runs/P07
  retract diagnose cases/P07/pull --json
  retract diagnose cases/P07 --fix poisson_ratio=0.49 --noise force_std=0.05
  retract diagnose cases/P07 --law yeoh2 --prior youngs_modulus=15000+-2000
  retract diagnose tests/cycles.csv
  retract diagnose tests/slow.csv tests/fast.csv --mode shear

E and Poisson's ratio are fitted unless they are fixed; what the law's shape has beside them is fitted to a few states
of the experiments, and kept."""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    summary = "name the cause of the gap between model and measurement"
    parser = add_verb(verbs, "diagnose", summary, _EXAMPLES, run)
    parser.add_argument(
        "--output", type=Path, metavar="DIR", help=f"write {PAGE_FILE} and {DATA_FILE} into this folder"
    )
    add_known_options(parser)
    parser.add_argument(
        "case",
        type=Path,
        nargs="+",
        metavar="CASE",
        help="folder of experiments of one phantom, or one experiment; or files of bench tests of one material",
    )
    _add_file_options(parser)


def _add_file_options(parser: argparse.ArgumentParser) -> None:
    add_what_a_file_may_leave_open(parser, ("tension", "compression", "shear"))


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
        # what reads and draws bench tests takes as long to import as everything else
        from daq.cli.estimation.bench_diagnosis import run_bench

        return run_bench(options)
    if len(options.case) > 1:
        raise InputError(
            f"{options.case[1]}: one folder is diagnosed at a time; several files of bench tests may be"
        )
    _refuse(options, _add_file_options, "a file of bench tests")
    material = material_settings_of(options)
    experiments = with_noise_of(options, read_case(options.case[0]))
    if options.output is not None:
        options.output.mkdir(parents=True, exist_ok=True)
    with progress() as tell:
        found = diagnose(experiments, tell, material=material)
    notes = surface_notes(experiments[0], GRADING)
    data = {**as_json(found), "law": material.law.name, "surface": notes}
    text = "\n".join([summary_text(found), *(f"Surface: {note}" for note in notes)])
    if options.output is not None:
        # what draws takes a second to import
        from estimator.report.diagnosis.writing import write_report

        file = options.output / PAGE_FILE
        provenance = {"case": str(options.case[0]), **package_versions()}
        write_report(found, file, title=f"Diagnosis of {experiments[0].phantom_id}", provenance=provenance)
        (options.output / DATA_FILE).write_text(json.dumps(data, indent=1), encoding="utf-8")
        text += f"\nReport: {file}"
    return Result(text, data)
