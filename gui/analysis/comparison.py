"""Two diagnoses side by side, as rows of texts."""

from estimator.diagnosis.result import Diagnosis
from estimator.report.diagnosis.findings import answer_words, ranking, standing
from estimator.report.diagnosis.quantities import closure_text, percent, quantity_text, sigma


def comparison_rows(one: Diagnosis, other: Diagnosis) -> list[tuple[str, str, str]]:
    """Return what is compared, and what each of two diagnoses says of it."""
    both = (one, other)
    rows = [
        ("verdict", *(_verdict(found) for found in both)),
        ("experiments", *(", ".join(found.by_experiment) for found in both)),
        ("E without the causes", *(quantity_text(found.before.youngs_modulus) for found in both)),
        ("E with them", *(quantity_text(found.after.youngs_modulus) for found in both)),
        ("ν without the causes", *(quantity_text(found.before.poisson_ratio) for found in both)),
        ("ν with them", *(quantity_text(found.after.poisson_ratio) for found in both)),
        ("gap before", *(sigma(found.gap.before) for found in both)),
        ("gap after", *(sigma(found.gap.after) for found in both)),
        ("noise alone", *(sigma(found.gap.floor) for found in both)),
        ("gap closes", *(closure_text(found.gap.closure_held_out, found.gap.closure_std) for found in both)),
    ]
    labels = dict.fromkeys(label for found in both for label, _ in ranking(found))
    rows += [
        (f"probability of {answer_words(label)}", *(_standing(found, label) for found in both))
        for label in labels
    ]
    return [(name, left, right) for name, left, right in rows]


def _verdict(found: Diagnosis) -> str:
    return " and ".join(map(answer_words, found.verdict)) or answer_words("none")


def _standing(found: Diagnosis, label: str) -> str:
    return standing(found, label) if label in found.probabilities else percent(0.0)
