"""The names of curves beside a sample of each."""

from collections.abc import Sequence

from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QLabel, QWidget

from gui.inks import colour
from gui.theme import theme_of
from gui.widgets.plots.plot_sheet import Stroke


class Legend(QLabel):
    """Above a sheet of plots: one line where there is room for it."""

    def __init__(self, parent: QWidget | None = None) -> None:
        self._strokes: tuple[tuple[str, Stroke], ...] = ()
        super().__init__(parent)
        self.setWordWrap(True)

    def show_strokes(self, strokes: Sequence[tuple[str, Stroke]]) -> None:
        """Show names with their strokes."""
        self._strokes = tuple(strokes)
        theme = theme_of(self)
        self.setText(
            " &nbsp; &nbsp; ".join(
                f'<span style="color:{colour(stroke.ink, theme).name()}">{_sample(stroke)}</span> {name}'
                for name, stroke in strokes
            )
        )

    def changeEvent(self, event: QEvent) -> None:
        """Follow the theme."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self.show_strokes(self._strokes)


def _sample(stroke: Stroke) -> str:
    if stroke.width == 0:
        return "●"
    return "╌╌" if stroke.dashed else "━━"
