"""The report of an estimation: one page, from the sentence that answers to the numbers behind it."""

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

from estimator.fit.result import Estimate, ExperimentFit
from estimator.report import page
from estimator.report.estimation.body_plot import draw_body
from estimator.report.estimation.budget import budget_section
from estimator.report.estimation.convergence_plot import draw_convergence
from estimator.report.estimation.facts import fit_facts, specimen_facts
from estimator.report.estimation.fiducial_plot import arrow_factor, draw_fiducials
from estimator.report.estimation.findings import Truth, caveats, comparison, parameter_texts, verdict
from estimator.report.estimation.identifiability import identifiability_section
from estimator.report.estimation.tables import experiment_table, residual_table
from estimator.report.estimation.wrench_plot import draw_wrench
from estimator.report.page import Html

WRENCH_SIZE_IN = (11.4, 6.6)
FIDUCIALS_SIZE_IN = (11.4, 5.6)
BODY_SIZE_IN = (11.4, 4.8)
CONVERGENCE_SIZE_IN = (11.4, 3.0)


def write_report(
    estimate: Estimate, path: Path, *, title: str, truth: Truth | None, provenance: Mapping[str, str]
) -> None:
    """Write the page to ``path``, and make its folder if there is none.

    Parameters
    ----------
    title : of the page
    truth : where it is known
    provenance : what the values come from: input folders, versions, the law
    """
    blocks = [
        page.headline(f"{', '.join(parameter_texts(estimate))}."),
        page.headline(verdict(estimate)),
    ]
    if truth is not None:
        blocks.append(page.headline(comparison(estimate, truth)))
    blocks.append(page.warnings(caveats(estimate)))
    for number, fit in enumerate(estimate.fits, start=1):
        blocks += _experiment(estimate, fit, number)
    blocks += [
        page.heading("How the fit converged"),
        page.figure(
            partial(draw_convergence, estimate=estimate, truth=truth),
            CONVERGENCE_SIZE_IN,
            "The fit uses a few states of each experiment first, then all; the last point is corrected for the mesh. "
            "χ² grows with the measurements in use, so that only points joined by a line compare.",
        ),
        *identifiability_section(estimate),
        *budget_section(estimate.budget),
        page.heading("Numbers"),
        residual_table(estimate),
        page.note(
            "Scatter is the residual without the mean of each signal, which the fit takes for a tare of the sensor "
            "or a rest position that is a little off; 1 σ is pure noise."
        ),
        experiment_table(estimate),
        page.beside(
            [
                page.facts("Fit", fit_facts(estimate)),
                page.facts("Specimen", specimen_facts(estimate.fits[0].experiment)),
                page.facts("Provenance", provenance),
            ]
        ),
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page.page(title, blocks), encoding="utf-8")


def _experiment(estimate: Estimate, fit: ExperimentFit, number: int) -> Iterator[Html]:
    yield page.heading(f"{number}. {fit.experiment.name}")
    yield page.figure(
        partial(draw_wrench, fit=fit),
        WRENCH_SIZE_IN,
        "Force and torque that the tissue exerts on the gripper. Below each: measured minus predicted in units of "
        "the sensor's noise; 95 % of pure noise lies between the dashed lines.",
    )
    if len(fit.experiment.fiducials_rest):
        factor = arrow_factor(fit)
        yield page.switched_figure(
            partial(draw_fiducials, fit=fit),
            FIDUCIALS_SIZE_IN,
            "Paths of the fiducials, with their numbers (columns m00, m01, …). Arrows are measured minus predicted at "
            f"the farthest state, {factor:g} times too long: the noise of a coordinate would be "
            f"{1e3 * factor * fit.experiment.sensor.fiducial_std:.2g} mm long.",
            name=f"arrows-{number}",
            label="residual arrows",
        )
    yield page.figure(
        partial(draw_body, mesh=estimate.mesh, fit=fit),
        BODY_SIZE_IN,
        "The deformed tissue at the farthest state, with the lines of the mesh. The colour ends where 99 % of the "
        "surface lie below: next to the grasp the stretch is singular.",
    )
