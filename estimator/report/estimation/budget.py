"""The uncertainty budget in words and tables, for the page, the terminal and the window."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

from estimator.fit.budget.budget import Budget, DeviceLine, Line
from estimator.fit.budget.source import Source
from estimator.inference.material_parameters import YOUNGS_MODULUS
from estimator.report import page
from estimator.report.estimation.budget_plot import draw_budget, height_in
from estimator.report.page import Html

# The units that people read sizes in, and how many of them make the SI unit; a plain number has none.
_SIZES: Mapping[str, tuple[str, float]] = {
    "N": ("N", 1.0),
    "N·m": ("mN·m", 1e3),
    "m": ("µm", 1e6),
    "rad": ("mrad", 1e3),
    "s": ("ms", 1e3),
    "kg": ("g", 1e3),
    "Pa": ("kPa", 1e-3),
    "1": ("%", 100.0),
    "": ("", 1.0),
}
# Sources that give less to every variance are named together on a terminal.
_SMALL = 5e-4
# What rounding errors give to a variance.
_ROUNDING = 1e-15
WIDTH_IN = 11.4
HALVED_NOTE = (
    "Halved and gone: the combined standard uncertainty if all that is uncertain of this device were half as large, or "
    "nothing, and the estimate weighed the measurements as it does."
)


def source_head(budget: Budget) -> list[str]:
    """Return the head of the table of sources."""
    head = ["source", "u(x)", "type"]
    for name, symbol in budget.symbols.items():
        unit = _unit(budget, name)
        head += [f"|c({symbol})|, {unit or '1'}/unit", f"u({symbol}){f', {unit}' if unit else ''}", "share"]
    return [*head, "of", "from"]


def source_rows(budget: Budget) -> list[list[str]]:
    """Return the sources: name, size, type, by parameter sensitivity, contribution and share, device and origin.

    A star stands behind what the fit knows of.
    """
    return [_source_row(budget, line) for line in budget.lines]


def device_head(budget: Budget) -> list[str]:
    """Return the head of the table of devices."""
    head = ["device"]
    for name, symbol in budget.symbols.items():
        unit = f", {_unit(budget, name)}" if _unit(budget, name) else ""
        head += [f"share in {symbol}", f"u({symbol}) halved{unit}", f"gone{unit}"]
    return head


def device_rows(budget: Budget) -> list[list[str]]:
    """Return the devices: by parameter the share, and the whole if they were half as uncertain, or not at all."""
    return [_device_row(budget, line) for line in budget.devices]


def budget_sentences(budget: Budget) -> list[str]:
    """Return what the budget comes to: combined and expanded uncertainty, and the device to improve first."""
    found = []
    for name, symbol in budget.symbols.items():
        combined, expanded = budget.combined[name], budget.expanded[name]
        unit = f" {_unit(budget, name)}" if _unit(budget, name) else ""
        first = budget.first_to_improve(name)
        found.append(
            f"{symbol}: combined standard uncertainty {_value(name, combined)}{unit}, of which the fit knows "
            f"{_value(name, budget.known[name])}{unit}; expanded uncertainty {_value(name, expanded)}{unit} "
            f"(k = {budget.coverage_factor:.2f}, about 95 %)."
        )
        found.append(
            f"To know {symbol} better, begin with {_named(first)}: it makes {100 * first.share[name]:.0f} % of the "
            f"variance, and half as uncertain it would leave {_value(name, first.halved[name])}{unit}."
        )
    if budget.left_out:
        found.append(
            f"Not in it: {', '.join(budget.left_out)}; the motion has no equilibrium with such an error. State a "
            "smaller one."
        )
    return found


def budget_text(budget: Budget) -> str:
    """Return the whole budget for a terminal."""
    shown = [line for line in budget.lines if max(line.share.values()) >= _SMALL]
    small = [line.source.words for line in budget.lines if line not in shown]
    lines = [
        "Uncertainty budget (standard uncertainties; * the fit knows of it, and its interval holds it)",
        *_aligned([source_head(budget), *(_source_row(budget, line) for line in shown)]),
    ]
    if small:
        lines.append(f"Below 0.05 % of every variance: {', '.join(small)}.")
    lines += ["", *_aligned([device_head(budget), *device_rows(budget)]), "", *budget_sentences(budget)]
    return "\n".join(lines)


def budget_section(budget: Budget | None) -> Iterator[Html]:
    """Yield the section of the page; nothing where nobody asked for a budget."""
    if budget is None:
        return
    yield page.heading("Uncertainty budget")
    for sentence in budget_sentences(budget):
        yield page.paragraph(sentence)
    yield page.figure(
        partial(draw_budget, budget=budget),
        (WIDTH_IN, height_in(budget)),
        "Share of each source in the variance. Blue is what the fit knows of, so that the interval of the estimate "
        "holds it; orange are errors of calibrations and of the geometry, which come on top.",
    )
    yield page.table("Which device to improve", device_head(budget), device_rows(budget))
    yield page.note(HALVED_NOTE)
    yield page.table("Sources of uncertainty", source_head(budget), source_rows(budget))
    yield page.note(
        "u(x) is the standard uncertainty of a source, of each component where it has several; c = ∂y/∂x is what a "
        "unit of it moves, u(y) = |c| u(x) what it gives. Type A is from the statistics of observations, B from "
        "anything else. A star marks what the fit knows of."
    )


def _source_row(budget: Budget, line: Line) -> list[str]:
    source = line.source
    row = [f"{source.words}{' *' if source.known else ''}", _size(source), source.origin.evaluation]
    _, factor = _SIZES[source.unit]
    for name in budget.symbols:
        if line.share[name] < _ROUNDING:
            row += ["0", "0", _percent(0.0)]
            continue
        row += [
            f"{_factor(name) * line.sensitivity[name] / factor:.2g}",
            _value(name, line.contribution[name]),
            _percent(line.share[name]),
        ]
    return [*row, source.device, source.origin.words]


def _device_row(budget: Budget, line: DeviceLine) -> list[str]:
    row: list[str] = [line.device]
    for name in budget.symbols:
        row += [_percent(line.share[name]), _value(name, line.halved[name]), _value(name, line.gone[name])]
    return row


def _named(line: DeviceLine) -> str:
    return line.device if line.device == "prior knowledge" else f"the {line.device}"


def _size(source: Source) -> str:
    unit, factor = _SIZES[source.unit]
    return f"{factor * source.size:.3g}{f' {unit}' if unit else ''}"


def _unit(budget: Budget, name: str) -> str:
    return _SIZES[budget.units[name]][0]


def _factor(name: str) -> float:
    return _SIZES[YOUNGS_MODULUS.unit][1] if name == YOUNGS_MODULUS.name else 1.0


def _value(name: str, value: float) -> str:
    return f"{_factor(name) * value:.3g}"


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows as lines with their columns below each other, the first to the left and numbers to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    words = [_is_text(column) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            text.ljust(width) if to_the_left else text.rjust(width)
            for text, width, to_the_left in zip(row, widths, words, strict=True)
        ).rstrip()
        for row in rows
    ]


def _is_text(column: Sequence[str]) -> bool:
    return not any(text[:1].isdigit() or text[:1] == "-" for text in column[1:])
