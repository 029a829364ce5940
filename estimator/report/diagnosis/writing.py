"""The page of a diagnosis, from the sentence that answers to the numbers behind it."""

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from estimator.diagnosis.result import Diagnosis, Trace, Where
from estimator.report import page
from estimator.report.channels import root_mean_square
from estimator.report.diagnosis.causes_plot import causes_height_in, draw_causes
from estimator.report.diagnosis.findings import (
    advice_text,
    chance_sentence,
    explanations,
    gap_rows,
    gap_sentence,
    material_sentence,
    open_questions,
    outliers_sentence,
    verdict_sentence,
)
from estimator.report.diagnosis.gap_plot import draw_gap
from estimator.report.diagnosis.heat_map import draw_heat_maps
from estimator.report.diagnosis.map_plot import arrow_factor, draw_map
from estimator.report.diagnosis.residuals import residual_sigma
from estimator.report.diagnosis.tables import effect_table, gap_table
from estimator.report.diagnosis.where_plot import draw_where, where_height_in
from estimator.report.diagnosis.wrench_plot import draw_wrenches
from estimator.report.drawing.scene import MM
from estimator.report.page import Html

_WIDTH_IN = 11.4
MAP_IN = (_WIDTH_IN, 5.9)
HEAT_IN = (_WIDTH_IN, 3.2)
WRENCH_IN = (_WIDTH_IN, 4.4)


def write_report(diagnosis: Diagnosis, path: Path, *, title: str, provenance: Mapping[str, str]) -> None:
    """Write the page to ``path``, and make its folder if there is none; the rest as :func:`report_page` takes it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(report_page(diagnosis, title=title, provenance=provenance), encoding="utf-8")


def report_page(diagnosis: Diagnosis, *, title: str, provenance: Mapping[str, str]) -> str:
    """Return the page, whole in itself.

    Parameters
    ----------
    title : of the page
    provenance : what the values come from: input folders, versions
    """
    mapped = _most_missed(diagnosis.traces)
    blocks: list[Html] = [*_answer(diagnosis), *_place(diagnosis, mapped), *_open_questions(diagnosis)]
    for number, trace in enumerate(diagnosis.traces, start=1):
        blocks += _experiment(diagnosis, trace, number, with_map=trace is not mapped)
    blocks += [
        page.heading("Numbers"),
        effect_table(diagnosis),
        page.note(
            "Closes: share of the gap on experiments left out of the fit. Would show from: the size that these data "
            "show at three standard deviations."
        ),
        page.note(chance_sentence(diagnosis)),
        *([page.note(outliers_sentence(diagnosis))] if diagnosis.outliers else []),
        page.beside([gap_table(diagnosis), page.facts("Provenance", provenance)]),
    ]
    return page.page(title, blocks)


def gap_size_in(diagnosis: Diagnosis) -> tuple[float, float]:
    """Return width and height of the picture of the gap, inches."""
    return (_WIDTH_IN, 1.3 + 0.32 * len(gap_rows(diagnosis)))


def causes_size_in(diagnosis: Diagnosis) -> tuple[float, float]:
    """Return width and height of the picture of the causes, inches."""
    return (_WIDTH_IN, causes_height_in(diagnosis))


def where_size_in(where: Where) -> tuple[float, float]:
    """Return width and height of the picture of where the gap lies, inches."""
    return (_WIDTH_IN, where_height_in(where))


def _answer(diagnosis: Diagnosis) -> Iterator[Html]:
    yield page.headline(verdict_sentence(diagnosis))
    for explanation in explanations(diagnosis):
        yield page.headline(explanation)
    yield page.headline(gap_sentence(diagnosis.gap))
    yield page.heading("How far the gap closes")
    yield page.figure(
        partial(draw_gap, diagnosis=diagnosis),
        gap_size_in(diagnosis),
        "Misfit on experiments left out of the fit, and the share of what exceeds the noise that closes. Right: "
        f"{material_sentence(diagnosis.before, diagnosis.after)} Bars are 95 % intervals.",
    )
    yield page.heading("What causes it")
    yield page.figure(
        partial(draw_causes, diagnosis=diagnosis),
        causes_size_in(diagnosis),
        "How probable each answer is as the leading cause, and its size with one standard deviation. Bold: the "
        "verdict. Blue: the other members of the smallest set that holds 90 % of the probability.",
    )


def _place(diagnosis: Diagnosis, mapped: Trace | None) -> Iterator[Html]:
    where = diagnosis.where
    yield page.heading("Where it lies")
    yield page.figure(
        partial(draw_where, where=where),
        where_size_in(where),
        "Left: where on the rig the cause sits. Middle and right: how the misfit beyond the noise is shared out "
        "between channels, and between the phases of the experiments.",
    )
    if mapped is not None:
        yield _map(diagnosis, mapped)


def _open_questions(diagnosis: Diagnosis) -> Iterator[Html]:
    if not (diagnosis.cannot_tell or diagnosis.next_experiment):
        return
    yield page.heading("What these data cannot tell, and what would")
    yield page.warnings(open_questions(diagnosis))
    for advice in diagnosis.next_experiment:
        yield page.note(advice_text(advice))


def _experiment(diagnosis: Diagnosis, trace: Trace, number: int, *, with_map: bool) -> Iterator[Html]:
    yield page.heading(f"{number}. {trace.experiment.name}")
    yield page.figure(
        partial(draw_heat_maps, trace=trace),
        HEAT_IN,
        "Root mean square of measured minus predicted, in units of the noise of one value. A cell without colour is "
        "noise; a hatched one was not measured.",
    )
    yield page.figure(
        partial(draw_wrenches, trace=trace),
        WRENCH_IN,
        "Force and torque that the tissue exerts on the gripper, measured and predicted.",
    )
    if with_map and _seen(trace):
        yield _map(diagnosis, trace)


def _map(diagnosis: Diagnosis, trace: Trace) -> Html:
    factor = arrow_factor(trace)
    noise_mm = factor * MM * trace.experiment.sensor.fiducial_std
    place = f" {text}" if (text := _place_text(diagnosis)) else ""
    return page.figure(
        partial(draw_map, diagnosis=diagnosis, trace=trace),
        MAP_IN,
        f"{trace.experiment.name} from above, at the farthest state. Arrows are measured minus predicted, {factor:g} "
        f"times too long: the noise of a coordinate would be {noise_mm:.2g} mm long.{place}",
    )


def _place_text(diagnosis: Diagnosis) -> str:
    """Tell where a local cause lies, in words; empty where there is none."""
    where = diagnosis.where
    if where.centre is None:
        return ""
    x, y, z = (f"{MM * value:.1f}" for value in where.centre)
    text = f"The cause is local: its centre is at x = {x}, y = {y}, z = {z} mm"
    if where.centre_std is not None:
        text += f" (± {', '.join(f'{MM * std:.1f}' for std in where.centre_std)})"
    return f"{text}, its radius {MM * where.radius:.1f} mm." if where.radius is not None else f"{text}."


def _most_missed(traces: tuple[Trace, ...]) -> Trace | None:
    """Return the experiment whose fiducials the baseline misses most; None where none was seen."""
    seen = [trace for trace in traces if _seen(trace)]
    return max(seen, key=lambda t: root_mean_square(residual_sigma(t, t.before)[:, 6:]), default=None)


def _seen(trace: Trace) -> bool:
    return bool(np.isfinite(trace.experiment.fiducials).any())
