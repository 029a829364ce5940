"""What a diagnosis found, in sentences: for the head of the page and for the terminal."""

import math

from estimator.diagnosis.model.labels import NONE, UNKNOWN
from estimator.diagnosis.result import Advice, Diagnosis, Gap, Material, Quantity
from estimator.effects.blocks import GROUPS
from estimator.report.diagnosis.quantities import (
    closure_text,
    parameters_text,
    percent,
    quantity_text,
    share_text,
    sigma,
    slight_text,
    words_of,
)

_SHOWN_CAUSES = 5
# An answer less probable than this is left out of a ranking, unless it belongs to the credible set.
_WORTH_SHOWING = 0.01
# What noise feigns less often than this is not put down to noise.
_RARE = 0.05
# In what units a small gap is told.
_SMALL = {
    "fiducials": ("the beads", 1e6, "µm"),
    "force": ("force", 1e3, "mN"),
    "torque": ("torque", 1e3, "mN·m"),
}
# A block less probable than this is not told where the likeliest one is.
_WORTH_LOOKING = 0.1
_WORDS_OF_BLOCK = {block.name: block.words.rpartition(": ")[2] for block in GROUPS.values()}
_ONE = {
    NONE: "no gap beyond the noise",
    UNKNOWN: "something outside the catalogue",
}


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """Return the answer in one sentence."""
    causes = [label for label in diagnosis.verdict if label != UNKNOWN]
    rival = _rival(diagnosis)
    if not diagnosis.verdict:
        return _nothing_named(diagnosis, rival)
    chance = percent(_probability(diagnosis, UNKNOWN))
    recognised = diagnosis.effects.get(UNKNOWN)
    if not causes:
        gap = (
            f"A gap stands out of the noise, and nothing in the catalogue explains it (probability {chance})"
        )
        return (
            f"{gap}. {recognised.words}" if recognised is not None else f"{gap}. {block_sentence(diagnosis)}"
        )
    if recognised is not None and diagnosis.verdict[0] == UNKNOWN:
        beside = " and ".join(map(words_of, causes))
        told = _sentence(f"{_told(diagnosis, UNKNOWN)} causes the gap, with {beside} beside it.")
        return f"{told} {recognised.words}"
    leading, *others = causes
    named = _told(diagnosis, leading)
    if rival is not None and diagnosis.verdict == (leading,):
        return _sentence(f"{named} is the likeliest cause of a gap; next is {_told(diagnosis, rival)}.")
    if others:
        named += f" together with {' and '.join(map(words_of, others))}"
    if UNKNOWN not in diagnosis.verdict:
        return _sentence(f"{named} causes the gap.")
    if recognised is None:
        return _sentence(f"{named} causes the gap, but something more remains unexplained.")
    return f"{_sentence(f'{named} causes the gap, with something outside the catalogue.')} {recognised.words}"


def block_sentence(diagnosis: Diagnosis) -> str:
    """Return in which block of the rig the cause lies, the most probable ones first."""
    blocks = sorted(diagnosis.where.blocks.items(), key=lambda item: -item[1])
    told = [
        f"{_WORDS_OF_BLOCK[name]} ({percent(probability)})"
        for place, (name, probability) in enumerate(blocks)
        if place == 0 or probability >= _WORTH_LOOKING
    ]
    return f"Where to look: {', then '.join(told)}."


def _nothing_named(diagnosis: Diagnosis, rival: str | None) -> str:
    """Return the answer where no cause is named; ``rival`` is the most probable one, unless it is far behind none."""
    none = _probability(diagnosis, NONE)
    if rival is not None and _probability(diagnosis, rival) > none:
        return _sentence(
            f"Nothing is sure: {_told(diagnosis, rival)} may cause a gap, or there is {_told(diagnosis, NONE)}."
        )
    otherwise = "else one is too small to show" if rival is None else f"{_told(diagnosis, rival)} is next"
    return (
        "No gap: the baseline explains the data within the sensors' noise "
        f"(probability {percent(none)}; {otherwise}).{largest_gap_text(diagnosis)}"
    )


def largest_gap_text(diagnosis: Diagnosis) -> str:
    """Return how large a gap that does not show may be, a sentence after a blank; empty where nothing was measured."""
    sizes = [
        f"{factor * diagnosis.gap_at_most[kind].value:.2g} {unit} of {what}"
        for kind, (what, factor, unit) in _SMALL.items()
        if kind in diagnosis.gap_at_most
    ]
    several = " and ".join(filter(None, [", ".join(sizes[:-1]), *sizes[-1:]]))
    return f" One that does not show is below {several} (95 %)." if sizes else ""


def gap_sentence(gap: Gap) -> str:
    """Tell the misfit without and with the causes, that of noise alone, and the closure; all on held-out data."""
    sizes = f"{sigma(gap.before)} before, {sigma(gap.after)} after, {sigma(gap.floor)} is noise alone"
    if not math.isfinite(gap.closure_held_out):
        return f"Gap on experiments left out of the fit: {sizes}."
    if gap.closure_held_out < 0:
        share = f"adding the causes widens it by {share_text(-gap.closure_held_out, gap.closure_std)}"
    else:
        share = f"{closure_text(gap.closure_held_out, gap.closure_std)} of it closes"
    slight = f" ({text})" if (text := slight_text(gap)) else ""
    return f"Gap on experiments left out of the fit: {sizes}; {share}{slight}."


