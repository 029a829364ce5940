import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from daq.plans import Trial
from daq.trajectories import PULL, TWIST_AND_PULL, Dwell
from daq.virtual_rig.layout import Addresses, rig_description
from gui.recording.motion_profile import in_words, motion_profile
from gui.widgets.forms.parameter_form import ParameterForm
from gui.widgets.forms.trial_panel import TrialPanel
from robot_drivers.protocols import Speed

RIG = rig_description(Addresses(1, 2, 3, 4, 5, 6, ("tcp://a", "tcp://b")), Path("stereo.toml"))


def test_a_profile_has_the_duration_of_its_moves_and_windows() -> None:
    twist = replace(
        TWIST_AND_PULL,
        steps=2,
        step_length=0.004,
        angle=math.radians(20.0),
        return_steps=1,
        speed=Speed(0.002, 1.0),
        dwell=Dwell(rest_s=1.0, settle_s=0.5, measure_s=0.8, holds_s=(3.0,)),
    )
    profile = motion_profile(twist.trajectory())
    assert profile.duration_s == pytest.approx(1.5 + 2 * (2.0 + 1.3) + 3.0 + (4.0 + 1.3))
    assert profile.windows_s.shape == (5, 2)
    assert np.abs(profile.position_m).max(axis=0) == pytest.approx([0.008, 0.0, 0.0])
    assert profile.turn_deg.max() == pytest.approx(20.0)
    assert (in_words(59.6), in_words(125.0)) == ("1 min 00 s", "2 min 05 s")


def test_the_form_shows_a_dataclass_in_the_units_of_the_laboratory(qtbot: QtBot) -> None:
    usual = {"steps": 4, "step_length_m": 0.002, "angle_rad": math.radians(30.0), "holds_s": (3.0, 8.5)}
    form = ParameterForm(Trial, usual, {"steps": (1, 20), "step_length_m": (1e-4, 6.5e-3)})
    qtbot.addWidget(form)
    assert form.editors["step_length_m"].widget.text() == "2.00 mm"
    assert form.editors["step_length_m"].allowed == "0.1 to 6.5 mm"
    assert form.editors["angle_rad"].widget.text() == "30.0 °"
    assert form.editors["holds_s"].widget.text() == "3, 8.5"
    assert {**form.values(), "holds_s": 0.0} == pytest.approx({**usual, "holds_s": 0.0})
    assert form.values()["holds_s"] == (3.0, 8.5)
    form.set_values({"step_length_m": 0.5, "holds_s": (1.0,)})
    assert (form.values()["step_length_m"], form.values()["holds_s"]) == (pytest.approx(6.5e-3), (1.0,))
    with pytest.raises(ValueError, match="Trial has no field colour"):
        ParameterForm(Trial, {"colour": 1}, {})


def test_a_list_of_numbers_that_is_none_is_told(qtbot: QtBot) -> None:
    panel = TrialPanel(RIG)
    qtbot.addWidget(panel)
    with qtbot.waitSignal(panel.trial_changed):
        panel.form.editors["holds_s"].widget.setText("3, soon")
    assert "'3, soon' is no list of numbers such as 3, 8, 18" in panel.told.text()


def test_the_panel_lays_out_the_retraction_that_is_chosen(qtbot: QtBot) -> None:
    panel = TrialPanel(RIG)
    qtbot.addWidget(panel)
    assert panel.trajectory() == PULL.trajectory()
    panel.card("twist_and_pull").click()
    assert panel.trajectory() == TWIST_AND_PULL.trajectory()
    panel.form.set_values({"rounds": 2})
    assert "takes 58 s" in panel.told.text()
