"""An engine's answers beside ours, on the same motion, and beside what was recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.handover.answer import EngineAnswer, recorded
from estimator.handover.model import HandedOver, Run

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Compared:
    """One experiment.

    Attributes
    ----------
    name : of the experiment
    load_steps : how many
    force : largest difference over the load steps, as a share of our largest
    torque_nm : the same of the torque, N·m
    beads_m : largest distance of a bead from where it is with us
    modulus_ratio : by which E would have to be multiplied for the engine's forces to be nearest to ours
    force_then : the largest difference of force left then, as a share of our largest
    seconds : that the engine took
    gap_ours, gap_engine, gap_plain : root mean square misfit to the recording in units of the sensors' noise: of our
        model with the causes, of the engine with its sensors and cameras wrapped, and of the engine as it stands
    """

    name: str
    load_steps: int
    force: float
    torque_nm: float
    beads_m: float
    modulus_ratio: float
    force_then: float
    seconds: float
    gap_ours: float
    gap_engine: float
    gap_plain: float


def compare(handed: HandedOver, answers: Sequence[EngineAnswer]) -> list[Compared]:
    """Return every experiment's comparison."""
    return [_compared(handed, run, answer) for run, answer in zip(handed.runs, answers, strict=True)]


def _compared(handed: HandedOver, run: Run, answer: EngineAnswer) -> Compared:
    wrapped = recorded(answer, run, handed.problem)
    rows = run.of_row
    ours, theirs = run.wrench[:, :3], answer.wrench[:, :3]
    ratio = float(np.sum(ours * theirs) / max(np.sum(theirs**2), np.finfo(float).tiny))
    return Compared(
        run.experiment.name,
        len(run.poses),
        _share(theirs - ours, ours),
        float(np.linalg.norm(answer.wrench[:, 3:] - run.wrench[:, 3:], axis=-1).max()),
        float(np.linalg.norm(answer.beads - run.beads, axis=-1).max(initial=0.0)),
        ratio,
        _share(ratio * theirs - ours, ours),
        answer.seconds,
        _misfit(run, run.recorded.wrench, run.recorded.fiducials),
        _misfit(run, wrapped.wrench, wrapped.beads),
        _misfit(run, answer.wrench[rows], answer.beads[rows]),
    )


def _share(difference: FloatArray, whole: FloatArray) -> float:
    largest = float(np.linalg.norm(whole, axis=-1).max())
    return float(np.linalg.norm(difference, axis=-1).max()) / largest if largest > 0 else 0.0


def _misfit(run: Run, wrench: FloatArray, beads: FloatArray) -> float:
    """Return the root mean square of what was measured less what is predicted, in units of the noise."""
    experiment = run.experiment
    off = [
        ((experiment.wrench - wrench) / experiment.sensor.wrench_std).ravel(),
        ((experiment.fiducials - beads) / experiment.sensor.bead_std).ravel(),
    ]
    seen = np.concatenate(off)
    seen = seen[np.isfinite(seen)]
    return float(np.sqrt(np.mean(seen**2))) if len(seen) else float("nan")


def table(compared: Sequence[Compared]) -> str:
    """Return a table in Markdown, with the same columns on a terminal."""
    head = (
        *("experiment", "steps", "force", "torque, mN·m", "beads, µm", "E ×", "force then"),
        *("gap: ours", "engine, wrapped", "engine, plain", "s"),
    )
    rows = [
        (
            one.name,
            str(one.load_steps),
            f"{100 * one.force:.2f} %",
            f"{1e3 * one.torque_nm:.3f}",
            f"{1e6 * one.beads_m:.0f}",
            f"{one.modulus_ratio:.4f}",
            f"{100 * one.force_then:.2f} %",
            f"{one.gap_ours:.2f}",
            f"{one.gap_engine:.2f}",
            f"{one.gap_plain:.2f}",
            f"{one.seconds:.1f}",
        )
        for one in compared
    ]
    widths = [max(len(row[column]) for row in (head, *rows)) for column in range(len(head))]
    lines = [_row(head, widths), _row(["-" * width for width in widths], widths)]
    return "\n".join([*lines, *(_row(row, widths) for row in rows)])


def _row(fields: Sequence[str], widths: Sequence[int]) -> str:
    return "| " + " | ".join(field.ljust(width) for field, width in zip(fields, widths, strict=True)) + " |"
