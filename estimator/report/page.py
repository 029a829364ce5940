"""A page in one file: text, tables and figures in well-formed HTML that asks for nothing from outside."""

import html
import io
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.resources import files
from typing import NewType

import matplotlib
from matplotlib.figure import Figure

from estimator.report.theme import PLOT_STYLE, css_variables, themed

Html = NewType("Html", str)
"""Markup; whatever else goes into a page is escaped on the way."""

# The gid of the artists that a :func:`switched_figure` shows and hides.
SWITCHED = "switched"

_RASTER_DPI = 125

# A browser that reads this loads nothing and runs nothing, whatever a name in the page may contain.
_CONTENT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; form-action 'none'; base-uri 'none'"
)


def page(title: str, blocks: Iterable[Html]) -> str:
    """Return a whole page that follows the reader's light or dark theme and prints in the light one."""
    style = files("estimator.report").joinpath("page.css").read_text(encoding="utf-8")
    colours = (
        f":root {{ color-scheme: light dark; {css_variables('light')} }}\n"
        f"@media screen and (prefers-color-scheme: dark) {{ :root {{ {css_variables('dark')} }} }}"
    )
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en"><head><meta charset="utf-8"/>',
            f'<meta http-equiv="Content-Security-Policy" content="{_CONTENT_POLICY}"/>',
            '<meta name="viewport" content="width=device-width, initial-scale=1"/>',
            f"<title>{html.escape(title)}</title>",
            f"<style>\n{colours}\n{style}</style></head><body>",
            f"<h1>{html.escape(title)}</h1>",
            *blocks,
            "</body></html>\n",
        ]
    )


def heading(text: str) -> Html:
    """Return the heading of a section."""
    return Html(f"<h2>{html.escape(text)}</h2>")


def headline(text: str) -> Html:
    """Return the sentence that a reader must not miss."""
    return Html(f'<p class="headline">{html.escape(text)}</p>')


def paragraph(text: str) -> Html:
    """Return a sentence or two."""
    return Html(f"<p>{html.escape(text)}</p>")


def note(text: str) -> Html:
    """Return a remark in small print."""
    return Html(f'<p class="note">{html.escape(text)}</p>')


def warnings(items: Sequence[str]) -> Html:
    """Return a marked list of what the reader should worry about; nothing if there is nothing."""
    if not items:
        return Html("")
    points = "".join(f"<li>{html.escape(item)}</li>" for item in items)
    return Html(f'<ul class="warnings">{points}</ul>')


def table(caption: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> Html:
    """Return a table of numbers; the first column names the row."""
    lines = "\n".join(_row("td", row) for row in rows)
    return _scrolled(
        f"<table>{_caption(caption)}<thead>{_row('th', head)}</thead><tbody>{lines}</tbody></table>"
    )


def facts(caption: str, items: Mapping[str, str]) -> Html:
    """Return a table of names and values in words."""
    lines = "\n".join(_row("td", item) for item in items.items())
    return _scrolled(f'<table class="facts">{_caption(caption)}<tbody>{lines}</tbody></table>')


def beside(blocks: Iterable[Html]) -> Html:
    """Return blocks side by side, as far as the page is wide."""
    return Html(f'<div class="tables">{"".join(blocks)}</div>')


def figure(draw: Callable[[Figure], None], size_in: tuple[float, float], caption: str) -> Html:
    """Return what ``draw`` draws, as vectors in the page; artists marked as rasterised become a PNG in it.

    Parameters
    ----------
    draw : fills an empty figure, in the colours of :mod:`estimator.report.theme`
    size_in : width and height, inches
    caption : says in words what is to be seen
    """
    text = html.escape(caption)
    return Html(f"<figure>{_svg(draw, size_in)}<figcaption>{text}</figcaption></figure>")


def switched_figure(
    draw: Callable[[Figure], None], size_in: tuple[float, float], caption: str, name: str, label: str
) -> Html:
    """Return a figure below a switch, at first on, for the artists whose gid is ``SWITCHED``.

    Parameters
    ----------
    draw, size_in, caption : as for :func:`figure`
    name : of the switch, unique in the page
    label : what it shows
    """
    drawn = figure(draw, size_in, caption)
    key = html.escape(name)
    box = f'<input type="checkbox" class="layer-switch" id="{key}" checked="checked"/>'
    return Html(f'<div>{box}<label class="switch" for="{key}"> {html.escape(label)}</label>{drawn}</div>')


def _svg(draw: Callable[[Figure], None], size_in: tuple[float, float]) -> str:
    with matplotlib.rc_context(PLOT_STYLE):
        sheet = Figure(figsize=size_in)
        draw(sheet)
        buffer = io.StringIO()
        nothing = dict.fromkeys(("Creator", "Date", "Format", "Type"))
        sheet.savefig(buffer, format="svg", dpi=_RASTER_DPI, metadata=nothing)
    return themed(_embedded(buffer.getvalue()))


def _embedded(svg: str) -> str:
    """Return a stand-alone SVG as a part of a page.

    Prologue, namespaces, the ids that other figures have too and digits of places below a hundredth of a point go.
    """
    body = re.sub(r' xmlns(:xlink)?="[^"]*"', "", svg[svg.index("<svg") :].rstrip())
    body = body.replace(f'<g id="{SWITCHED}">', f'<g class="{SWITCHED}">').replace("xlink:href", "href")
    body = re.sub(r'<g id="[^"]*">', "<g>", body)
    return re.sub(r"<[^>]*>", lambda tag: re.sub(r"(\d\.\d\d)\d+", r"\1", tag.group()), body)


def _scrolled(markup: str) -> Html:
    return Html(f'<div class="scroll">{markup}</div>')


def _caption(text: str) -> str:
    return f"<caption>{html.escape(text)}</caption>" if text else ""


def _row(tag: str, cells: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"
