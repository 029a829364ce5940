"""What is to be recorded: one of the standard retractions, its parameters, and how it will look."""

import math
from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QSizePolicy, QStackedWidget, QVBoxLayout, QWidget

from daq.errors import TrajectoryError
from daq.limits import Limits
from daq.plans import Trial
from daq.rig import Rig
from daq.trajectories import STANDARD, Kind, Retraction, Trajectory
from gui.recording.motion_profile import in_words, motion_profile
from gui.widgets.cards import Card, label
from gui.widgets.forms.parameter_form import ParameterForm, Range
from gui.widgets.forms.retraction_card import RetractionCard
from gui.widgets.plots.time_view import TimeView
from gui.widgets.view_3d.path_view import PathView


class TrialPanel(QWidget):
    """Edits a :class:`daq.plans.Trial`; ``trial_changed`` tells every change."""

    trial_changed = Signal()

    def __init__(self, rig: Rig, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._cards = {kind: RetractionCard(retraction) for kind, retraction in STANDARD.items()}
        self._forms = {kind: _form(retraction, rig.limits) for kind, retraction in STANDARD.items()}
        group = QButtonGroup(self)
        self._stack = QStackedWidget()
        self._stack.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        cards = QHBoxLayout()
        cards.setSpacing(10)
        for kind, card in self._cards.items():
            group.addButton(card)
            cards.addWidget(card)
            self._stack.addWidget(self._forms[kind])
            self._forms[kind].changed.connect(self._render)
            card.clicked.connect(lambda _=False, kind=kind: self.choose(kind))
        self._path, self._time = PathView(rig.specimen), TimeView()
        self.told = label("", "muted")
        parameters, preview = Card("Parameters"), Card("Preview")
        parameters.body.addWidget(self._stack)
        parameters.body.addStretch(1)
        preview.body.addWidget(self._path, stretch=3)
        preview.body.addWidget(self._time, stretch=2)
        preview.body.addWidget(self.told)
        both = QHBoxLayout()
        both.setSpacing(12)
        both.addWidget(parameters)
        both.addWidget(preview, stretch=1)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(12)
        column.addLayout(cards)
        column.addLayout(both, stretch=1)
        self.kind: str = next(iter(STANDARD))
        self.choose(self.kind)

    def choose(self, kind: str) -> None:
        """Choose one of the standard retractions."""
        self.kind = kind
        self._cards[kind].setChecked(True)
        self._stack.setCurrentWidget(self._forms[kind])
        self._render()

    def card(self, kind: Kind) -> RetractionCard:
        """Return the card of a retraction."""
        return self._cards[kind]

    @property
    def form(self) -> ParameterForm:
        """The parameters of what is chosen."""
        return self._forms[self.kind]

    def trial(self) -> Trial:
        """Return what is entered; raises TrajectoryError where it cannot be right."""
        try:
            return Trial(self.kind, **self.form.values())
        except ValueError as error:
            raise TrajectoryError(str(error)) from error

    def trajectory(self) -> Trajectory:
        """Return what is entered, laid out for one session; raises TrajectoryError where it cannot be right."""
        return replace(self.trial(), repeat=1).lay_out(Path())

    def _render(self) -> None:
        try:
            profile = motion_profile(self.trajectory())
        except TrajectoryError as error:
            self._path.show_profile(None)
            self._time.show_profile(None)
            self.told.setText(str(error))
        else:
            self._path.show_profile(profile)
            self._time.show_profile(profile)
            self.told.setText(
                f"takes {in_words(profile.duration_s)}, {len(profile.windows_s)} measuring windows"
            )
        self.trial_changed.emit()


def _form(retraction: Retraction, limits: Limits) -> ParameterForm:
    usual = {
        "steps": retraction.steps,
        "step_length_m": retraction.step_length,
        "angle_rad": retraction.angle,
        "return_steps": retraction.return_steps,
        "speed_m_s": retraction.speed.linear,
        "settle_s": retraction.dwell.settle_s,
        "measure_s": retraction.dwell.measure_s,
        "holds_s": retraction.dwell.holds_s,
        "rounds": 1,
        "repeat": 1,
    }
    if not retraction.angle:
        del usual["angle_rad"]
    ranges: dict[str, Range] = {
        "steps": (1, 200),
        "step_length_m": (1e-4, limits.step_m),
        "angle_rad": (-math.pi / 2, math.pi / 2),
        "return_steps": (0, 200),
        "speed_m_s": (5e-4, limits.speed_m_s),
        "settle_s": (0.0, 60.0),
        "measure_s": (0.1, 60.0),
        "rounds": (1, 20),
        "repeat": (1, 50),
    }
    return ParameterForm(Trial, usual, ranges)
