"""How long work tells what it is doing."""

from typing import Protocol


class Progress(Protocol):
    """Called with a line of text, and how many of how many steps of that work are done."""

    def __call__(self, text: str, done: int, total: int, /) -> None:
        """Show it."""


def silent(text: str, done: int, total: int) -> None:
    """Show nothing: nobody watches."""
