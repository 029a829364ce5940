"""Cyclic garbage of the window ends on the interface thread.

Python collects on whichever thread happens to allocate. Where that is a thread beside the interface and the garbage
holds objects of Qt, their destruction wants Qt's locks while it holds the interpreter, and the interface thread may
hold those locks while it waits for the interpreter: then both stand still for ever.
"""

import gc

from PySide6.QtCore import QObject, QTimer

_LOOK_MS = 100


class Collector(QObject):
    """Collects on the thread that it lives on, and no other thread collects, until :meth:`end`.

    It asks Python's own counts and thresholds which generations are due.
    """

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._were_on = gc.isenabled()
        gc.disable()
        self._timer = QTimer(self, interval=_LOOK_MS)
        self._timer.timeout.connect(collect_what_is_due)
        self._timer.start()

    def end(self) -> None:
        """Leave collecting to Python again, as it was."""
        self._timer.stop()
        if self._were_on:
            gc.enable()


def collect_what_is_due() -> None:
    """Collect the oldest generation, and with it all younger ones, whose count has passed its threshold."""
    due = [
        age
        for age, (count, most) in enumerate(zip(gc.get_count(), gc.get_threshold(), strict=True))
        if 0 < most < count
    ]
    if due:
        gc.collect(due[-1])
