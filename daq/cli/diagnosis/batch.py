"""``retract diagnose FOLDER`` of many cases: a page and the data of each, and a table of all."""

import argparse
import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from daq.cli.diagnosis_documents import DATA_FILE, PAGE_FILE, data_of, data_text, page_of
from daq.cli.estimation.known import KNOWN_OPTIONS, with_noise_of
from daq.cli.verb import Result, progress
from daq.cli.workers import workers_of
from estimator.batch import run_batch
from estimator.diagnosis.diagnose import diagnose
from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.experiment.model import EXPERIMENT_FILE
from estimator.experiment_checks.suspicions import suspicions_of
from estimator.fit.settings import FitSettings
from estimator.studies.tables.telling import aligned

# which options the diagnoses in a folder were made with
OPTIONS_FILE = "options.json"


def holds_cases(folder: Path) -> bool:
    """Tell whether a folder holds folders of experiments, and no experiment itself."""
    if (folder / EXPERIMENT_FILE).exists() or any(folder.glob(f"*/{EXPERIMENT_FILE}")):
        return False
    return any(folder.glob(f"*/*/{EXPERIMENT_FILE}"))


def diagnose_all(options: argparse.Namespace, material: FitSettings) -> Result:
    """Diagnose the cases that have no diagnosis yet, and tell what was found in each.

    Raises
    ------
    InputError
        No output folder is given, or it holds diagnoses made with other options; or as
        :func:`~estimator.batch.run_batch`.
    """
    cases, output = options.case[0], options.output
    if output is None:
        raise InputError(f"{cases}: is a folder of cases; name a folder for their pages with --output")
    _settle_options(options, output)
    several = options.scheduler or (options.processes is not None and options.processes != 1)
    workers = workers_of(options.scheduler, options.processes, "--processes") if several else None

    def files(name: str) -> list[Path]:
        return [output / name / PAGE_FILE, output / name / DATA_FILE]

    with progress() as tell:
        task = partial(_documents, options, material)
        batch = run_batch(task, cases, files, workers=workers, progress=tell)
    data = {
        name: {**_read(files(name)[-1]), "suspicious": suspicions_of([cases / name])}
        for name in sorted((*batch.done, *batch.present))
    }
    lines = [
        *aligned([("case", "verdict", "E, Pa", "ν", "s"), *(_row(name, one) for name, one in data.items())]),
        *(f"suspicious in {text}" for one in data.values() for text in one["suspicious"]),
        *(f"no diagnosis of {name}: {reason}" for name, reason in batch.failed.items()),
        f"{len(batch.done)} cases diagnosed, {len(batch.present)} had been; pages in {output}",
    ]
    return Result("\n".join(lines), {"cases": data, "failed": batch.failed}, status=1 if batch.failed else 0)


def _documents(
    options: argparse.Namespace, material: FitSettings, name: str, experiments: Sequence[Experiment]
) -> list[str]:
    """Return page and data of a case."""
    experiments = with_noise_of(options, experiments)
    found = diagnose(experiments, None, material=material)
    return [
        page_of(found, experiments, str(options.case[0] / name)),
        data_text(data_of(found, experiments, material)),
    ]


def _settle_options(options: argparse.Namespace, output: Path) -> None:
    """Keep what the options tell of tissue and sensors beside the diagnoses, or compare it with what is kept."""
    file = output / OPTIONS_FILE
    given = {name: getattr(options, name) for name in KNOWN_OPTIONS}
    if not file.exists():
        output.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(given, indent=1), encoding="utf-8")
        return
    kept = _read(file)
    for name in KNOWN_OPTIONS:
        if kept.get(name) != given[name]:
            raise InputError(
                f"{output}: holds diagnoses with --{name} {kept.get(name)} instead of {given[name]}; "
                "name another folder with --output"
            )


def _read(file: Path) -> dict[str, Any]:
    try:
        read = json.loads(file.read_text(encoding="utf-8"))
    except (UnicodeDecodeError, ValueError) as error:
        raise InputError(f"{file}: cannot be read ({error}); delete it, and it is made anew") from None
    if not isinstance(read, dict):
        raise InputError(f"{file}: is no JSON object; delete it, and it is made anew")
    return read


def _row(name: str, data: dict[str, Any]) -> tuple[str, ...]:
    try:
        answers = data["verdict"] or ["none"]
        chance = data["probabilities"].get(answers[0])
        verdict = " and ".join(answers) + ("" if chance is None else f", {chance:.0%}")
        modulus, ratio = (data["material"]["after"][key] for key in ("youngs_modulus", "poisson_ratio"))
        return (
            name,
            verdict,
            f"{modulus['value']:.6g} ± {_deviation(modulus)}",
            f"{ratio['value']:.4f} ± {_deviation(ratio)}",
            f"{data['seconds']:.0f}",
        )
    except (AttributeError, KeyError, TypeError, ValueError):
        raise InputError(f"{name}/{DATA_FILE}: is no diagnosis; delete it, and it is made anew") from None


def _deviation(quantity: dict[str, Any]) -> str:
    return "fixed" if quantity["std"] is None else f"{quantity['std']:.2g}"
