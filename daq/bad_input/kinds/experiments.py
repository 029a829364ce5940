"""Experiments that a user hands over, with their readers and verbs."""

from pathlib import Path

from daq.bad_input.damage.any_file import BINARY, TEXT
from daq.bad_input.damage.layout import PLY, STL
from daq.bad_input.damage.value import JSON, JSON_LINES, TABLE, TOML
from daq.bad_input.kind import Kind
from daq.bad_input.samples import experiments, packed_surfaces
from estimator import result_lines
from estimator.experiment import read_case, read_experiment
from estimator.fit import coverage
from estimator.studies.running.store import OutcomeStore


def _estimate(given: Path, out: Path) -> list[str]:
    return ["estimate", str(given / "pull"), "--report", str(out / "page.html")]


KINDS: tuple[Kind, ...] = (
    Kind(
        "experiment",
        experiments.experiment,
        {"pull/experiment.toml": (*TEXT, *TOML)},
        read=lambda folder: read_experiment(folder / "pull"),
        command=_estimate,
    ),
    Kind(
        "observations",
        experiments.experiment,
        {"pull/observations.csv": (*TEXT, *TABLE)},
        read=lambda folder: read_experiment(folder / "pull"),
        command=_estimate,
    ),
    Kind(
        "experiment's surface",
        experiments.experiment_of_surface,
        {"pull/phantom.stl": (*BINARY, *STL)},
        read=lambda folder: read_experiment(folder / "pull"),
        command=lambda given, out: ["mesh", str(given / "pull"), "-o", str(out / "mesh.vtu")],
    ),
    Kind(
        "experiment's PLY",
        packed_surfaces.experiment_of_ply,
        {"pull/body.ply": (*BINARY, *PLY), "pull/experiment.toml": (*TEXT, *TOML)},
        read=lambda folder: read_experiment(folder / "pull"),
        command=lambda given, out: ["mesh", str(given / "pull"), "-o", str(out / "mesh.vtu")],
    ),
    Kind(
        "case",
        experiments.case,
        {"case/again/experiment.toml": TOML, "case/pull/observations.csv": TABLE},
        read=lambda folder: read_case(folder / "case"),
        command=lambda given, out: ["diagnose", str(given / "case"), "--output", str(out / "report")],
    ),
    Kind(
        "study's kept row",
        experiments.outcome,
        {"*.json": (*TEXT, *JSON)},
        read=lambda folder: OutcomeStore(folder).read(experiments.KnownCase()),
    ),
    Kind(
        "results of coverage",
        experiments.coverage_results,
        {"sets.jsonl": (*TEXT, *JSON_LINES)},
        read=lambda folder: result_lines.read_results(coverage.Outcome, folder / "sets.jsonl"),
    ),
)  # fmt: skip
