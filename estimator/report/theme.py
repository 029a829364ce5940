"""Colours and plot style of the pages; figures are drawn in the light colours and follow the reader's theme.

The hues are those of M. Okabe and K. Ito (Color Universal Design, 2008), which colour-blind readers tell apart; each
has a lighter twin for dark backgrounds.
"""

import re
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Colour:
    """A colour on a light and on a dark background, ``#rrggbb``."""

    light: str
    dark: str


COLOURS = {
    "paper": Colour("#fdfdfc", "#15191e"),
    "ink": Colour("#1a1f26", "#e7eaee"),
    "muted": Colour("#5a6472", "#9ba6b3"),
    "line": Colour("#d9dde2", "#353d47"),
    "panel": Colour("#f2f4f6", "#1f252c"),
    "measured": Colour("#0072b2", "#5db8ec"),
    "predicted": Colour("#d55e00", "#ff8a3d"),
    "truth": Colour("#009e73", "#2bc79b"),
    "anchor": Colour("#b4488f", "#dd86bf"),
    "grasp": Colour("#b98200", "#e9b949"),
}

INK, MUTED, LINE = COLOURS["ink"].light, COLOURS["muted"].light, COLOURS["line"].light
MEASURED, PREDICTED, TRUTH = (COLOURS[name].light for name in ("measured", "predicted", "truth"))
ANCHOR, GRASP = COLOURS["anchor"].light, COLOURS["grasp"].light

# What matplotlib is told while a figure is drawn: text stays text, names of clip paths do not change with the run.
PLOT_STYLE: dict[Any, object] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "report",
    "font.size": 10,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titley": 1.0,
    "axes.labelsize": 10,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.facecolor": "none",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": LINE,
    "grid.linewidth": 0.7,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.frameon": False,
    "legend.fontsize": 9.5,
    "lines.linewidth": 1.6,
    "figure.facecolor": "none",
}


def css_variables(background: str) -> str:
    """Return the declarations of all colours for a ``"light"`` or a ``"dark"`` background."""
    return " ".join(f"--{name}: {getattr(colour, background)};" for name, colour in COLOURS.items())


def themed(svg: str) -> str:
    """Return an SVG with the palette's colours replaced by the page's variables."""
    names = {colour.light: name for name, colour in COLOURS.items()}
    return re.sub("|".join(names), lambda match: f"var(--{names[match.group()]})", svg)
