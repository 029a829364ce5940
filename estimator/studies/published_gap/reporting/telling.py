"""A diagnosis in words: its tables as text and as JSON."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from estimator.studies.published_gap.diagnosis import GapDiagnosis, Ranking, Withheld
from estimator.studies.published_gap.learning import Check
from estimator.studies.published_gap.pattern_fit import PatternResult
from estimator.studies.published_gap.proposals import proposals
from estimator.studies.published_gap.simulations import CONDITIONS
from estimator.studies.tables.telling import aligned

Rows = list[list[str]]

_MODELS = 15
MODEL_HEAD = (
    "model",
    "ln evidence over locking",
    "probability",
    "sizes, median and 90 % interval",
    "E closed",
    "ν closed",
)
CAUSE_HEAD = ("cause", "in words", "takes part with probability", "alone: ln evidence over locking")
PLACE_HEAD = ("place", "something of it takes part with probability")
PATTERN_HEAD = (
    "material",
    "anchored",
    "motion",
    "bench E, kPa",
    "published",
    "locking alone",
    "leading",
    "ν published",
    "locking alone",
    "leading",
)
WITHHELD_HEAD = (
    "withheld",
    "model chosen on the rest",
    "as",
    "E closed",
    "ν closed",
    "ln density of the withheld over locking's",
)
CHECK_HEAD = ("cause", "sizes", "E off, %", "ν off")


def model_rows(ranking: Ranking) -> Rows:
    """Return the most probable models, and locking alone."""
    locking = ranking.best(0)
    everything = np.ones(len(locking.model.table.estimates), dtype=bool)
    shown = [
        (result, probability)
        for place, (result, probability) in enumerate(zip(ranking.results, ranking.probability, strict=True))
        if place < _MODELS or not result.model.causes
    ]
    return [
        [
            result.model.name,
            f"{result.log_evidence - locking.log_evidence:+.1f}",
            f"{probability:.3f}",
            "; ".join(sizes_in_words(result)),
            *(_share(result.closed(everything)[name]) for name in ("E", "nu")),
        ]
        for result, probability in shown
    ]


def cause_rows(ranking: Ranking) -> Rows:
    """Return every cause with the probability that it takes part, and what it does alone."""
    locking = ranking.best(0)
    single = {r.model.causes[0].name: r for r in ranking.results if len(r.model.causes) == 1}
    return [
        [
            name,
            single[name].model.causes[0].words,
            f"{probability:.3f}",
            f"{single[name].log_evidence - locking.log_evidence:+.1f}",
        ]
        for name, probability in ranking.by_cause.items()
        if name in single
    ]


def place_rows(ranking: Ranking) -> Rows:
    """Return with what probability something of each place takes part."""
    return [[place, f"{probability:.3f}"] for place, probability in ranking.by_place.items()]


def sizes_in_words(result: PatternResult) -> list[str]:
    """Return a model's sizes with their units."""
    units = {f"{cause.name} {size.name}": size.unit for cause, size in result.model.sizes}
    return [
        f"{name} {median:.3g} ({low:.3g} to {high:.3g}) {'' if units[name] == '1' else units[name]}".rstrip()
        for name, (median, low, high) in result.sizes().items()
    ]


def pattern_rows(diagnosis: GapDiagnosis) -> Rows:
    """Return every published pair beside what locking alone and the leading model predict."""
    table = diagnosis.table
    predicted = [
        [np.median(mean, axis=0) for mean in result.means]
        for result in (diagnosis.ranking.best(0), diagnosis.ranking.leading)
    ]
    rows = []
    for number, one in enumerate(table.estimates):
        moduli = [np.exp(log[number]) / 1e3 for log, _ in predicted]
        ratios = [ratio[number] for _, ratio in predicted]
        rows.append(
            [
                one.material,
                one.anchoring.replace("_", " "),
                one.motion.replace("_", " "),
                f"{table.bench[one.material].youngs_modulus_pa / 1e3:.2f}",
                f"{one.youngs_modulus_pa / 1e3:.2f}",
                *(f"{modulus:.2f}" for modulus in moduli),
                f"{one.poisson_ratio:.3f}",
                *(f"{ratio:.3f}" for ratio in ratios),
            ]
        )
    return rows


def withheld_rows(withheld: Sequence[Withheld]) -> Rows:
    """Return what closes in parts that were not learnt from, for models that were chosen on the rest."""
    rows = []
    for part in withheld:
        locking = part.ranking.best(0)
        for role, result in roles(part.ranking):
            closed = result.closed(part.rows)
            gain = log_density(result, part) - log_density(locking, part)
            rows.append(
                [
                    part.name,
                    result.model.name,
                    role,
                    _share(closed["E"]),
                    _share(closed["nu"]),
                    f"{gain:+.1f}",
                ]
            )
    return rows


