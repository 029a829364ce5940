"""The page of an investigation: the answer, the path to it, and the probabilities along it."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from daq.investigation.journal import Entry, Journal
from daq.investigation.loop import Outcome
from estimator.report import page
from estimator.report.diagnosis.quantities import percent
from estimator.report.page import Html
from estimator.report.theme import GRASP, INK, MEASURED, MUTED, PREDICTED, TRUTH

_MINUTE_S = 60.0
_WIDTH_IN, _HEIGHT_IN = 11.4, 3.6
_SHOWN = 5
_COLOURS = (PREDICTED, MEASURED, TRUTH, GRASP, INK)


def write_report(outcome: Outcome, path: Path, provenance: Mapping[str, str]) -> None:
    """Write the page.

    Parameters
    ----------
    provenance : what the values come from: rig, folders, versions
    """
    journal = outcome.journal
    blocks: list[Html] = [page.headline(ending_sentence(outcome))]
    if journal.entries:
        blocks += [
            page.heading("The path"),
            page.figure(
                partial(draw_path, journal=journal),
                (_WIDTH_IN, _HEIGHT_IN),
                "Probability of the likeliest answers after each manoeuvre, over minutes of rig and person. Filled: "
                "diagnosed in full. Open: screened alone.",
            ),
            page.table(
                "What was done, and what was known after it",
                ("", "manoeuvre", "minutes", "foretold, nat", "why", "after it"),
                [_cells(number, one) for number, one in enumerate(journal.entries, start=1)],
            ),
        ]
    if journal.refused:
        blocks.append(page.note("Refused: " + "; ".join(one.words for one in journal.refused) + "."))
    if journal.dropped:
        told = "; ".join(one.words for one in journal.dropped)
        blocks.append(page.note(f"Dropped, for the rig refused before anything moved: {told}."))
    blocks.append(page.facts("Provenance", provenance))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page.page(f"Investigation of {journal.phantom_id}", blocks), encoding="utf-8")


def outcome_as_json(outcome: Outcome) -> dict[str, Any]:
    """Return what came of an investigation, for programs."""
    journal = outcome.journal
    return {
        "ending": outcome.ending,
        "probabilities": dict(outcome.probabilities),
        "minutes": journal.seconds / _MINUTE_S,
        "manoeuvres": [one.manoeuvre.words for one in journal.entries],
        "dropped": [{"manoeuvre": one.manoeuvre.words, "why": one.why} for one in journal.dropped],
    }


def ending_sentence(outcome: Outcome) -> str:
    """Return what came of an investigation, in a sentence."""
    journal = outcome.journal
    done = f"{len(journal.entries)} manoeuvres, {journal.seconds / _MINUTE_S:.1f} min"
    if not outcome.probabilities:
        return f"Nothing was measured: {outcome.ending}."
    answer, probability = next(iter(outcome.probabilities.items()))
    return f"{answer}: {percent(probability)} ({done}; {outcome.ending})."


def likeliest(probabilities: Mapping[str, float], count: int = 3) -> str:
    """Return the likeliest answers in one line."""
    first = sorted(probabilities.items(), key=lambda item: -item[1])[:count]
    return ", ".join(f"{label} {percent(value)}" for label, value in first)


def draw_path(sheet: Figure, journal: Journal) -> None:
    """Draw the probabilities of the likeliest answers over the minutes."""
    minutes = np.cumsum([one.seconds for one in journal.entries]) / _MINUTE_S
    last = journal.entries[-1].probabilities
    shown = sorted(last, key=lambda label: -max(one.probabilities.get(label, 0.0) for one in journal.entries))
    axes = sheet.add_axes((0.06, 0.16, 0.70, 0.78))
    for label, colour in zip(shown[:_SHOWN], _COLOURS, strict=False):
        values = [one.probabilities.get(label, np.nan) for one in journal.entries]
        axes.plot(minutes, values, color=colour, label=label, linewidth=1.6)
        for at, value, entry in zip(minutes, values, journal.entries, strict=True):
            face = colour if entry.in_full else "none"
            axes.plot([at], [value], "o", color=colour, markerfacecolor=face)
    axes.axhline(0.95, color=MUTED, linewidth=0.8, linestyle="--")
    axes.set_ylim(0.0, 1.02)
    axes.set_xlim(left=0.0)
    axes.set_xlabel("minutes of rig and person")
    axes.set_yticks([0, 0.5, 0.95], ["0", "50 %", "95 %"])
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)


def _cells(number: int, entry: Entry) -> tuple[str, ...]:
    return (
        str(number),
        entry.manoeuvre.words,
        f"{entry.seconds / _MINUTE_S:.2f}",
        f"{entry.expected:.2f}" if entry.expected else "–",
        entry.reason,
        likeliest(entry.probabilities) + ("" if entry.in_full else " (screened)"),
    )
