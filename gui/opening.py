"""The first thing to be seen where no rig file was named: a rig file, or the emulated laboratory."""

from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QVBoxLayout, QWidget

from daq.errors import DaqError
from daq.rig import read_rig
from gui.widgets.cards import button, label, set_role

STARTING = (
    "The emulated devices are starting; this takes some seconds, and the first time, when the phantom's solver is "
    "compiled, a minute or so."
)


class Opening(QWidget):
    """``virtual_wanted``, or ``rig_read`` with the Rig of a file."""

    virtual_wanted = Signal()
    rig_read = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Retraction")
        self.virtual_button = button(
            "Emulated laboratory", "primary", "Everything can be tried without hardware."
        )
        self.file_button = button("Open a rig file …", tip="retraction-rig/1, TOML")
        self.told = label("Nothing moves before you start a session.", "muted")
        for made in (self.virtual_button, self.file_button):
            made.setMinimumHeight(52)
        column = QVBoxLayout(self)
        column.setContentsMargins(48, 40, 48, 40)
        column.setSpacing(16)
        column.addWidget(label("Soft-tissue retraction", "title"))
        column.addWidget(label("Which laboratory is it today?", "muted"))
        row = QHBoxLayout()
        row.setSpacing(12)
        row.addWidget(self.virtual_button)
        row.addWidget(self.file_button)
        column.addLayout(row)
        column.addWidget(self.told)
        column.addStretch(1)
        self.resize(560, 260)
        self.virtual_button.clicked.connect(self._take_virtual)
        self.file_button.clicked.connect(self._ask_for_file)

    def show_failure(self, why: str) -> None:
        """Show what went wrong; another choice may be made."""
        self.told.setText(why)
        set_role(self.told, "bad")
        self._enable(True)

    def wait(self, words: str) -> None:
        """Show what is waited for."""
        self.told.setText(words)
        set_role(self.told, "muted")
        self._enable(False)

    def _take_virtual(self) -> None:
        self.wait(STARTING)
        self.virtual_wanted.emit()

    def _ask_for_file(self) -> None:
        dialog = QFileDialog(self, "Open a rig file", "", "rig files (*.toml)")
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setModal(False)
        dialog.fileSelected.connect(self.read)
        dialog.show()

    def read(self, path: str) -> None:
        """Read a rig file; a mistake in it is shown."""
        try:
            self.rig_read.emit(read_rig(Path(path)))
        except DaqError as error:
            self.show_failure(str(error))

    def _enable(self, enabled: bool) -> None:
        self.virtual_button.setEnabled(enabled)
        self.file_button.setEnabled(enabled)