def roles(ranking: Ranking) -> list[tuple[str, PatternResult]]:
    """Return the models that are always reported, as far as they were learnt."""
    names = {0: "locking alone", 1: "best single", 2: "best pair"}
    counts = sorted({len(result.model.causes) for result in ranking.results})
    return [("leading", ranking.leading), *((names[count], ranking.best(count)) for count in counts)]


def log_density(result: PatternResult, part: Withheld) -> float:
    """Return the log density of the withheld rows as the posterior of the others predicts them, nats."""
    level = result.model.log_likelihood(result.draws, part.rows)
    return float(np.logaddexp.reduce(level) - np.log(len(level)))


def check_rows(checks: Sequence[Check]) -> Rows:
    """Return how far the learnt map is off simulations that it was not learnt from."""
    return [
        [
            check.name,
            ", ".join(f"{x:g}" for x in check.at),
            f"{100 * check.modulus_off:.2f}",
            f"{check.ratio_off:.4f}",
        ]
        for check in checks
    ]


def locking_rows(diagnosis: GapDiagnosis) -> Rows:
    """Return what the estimator finds where nothing but its own elements is wrong."""
    modulus, ratio = diagnosis.response.locking
    return [
        [a.replace("_", " "), m.replace("_", " "), f"{100 * (e - 1):+.1f}", f"{r:.3f}"]
        for (a, m), e, r in zip(CONDITIONS, modulus, ratio, strict=True)
    ]


LOCKING_HEAD = ("anchored", "motion", "E off the tissue's, %", "ν of a tissue with 0.499")


def gap_text(diagnosis: GapDiagnosis) -> str:
    """Return the whole diagnosis as text."""
    lines = [f"The gap of {diagnosis.table.name}"]

    def add(title: str, head: Sequence[str], rows: Rows) -> None:
        lines.extend(["", title, *aligned([list(head), *rows])])

    add("the estimator's own elements alone", LOCKING_HEAD, locking_rows(diagnosis))
    add("models of the pattern, locking in each", MODEL_HEAD, model_rows(diagnosis.ranking))
    add("causes", CAUSE_HEAD, cause_rows(diagnosis.ranking))
    add("where causes sit", PLACE_HEAD, place_rows(diagnosis.ranking))
    add("published and predicted", PATTERN_HEAD, pattern_rows(diagnosis))
    add("withheld parts", WITHHELD_HEAD, withheld_rows(diagnosis.withheld))
    add("the learnt map beside simulations it was not learnt from", CHECK_HEAD, check_rows(diagnosis.checks))
    lines += ["", "what the laboratory should do", *(f"  {line}" for line in proposals(diagnosis))]
    lines += [f"not simulated: {line}" for line in diagnosis.response.missing]
    return "\n".join(lines)


def gap_json(diagnosis: GapDiagnosis) -> dict[str, Any]:
    """Return the diagnosis as JSON."""
    ranking = diagnosis.ranking
    locking = ranking.best(0)
    return {
        "table": diagnosis.table.name,
        "models": [
            {
                "causes": [cause.name for cause in result.model.causes],
                "log_evidence_over_locking": result.log_evidence - locking.log_evidence,
                "probability": float(probability),
                "sizes": {name: list(size) for name, size in result.sizes().items()},
            }
            for result, probability in zip(ranking.results, ranking.probability, strict=True)
        ],
        "causes": ranking.by_cause,
        "places": ranking.by_place,
        "withheld": [dict(zip(WITHHELD_HEAD, row, strict=True)) for row in withheld_rows(diagnosis.withheld)],
        "checks": checks_json(diagnosis.checks),
        "proposals": proposals(diagnosis),
        "not_simulated": diagnosis.response.missing,
    }


def _share(share: tuple[float, float, float]) -> str:
    return f"{100 * share[0]:.0f} % ({100 * share[1]:.0f} to {100 * share[2]:.0f})"


def checks_json(checks: Sequence[Check]) -> list[dict[str, str]]:
    """Return the checks of the map for a program."""
    return [dict(zip(CHECK_HEAD, row, strict=True)) for row in check_rows(checks)]


def checks_text(checks: Sequence[Check]) -> str:
    """Return the checks of the map as an aligned table."""
    return "\n".join(aligned([list(CHECK_HEAD), *check_rows(checks)]))
