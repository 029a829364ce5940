"""The figures of the reports, one at a time."""

import io
from collections.abc import Callable, Mapping

import matplotlib
from matplotlib.figure import Figure

from estimator.errors import InputError
from estimator.report.theme import PLOT_STYLE

Draw = Callable[[Figure], None]


class Drawing(Figure):
    """A matplotlib figure that a notebook shows whether or not pyplot was imported."""

    def _repr_svg_(self) -> str:
        buffer = io.StringIO()
        with matplotlib.rc_context(PLOT_STYLE):
            self.savefig(buffer, format="svg")
        return buffer.getvalue()


def drawing(draw: Draw, size_in: tuple[float, float]) -> Drawing:
    """Return what ``draw`` fills an empty sheet of that size (width, height, inches) with."""
    with matplotlib.rc_context(PLOT_STYLE):
        sheet = Drawing(figsize=size_in)
        draw(sheet)
    return sheet


def chosen(kinds: Mapping[str, tuple[Draw, tuple[float, float]]], kind: str) -> Drawing:
    """Return the drawing of that kind.

    Raises
    ------
    InputError
        There is none.
    """
    if kind not in kinds:
        raise InputError(f"no picture is called '{kind}'; choose one of {', '.join(kinds)}")
    return drawing(*kinds[kind])
