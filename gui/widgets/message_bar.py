"""Messages at the foot of the window, and the questions that need an answer; never a dialog in the way of the stop."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from gui.messages import Message
from gui.widgets.cards import button, label
from gui.widgets.lamp import Lamp

_INFORMATION_MS = 8000
_HEALTH = {"information": "good", "warning": "doubtful", "error": "bad"}


@dataclass(frozen=True, slots=True)
class Answer:
    """A button below a message, and what it does."""

    text: str
    act: Callable[[], None]
    role: str = ""


class MessageBar(QFrame):
    """Shows one message at a time, the others wait; a question comes first, good news go by themselves."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("role", "card")
        self._waiting: list[tuple[Message, tuple[Answer, ...]]] = []
        self._lamp = Lamp()
        self._what = label("", "heading")
        self._rest = label("")
        self._more = QLabel()
        self._more.setProperty("role", "muted")
        self._copy = button("Copy details", "flat")
        self._copy.clicked.connect(self._copy_details)
        self._dismiss = button("Dismiss", "flat")
        self._dismiss.clicked.connect(self.dismiss)
        self._answers = QHBoxLayout()
        self._answer_buttons: list[QPushButton] = []
        texts = QVBoxLayout()
        texts.setSpacing(2)
        texts.addWidget(self._what)
        texts.addWidget(self._rest)
        row = QHBoxLayout(self)
        row.setContentsMargins(14, 8, 8, 8)
        row.addWidget(self._lamp, alignment=Qt.AlignmentFlag.AlignTop)
        row.addLayout(texts, stretch=1)
        row.addWidget(self._more)
        row.addLayout(self._answers)
        row.addWidget(self._copy)
        row.addWidget(self._dismiss)
        self._timer = QTimer(self, singleShot=True, interval=_INFORMATION_MS)
        self._timer.timeout.connect(self.dismiss)
        self.hide()

    @property
    def message(self) -> Message | None:
        """The message that is shown."""
        return self._waiting[0][0] if self._waiting else None

    def show_message(self, message: Message) -> None:
        """Show a message once those before it are dismissed; the same one is not told twice."""
        if self._waiting and self._waiting[0][0].severity == "information":
            self._waiting.pop(0)
        if all(message != waiting for waiting, _ in self._waiting):
            self._waiting.append((message, ()))
        self._render()

    def ask(self, message: Message, answers: Sequence[Answer]) -> None:
        """Ask before everything else; any answer dismisses the question."""
        self._waiting = [(told, of) for told, of in self._waiting if told != message]
        self._waiting.insert(0, (message, tuple(answers)))
        self._render()

    def answer(self, text: str) -> QPushButton:
        """Return the button of an answer that is offered; raises KeyError where it is not."""
        buttons = {made.text(): made for made in self._answer_buttons}
        return buttons[text]

    def dismiss(self) -> None:
        """Go on to the next message."""
        if self._waiting:
            self._waiting.pop(0)
        self._render()

    def _render(self) -> None:
        for made in self._answer_buttons:
            self._answers.removeWidget(made)
            made.deleteLater()
        self._answer_buttons = []
        self._timer.stop()
        self.setVisible(bool(self._waiting))
        if not self._waiting:
            return
        message, answers = self._waiting[0]
        self._lamp.show_health(_HEALTH[message.severity])  # type: ignore[arg-type]
        self._what.setText(message.what)
        self._rest.setText(" ".join(filter(None, (message.safe, message.do))))
        self._rest.setVisible(bool(message.safe or message.do))
        others = len(self._waiting) - 1
        self._more.setText(f"{others} more" if others else "")
        self._copy.setVisible(bool(message.details))
        self._dismiss.setVisible(not answers)
        for answer in answers:
            self._answer_buttons.append(self._answer_button(answer))
            self._answers.addWidget(self._answer_buttons[-1])
        if message.severity == "information" and not answers:
            self._timer.start()

    def _answer_button(self, answer: Answer) -> QPushButton:
        made = button(answer.text, answer.role)

        def act() -> None:
            self.dismiss()
            answer.act()

        made.clicked.connect(act)
        return made

    def _copy_details(self) -> None:
        if self.message is not None:
            QGuiApplication.clipboard().setText(self.message.as_text())
