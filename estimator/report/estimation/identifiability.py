"""What the measurements tell of the parameters and what they do not: sentences, a table and the profiles."""

from collections.abc import Iterator
from functools import partial

from matplotlib.figure import Figure

from estimator.fit.profile import CHI2_95
from estimator.fit.result import Estimate
from estimator.report import page
from estimator.report.estimation.findings import SYMBOLS, taken_up
from estimator.report.page import Html
from estimator.report.theme import MEASURED, PREDICTED

_PROFILE_SIZE_IN = (11.4, 2.8)


def identifiability_section(estimate: Estimate) -> Iterator[Html]:
    """Yield the section; nothing for an estimate that was not examined."""
    if estimate.floated is None:
        return
    yield page.heading("What the measurements tell")
    yield page.warnings(estimate.identifiability)
    yield page.note(taken_up(estimate))
    if estimate.absorptions:
        yield _absorption_table(estimate)
    if estimate.profiles:
        yield page.figure(
            partial(draw_profiles, estimate=estimate),
            _PROFILE_SIZE_IN,
            "Profile likelihood: rise of χ² when a parameter is held and the others make up for it as well as they "
            "can. The interval ends where it reaches the dashed line.",
        )


def draw_profiles(sheet: Figure, estimate: Estimate) -> None:
    """Draw the rise of χ² over each profiled parameter."""
    threshold = CHI2_95 * estimate.inflation**2
    all_axes = sheet.subplots(1, len(estimate.profiles), squeeze=False)[0]
    sheet.subplots_adjust(left=0.06, right=0.99, bottom=0.2, top=0.95, wspace=0.25)
    for axes, profile in zip(all_axes, estimate.profiles, strict=True):
        factor = 1e-3 if profile.name == "youngs_modulus" else 1.0
        axes.plot(
            [factor * value for value, _ in profile.points],
            [rise for _, rise in profile.points],
            "o-",
            color=PREDICTED,
            markersize=5,
        )
        axes.axhline(threshold, color=MEASURED, linestyle=(0, (5, 3)))
        unit = ", kPa" if profile.name == "youngs_modulus" else ""
        axes.set_xlabel(f"{SYMBOLS.get(profile.name, profile.name)}{unit}")
        axes.ticklabel_format(axis="x", useOffset=False)
    all_axes[0].set_ylabel("rise of χ²")


def _absorption_table(estimate: Estimate) -> Html:
    names = list(estimate.absorptions[0].shifts)
    rows = [
        (
            f"{one.name} {one.size} too large",
            f"{100 * one.share:.1f} %",
            f"{one.left:.2g} σ",
            *(
                f"{100 * shift:+.2g} %" if name == "youngs_modulus" else f"{shift:+.2g}"
                for name, shift in one.shifts.items()
            ),
        )
        for one in estimate.absorptions
    ]
    head = ("error", "taken up by the parameters", "left to be seen", *(SYMBOLS.get(n, n) for n in names))
    return page.table("What the fit would make of errors that the model does not have", head, rows)
