"""Values as TOML writes them."""

import json

from estimator.experiment.holds import Axis, Box, Vector


def toml_text(text: str) -> str:
    """Return a text in quotes."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def toml_number(value: float) -> str:
    """Return a number with all of its digits."""
    return repr(float(value))


def toml_vector(vector: Vector) -> str:
    """Return three numbers as a list."""
    return f"[{', '.join(toml_number(value) for value in vector)}]"


def toml_box(box: Box) -> str:
    """Return two opposite corners as a list."""
    return f"[{toml_vector(box.lower)}, {toml_vector(box.upper)}]"


def toml_axes(axes: tuple[Axis, ...]) -> str:
    """Return axes as a list of texts."""
    return f"[{', '.join(toml_text(axis) for axis in axes)}]"