def chance_sentence(diagnosis: Diagnosis) -> str:
    """Tell how often noise alone would look like a cause as strong as the strongest found."""
    text = (
        f"Of noise alone, {percent(diagnosis.chance)} would feign a cause as strong as the strongest found here, "
        f"so many being looked for."
    )
    if diagnosis.verdict or diagnosis.chance >= _RARE:
        return text
    return f"{text} But that one is so slight that a small error of the model could feign it too."


def outliers_sentence(diagnosis: Diagnosis) -> str:
    """Tell how many readings were left out."""
    count = diagnosis.outliers
    readings = "1 reading of a bead was" if count == 1 else f"{count} readings of beads were"
    return f"{readings} left out as wild, unlike those before and after."


def explanations(diagnosis: Diagnosis) -> list[str]:
    """Return what each cause of the verdict means, and its size."""
    found = []
    for label in diagnosis.verdict:
        if (finding := diagnosis.effects.get(label)) is None:
            continue
        meaning = finding.words.rstrip(".")
        size = parameters_text(finding)
        text = f"{_sentence(label)}: {meaning[0].lower()}{meaning[1:]}"
        found.append(f"{text}; {size}." if size else f"{text}.")
    return found


def gap_rows(diagnosis: Diagnosis) -> list[tuple[str, Gap]]:
    """Return the gaps in an order to be read: all data, the channels, the experiments."""
    return [
        ("all data", diagnosis.gap),
        *((words_of(name), gap) for name, gap in diagnosis.by_channel.items()),
        *((name, gap) for name, gap in diagnosis.by_experiment.items()),
    ]


def material_sentence(before: Material, after: Material) -> str:
    """Tell E and ν without and with the causes."""
    return (
        f"E {_change(before.youngs_modulus, after.youngs_modulus)}; "
        f"ν {_change(before.poisson_ratio, after.poisson_ratio)}."
    )


def ranking(diagnosis: Diagnosis) -> list[tuple[str, float]]:
    """Return the answers worth showing with their probabilities: the verdict's causes, then the likeliest first."""
    verdict = diagnosis.verdict
    ranked = sorted(diagnosis.probabilities.items(), key=lambda item: (item[0] not in verdict, -item[1]))
    return [
        (label, probability)
        for place, (label, probability) in enumerate(ranked)
        if label in (*verdict, *diagnosis.credible_set)
        or (place < _SHOWN_CAUSES and probability >= _WORTH_SHOWING)
    ]


def standing(diagnosis: Diagnosis, label: str) -> str:
    """Return the probability of an answer, or that it is a further cause, whose probability alone says nothing."""
    if label in diagnosis.verdict[1:]:
        return "beside"
    return percent(_probability(diagnosis, label))


def answer_words(label: str) -> str:
    """Return a label, "none" or "unknown" in words."""
    return _ONE.get(label, words_of(label))


def open_questions(diagnosis: Diagnosis) -> list[str]:
    """Return what the data do not say, a sentence each."""
    return [_sentence(text) for text in diagnosis.cannot_tell]


def advice_text(advice: Advice) -> str:
    """Return what to do next, and what for."""
    one, other = (answer_words(label) for label in advice.separates)
    known = math.isfinite(advice.sigma_then)
    then = f"then {sigma(advice.sigma_then)}" if known else "then decided outside the rig"
    return (
        f"{_sentence(advice.manoeuvre)}: separates {one} from {other}, "
        f"now {sigma(advice.sigma_now)} apart, {then}."
    )


def summary_text(diagnosis: Diagnosis) -> str:
    """Return the findings as a few lines for the terminal."""
    lines = [
        verdict_sentence(diagnosis),
        *explanations(diagnosis),
        gap_sentence(diagnosis.gap),
        chance_sentence(diagnosis),
    ]
    lines.append(
        f"Material without the causes -> with them: {material_sentence(diagnosis.before, diagnosis.after)}"
    )
    lines.append("Ranking:")
    for label, _ in ranking(diagnosis):
        finding = diagnosis.effects.get(label)
        size = "" if finding is None else parameters_text(finding)
        lines.append(f"  {standing(diagnosis, label):>6}  {answer_words(label)}{f': {size}' if size else ''}")
    if diagnosis.cannot_tell:
        lines += [
            "What these data cannot tell:",
            *(f"  {sentence}" for sentence in open_questions(diagnosis)),
        ]
    if diagnosis.next_experiment:
        lines += ["What to do next:", *(f"  {advice_text(advice)}" for advice in diagnosis.next_experiment)]
    if diagnosis.outliers:
        lines.append(outliers_sentence(diagnosis))
    lines.append(f"{diagnosis.seconds:.0f} s")
    return "\n".join(lines)


def _rival(diagnosis: Diagnosis) -> str | None:
    """Return the most probable answer besides the verdict's where it is at least half as probable as that."""
    leading = diagnosis.verdict[0] if diagnosis.verdict else NONE
    others = {label: p for label, p in diagnosis.probabilities.items() if label != leading}
    if not others:
        return None
    rival = max(others, key=lambda label: others[label])
    return rival if others[rival] >= 0.5 * _probability(diagnosis, leading) else None


def _told(diagnosis: Diagnosis, label: str) -> str:
    return f"{answer_words(label)} ({percent(_probability(diagnosis, label))})"


def _sentence(text: str) -> str:
    return words_of(text[:1].upper() + text[1:])


def _probability(diagnosis: Diagnosis, label: str) -> float:
    return diagnosis.probabilities.get(label, math.nan)


def _change(before: Quantity, after: Quantity) -> str:
    return f"{quantity_text(before)} -> {quantity_text(after)}"
