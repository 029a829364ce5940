"""Cases, answers and keys of the blind test, with their readers and verbs."""

from pathlib import Path

from daq.bad_input.damage.any_file import TEXT
from daq.bad_input.damage.value import JSON, TABLE, TOML
from daq.bad_input.kind import Kind
from daq.bad_input.samples import benchmarks
from estimator.batch import case_names
from estimator.blind.scoring.score import score_answers
from estimator.blind.scoring.telling import score_text
from estimator.blind.sealing.openings import OPENINGS_FILE
from estimator.experiment import read_case


def _read_benchmark(folder: Path) -> object:
    return score_text(score_answers([(folder / "answers", folder / "keys")]))


def _score(given: Path, out: Path) -> list[str]:
    return [
        "benchmark", "score", str(given / "answers"), str(given / "keys"), "--output", str(out / "score.html")
    ]  # fmt: skip


def _read_challenge(folder: Path) -> object:
    return score_text(score_answers([(folder / "answers.json", folder / "keys")]))


def _score_entry(given: Path, out: Path) -> list[str]:
    return ["benchmark", "score", str(given / "answers.json"), str(given / "keys")]


KINDS: tuple[Kind, ...] = (
    Kind(
        "sealed case",
        benchmarks.sealed_cases,
        {"cases/two/pull/experiment.toml": TOML, "cases/two/pull/observations.csv": TABLE},
        read=lambda folder: [read_case(folder / "cases" / name) for name in case_names(folder / "cases")],
        command=lambda given, out: ["benchmark", "run", str(given / "cases"), "--out", str(out / "answers")],
    ),
    Kind(
        "answers",
        benchmarks.benchmark,
        {"answers/one.json": (*TEXT, *JSON)},
        read=_read_benchmark,
        command=_score,
        quick=True,
        changes=frozenset({OPENINGS_FILE}),
    ),
    Kind(
        "keys",
        benchmarks.benchmark,
        {"keys/two.toml": (*TEXT, *TOML)},
        read=_read_benchmark,
        command=_score,
        quick=True,
        changes=frozenset({OPENINGS_FILE}),
    ),
    Kind(
        "answers of others",
        benchmarks.challenge,
        {"answers.json": (*TEXT, *JSON)},
        read=_read_challenge,
        command=_score_entry,
        quick=True,
        changes=frozenset({OPENINGS_FILE}),
    ),
    Kind(
        "hashes of keys",
        benchmarks.challenge,
        {"keys/keys.sha256": TEXT},
        read=_read_challenge,
        command=_score_entry,
        quick=True,
        changes=frozenset({OPENINGS_FILE}),
    ),
    Kind(
        "register of answers",
        benchmarks.challenge,
        {"keys/entries.txt": TEXT},
        read=_read_challenge,
        command=_score_entry,
        quick=True,
        changes=frozenset({OPENINGS_FILE}),
    ),
    Kind(
        "count of openings",
        benchmarks.opened_benchmark,
        {"keys/openings.txt": TEXT},
        read=_read_benchmark,
        command=_score,
        quick=True,
    ),
)  # fmt: skip
