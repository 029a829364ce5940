"""The rig that diagnoses itself: what it proposes, when it ends, and that nothing moves unasked or beyond a limit."""

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from investigation_bench import RIG, BenchLaboratory, ScriptedExaminer, ScriptedOperator, investigate

from daq.cli import main
from daq.cli.sessions.investigate import AtTerminal
from daq.errors import MotionLimitError, SessionError, SoftwareStopError
from daq.frames import rotation
from daq.investigation.choosing import Proposal, candidates, openings
from daq.investigation.journal import Dropped, Entry, Journal, read_journal, write_journal
from daq.investigation.loop import JOURNAL_FILE, Answer, Rules
from daq.investigation.manoeuvre import RELEASED, Manoeuvre, still
from daq.investigation.offered import OFFERED, OPENING
from daq.investigation.report import ending_sentence, outcome_as_json, write_report
from daq.investigation.safety import Bounds, forbidden_by_load, forbidden_by_reach
from daq.trajectories.planned import duration_s
from daq.trajectories.trajectory import STANDARD_SPEED
from estimator.optimal_design.foreseeing import Foresight
from robot_drivers.abb.motion.limits import MotionLimits
from robot_drivers.errors import DeviceFaultError, MotionRefusedError

POSES = Manoeuvre("tool_poses", amplitude_m=0.005)
FAR = Manoeuvre("pull", amplitude_m=0.02, steps=8, return_steps=4)


@pytest.mark.parametrize("manoeuvre", [*OPENING, *OFFERED], ids=lambda one: one.name)
def test_nothing_that_is_offered_turns_quicker_than_a_standard_retraction(manoeuvre: Manoeuvre) -> None:
    assert manoeuvre.trajectory().speed.angular <= STANDARD_SPEED.angular


@pytest.mark.parametrize("manoeuvre", [one for one in OFFERED if one.strains], ids=lambda one: one.name)
def test_the_steps_of_what_is_offered_are_within_what_the_robot_allows_for_one(manoeuvre: Manoeuvre) -> None:
    steps = manoeuvre.trajectory().steps
    turns = [rotation(step.T_rest_gripper.quaternion_wxyz) for step in steps]
    turned = [(after * before.inv()).magnitude() for before, after in pairwise(turns)]
    assert max(turned) < 0.9 * MotionLimits().step_angle


@pytest.fixture
def laboratory(tmp_path: Path) -> BenchLaboratory:
    return BenchLaboratory(tmp_path)


def entry(manoeuvre: Manoeuvre) -> Entry:
    return Entry(manoeuvre, "nowhere", manoeuvre.duration_s, 0.1, "for the test")


def test_it_begins_with_a_short_pull_and_ends_when_one_answer_is_sure(laboratory: BenchLaboratory) -> None:
    examiner = ScriptedExaminer(sure_after=3)
    outcome = investigate(laboratory, examiner=examiner)
    assert outcome.ending == "one answer is sure"
    assert laboratory.done[0] == OPENING[0]
    assert len(laboratory.done) == 3
    assert examiner.asked_in_full[-1]


def test_screening_alone_never_ends_it(laboratory: BenchLaboratory) -> None:
    examiner = ScriptedExaminer(sure_after=1, promising_after=1)
    outcome = investigate(laboratory, examiner=examiner)
    assert examiner.asked_in_full == [False, True]
    assert outcome.journal.entries[-1].in_full


@pytest.mark.parametrize("consents", [0, 1, 2])
def test_nothing_moves_that_was_not_agreed_to(laboratory: BenchLaboratory, consents: int) -> None:
    operator = ScriptedOperator(lambda _: "do it" if len(operator.proposals) <= consents else "stop")
    outcome = investigate(laboratory, operator)
    assert outcome.ending == "stopped by the operator"
    assert len(laboratory.done) == consents
    assert laboratory.done == [one.manoeuvre for one in operator.proposals[:consents]]


def test_what_was_refused_is_not_proposed_again_not_even_by_a_later_call(laboratory: BenchLaboratory) -> None:
    def but_no_turns(proposal: Proposal) -> Answer:
        if len(operator.proposals) > 6:
            return "stop"
        return "not this one" if any(proposal.manoeuvre.turn_rad) else "do it"

    operator = ScriptedOperator(but_no_turns)
    investigate(laboratory, operator, examiner=ScriptedExaminer(sure_after=99, promising_after=99))
    refused = [one.manoeuvre for one in operator.proposals if any(one.manoeuvre.turn_rad)]
    assert len(refused) == len(set(refused))
    assert not set(refused) & set(laboratory.done)
    later = ScriptedOperator()
    investigate(laboratory, later, examiner=ScriptedExaminer(sure_after=99, promising_after=99))
    assert not set(refused) & {one.manoeuvre for one in later.proposals}


def test_where_everything_is_refused_it_ends_without_a_motion(laboratory: BenchLaboratory) -> None:
    outcome = investigate(laboratory, ScriptedOperator(lambda _: "not this one"))
    assert outcome.ending == "everything refused"
    assert laboratory.done == []
    assert "Nothing was measured" in ending_sentence(outcome)


@pytest.mark.parametrize("broken_off_at", [1, 2, 3])
def test_an_interrupted_investigation_goes_on_with_what_was_not_finished(
    laboratory: BenchLaboratory, broken_off_at: int
) -> None:
    laboratory.fails[broken_off_at] = KeyboardInterrupt()
    with pytest.raises(KeyboardInterrupt):
        investigate(laboratory)
    assert len(read_journal(laboratory.folder / JOURNAL_FILE, "virtual").entries) == broken_off_at - 1
    outcome = investigate(laboratory)
    assert outcome.ending == "one answer is sure"
    finished = [one.manoeuvre for one in outcome.journal.entries]
    assert len(finished) == len(set(finished)) == 3


def test_a_manoeuvre_at_which_the_guard_held_the_robot_ends_it_and_is_not_tried_again(
    laboratory: BenchLaboratory,
) -> None:
    laboratory.fails[2] = SoftwareStopError("force of 16 N exceeds the limit of 15 N")
    outcome = investigate(laboratory)
    assert outcome.ending == "robot held"
    assert laboratory.done[-1] in outcome.journal.refused
    again = investigate(laboratory)
    assert laboratory.done.count(outcome.journal.refused[0]) == 1
    assert again.ending == "one answer is sure"


REFUSALS = [
    MotionRefusedError("step 2 of 6 refused, nothing has moved: flange position is out of reach of the arm"),
    MotionLimitError("pull, step 1: 7.00 mm exceed the limit of 6.5 mm; choose shorter steps"),
]


@pytest.mark.parametrize("refusal", REFUSALS, ids=lambda one: type(one).__name__)
@pytest.mark.parametrize("refused_at", [1, 2, 3])
def test_what_the_rig_refuses_before_anything_moves_is_dropped_and_the_next_best_is_done(
    laboratory: BenchLaboratory, refused_at: int, refusal: Exception
) -> None:
    undisturbed = investigate(BenchLaboratory(laboratory.folder / "undisturbed")).journal
    laboratory.fails[refused_at] = refusal
    operator = ScriptedOperator()
    outcome = investigate(laboratory, operator)
    (dropped,) = outcome.journal.dropped
    assert dropped == Dropped(undisturbed.entries[refused_at - 1].manoeuvre, str(refusal))
    assert operator.heard == [dropped]
    assert dropped.manoeuvre.words in dropped.words
    assert str(refusal) in dropped.words
    assert outcome.ending == "one answer is sure"
    done = [one.manoeuvre for one in outcome.journal.entries]
    assert len(done) == 3
    assert dropped.manoeuvre not in done
    assert [one.manoeuvre for one in operator.proposals] == laboratory.done


def test_what_was_dropped_is_not_proposed_by_a_later_call_either(laboratory: BenchLaboratory) -> None:
    laboratory.fails[2] = REFUSALS[0]
    first = ScriptedOperator(lambda _: "stop" if first.heard else "do it")
    (dropped,) = investigate(laboratory, first).journal.dropped
    later = ScriptedOperator()
    outcome = investigate(laboratory, later)
    assert outcome.journal.dropped == (dropped,)
    assert dropped.manoeuvre not in [one.manoeuvre for one in later.proposals]


@pytest.mark.parametrize(
    "stopped",
    [SessionError("step 3 was refused under way"), DeviceFaultError("the motion was stopped")],
    ids=lambda one: type(one).__name__,
)
def test_a_motion_that_was_stopped_under_way_is_no_refusal_and_ends_it(
    laboratory: BenchLaboratory, stopped: Exception
) -> None:
    laboratory.fails[2] = stopped
    operator = ScriptedOperator()
    with pytest.raises(type(stopped), match=str(stopped)):
        investigate(laboratory, operator)
    kept = read_journal(laboratory.folder / JOURNAL_FILE, "virtual")
    assert (len(kept.entries), kept.dropped, operator.heard) == (1, (), [])


@given(st.sampled_from([one for one in OFFERED if one.kind in RELEASED]))
def test_where_the_tissue_was_taken_out_for_what_is_dropped_then_nothing_strains_it_any_more(
    asking: Manoeuvre,
) -> None:
    journal = Journal("x", (entry(FAR),)).dropping(Dropped(asking, "beyond reach"))
    assert not any(journal.is_open(one) for one in OFFERED if one.strains)


def test_after_a_refusal_for_which_the_tissue_was_taken_out_no_pull_of_the_same_proposals_is_done(
    laboratory: BenchLaboratory,
) -> None:
    examiner = ScriptedExaminer(worth=lambda one: 90.0 if one == POSES else 0.3)
    laboratory.fails[2] = REFUSALS[0]
    operator = ScriptedOperator()
    outcome = investigate(laboratory, operator, Rules(offered=(POSES, FAR)), examiner)
    assert [one.manoeuvre for one in operator.proposals] == [OPENING[0], POSES]
    assert outcome.ending == "everything refused"


@pytest.mark.parametrize("minutes", [0.3, 1.0, 2.5])
def test_the_budget_is_never_passed(laboratory: BenchLaboratory, minutes: float) -> None:
    rules = Rules(budget_s=60.0 * minutes)
    outcome = investigate(laboratory, rules=rules, examiner=ScriptedExaminer(99, 99))
    assert outcome.journal.seconds <= rules.budget_s


def test_what_tells_nothing_is_not_done(laboratory: BenchLaboratory) -> None:
    examiner = ScriptedExaminer(99, 99, worth=lambda one: 1e-3)
    outcome = investigate(laboratory, examiner=examiner)
    assert outcome.ending == "nothing more to learn"
    assert len(laboratory.done) == 1
    assert examiner.asked_in_full[-1]


def test_the_most_information_in_a_minute_comes_first_not_the_most(laboratory: BenchLaboratory) -> None:
    slow, quick = still(60.0), Manoeuvre("pull", amplitude_m=0.01)
    examiner = ScriptedExaminer(worth=lambda one: {slow: 0.6, quick: 0.4}.get(one, 0.0))
    operator = ScriptedOperator()
    investigate(laboratory, operator, Rules(offered=(slow, quick)), examiner)
    assert [one.manoeuvre for one in operator.proposals[1:]] == [quick, slow]


@given(force=st.floats(0.0, 40.0), torque=st.floats(0.0, 4.0))
def test_what_is_foreseen_to_come_near_a_limit_is_forbidden(force: float, torque: float) -> None:
    bounds = Bounds(share_of_limits=0.8)
    beyond = force > 0.8 * RIG.limits.force_n or torque > 0.8 * RIG.limits.torque_nm
    assert bool(forbidden_by_load(Foresight((), force, torque), RIG, bounds)) is beyond


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_load_that_cannot_be_foreseen_is_forbidden(value: float) -> None:
    assert forbidden_by_load(Foresight((), value, 0.0), RIG, Bounds())


@pytest.mark.parametrize(
    ("manoeuvre", "why"),
    [
        (Manoeuvre("pull", amplitude_m=0.04, steps=20, return_steps=20), "leave the workspace"),
        (Manoeuvre("pull", amplitude_m=0.02, steps=2), "choose shorter steps"),
        (Manoeuvre("pull", amplitude_m=0.01, speed_m_s=0.1), "choose a slower one"),
        (replace(FAR, amplitude_m=0.025), "stretch the tissue by 28 %"),
    ],
)
def test_what_leaves_the_reach_is_no_candidate_and_says_why(manoeuvre: Manoeuvre, why: str) -> None:
    assert why in forbidden_by_reach(manoeuvre, RIG, Bounds())
    laboratory = BenchLaboratory(Path("nowhere"))
    assert candidates(laboratory, [manoeuvre, FAR], Journal("x"), Bounds(), 600.0) == [FAR]


@pytest.mark.parametrize(("stiffest_pa", "way_m"), [(1e5, 0.006), (2e5, 0.004), (4e5, 0.002), (1e7, None)])
def test_the_stiffer_tissue_may_be_the_shorter_the_first_pull(
    stiffest_pa: float, way_m: float | None
) -> None:
    laboratory = BenchLaboratory(Path("nowhere"))
    found = openings(laboratory, OPENING, Journal("x"), Bounds(stiffest_pa=stiffest_pa))
    assert next((one.manoeuvre.amplitude_m for one in found), None) == way_m


def test_once_the_tissue_is_out_of_the_jaws_nothing_that_strains_it_is_proposed() -> None:
    laboratory = BenchLaboratory(Path("nowhere"))
    left = candidates(laboratory, OFFERED, Journal("x", (entry(POSES),)), Bounds(), 600.0)
    assert left
    assert not any(one.strains for one in left)


@pytest.mark.parametrize(("done_m", "next_m"), [(0.004, 0.012), (0.006, 0.016), (0.01, 0.02)])
def test_no_pull_is_more_than_three_times_as_far_as_the_farthest_so_far(done_m: float, next_m: float) -> None:
    laboratory = BenchLaboratory(Path("nowhere"))
    journal = Journal("x", (entry(Manoeuvre("pull", amplitude_m=done_m)),))
    left = candidates(laboratory, OFFERED, journal, Bounds(), 600.0)
    assert max(one.amplitude_m for one in left if one.direction == (1.0, 0.0, 0.0)) == next_m


def test_what_goes_farther_than_before_is_told_as_a_risk() -> None:
    laboratory = BenchLaboratory(Path("nowhere"))
    (first, *_) = openings(laboratory, OPENING, Journal("x"), Bounds())
    assert "farther than so far" in first.damages


@pytest.mark.parametrize("manoeuvre", OFFERED, ids=lambda one: one.name)
def test_every_manoeuvre_ends_where_it_began_and_takes_as_long_as_it_says(manoeuvre: Manoeuvre) -> None:
    trajectory = manoeuvre.trajectory()
    np.testing.assert_allclose(trajectory.steps[-1].T_rest_gripper.position, 0.0, atol=1e-9)
    assert manoeuvre.duration_s == pytest.approx(duration_s(trajectory) + 60.0 * len(manoeuvre.asks))
    farthest = max(np.linalg.norm(step.T_rest_gripper.position) for step in trajectory.steps)
    assert not manoeuvre.strains or farthest == pytest.approx(manoeuvre.amplitude_m)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"kind": "jump"}, "choose one of pull"),
        ({"amplitude_m": float("nan")}, "must be finite"),
        ({"direction": (1.0, 1.0, 0.0)}, "no unit vector"),
        ({"repetitions": 0}, "must be 1 at least"),
        ({"amplitude_m": 0.0}, "goes nowhere"),
    ],
)
def test_a_manoeuvre_that_cannot_be_is_refused(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        replace(FAR, **changes)


def test_names_of_what_is_offered_differ() -> None:
    names = [one.name for one in OFFERED]
    assert len(names) == len(set(names))


def test_a_journal_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / JOURNAL_FILE
    dropped = (Dropped(still(60.0), "the arm cannot"),)
    journal = Journal("P07", (entry(FAR), entry(still(20.0))), (POSES,), dropped).with_last(
        {"none": 1.0}, True
    )
    write_journal(journal, path)
    assert read_journal(path, "P07") == journal


@pytest.mark.parametrize(
    "damage",
    [
        lambda told: told.pop("entries"),
        lambda told: told.update(format="retraction-plan/1"),
        lambda told: told["entries"][0]["manoeuvre"].update(kind="jump"),
        lambda told: told["entries"][0].update(seconds="long"),
        lambda told: told.update(refused=[[1]]),
        lambda told: told.pop("dropped"),
        lambda told: told.update(dropped=[{"why": "no manoeuvre"}]),
        lambda told: told.update(dropped=[{"manoeuvre": {"kind": "jump"}, "why": "none such"}]),
    ],
)
def test_a_damaged_journal_is_told_in_one_line(
    tmp_path: Path, damage: Callable[[dict[str, Any]], object]
) -> None:
    path = tmp_path / JOURNAL_FILE
    write_journal(Journal("P07", (entry(FAR),)), path)
    told = json.loads(path.read_text(encoding="utf-8"))
    damage(told)
    path.write_text(json.dumps(told), encoding="utf-8")
    with pytest.raises(SessionError, match="is no journal of an investigation"):
        read_journal(path, "P07")


def test_a_journal_of_another_specimen_is_not_gone_on_with(tmp_path: Path) -> None:
    write_journal(Journal("P07"), tmp_path / JOURNAL_FILE)
    with pytest.raises(SessionError, match="is of specimen 'P07'"):
        read_journal(tmp_path / JOURNAL_FILE, "P08")


@pytest.mark.parametrize(
    ("typed", "answer"),
    [(["y"], "do it"), (["what?", "N"], "not this one"), (["s"], "stop"), ([], "stop")],
)
def test_the_operator_is_shown_why_and_what_is_asked_and_says_one_letter(
    typed: list[str], answer: str
) -> None:
    shown: list[str] = []
    lines = iter(typed)

    def read(prompt: str) -> str:
        try:
            return next(lines)
        except StopIteration:
            raise EOFError from None

    proposal = Proposal(POSES, 0.4, "parts tool_weight and none best", "a risk")
    assert AtTerminal(read, ask=True, say=shown.append).asked(proposal, Journal("P07")) == answer
    text = "\n".join(shown)
    assert "parts tool_weight and none best" in text
    assert "take the tissue out of the jaws" in text
    assert "risk: a risk" in text


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["lab.toml", "--yes"], "nobody would be asked before a real robot moves"),
        (["virtual"], "standard input is no terminal"),
        (["virtual", "--yes", "--budget", "0"], "budget_s must be positive"),
        (["virtual", "--yes", "--stretch", "300"], "are shares from 0 to 1"),
    ],
)
def test_what_cannot_be_is_refused_before_any_device_is_opened(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["investigate", *arguments]) == 2
    complaint = capsys.readouterr().err
    assert told in complaint
    assert complaint.count("\n") == 1


def test_the_page_tells_the_path(laboratory: BenchLaboratory, tmp_path: Path) -> None:
    operator = ScriptedOperator(lambda one: "not this one" if any(one.manoeuvre.turn_rad) else "do it")
    outcome = investigate(laboratory, operator)
    write_report(outcome, tmp_path / "page.html", {"rig": "lab.toml"})
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    for one in outcome.journal.entries:
        assert one.manoeuvre.words in text
    assert "Dropped" not in text
    assert "gripper_slip: 99 %" in text
    assert "one answer is sure" in text


@pytest.mark.parametrize("refusal", REFUSALS, ids=lambda one: type(one).__name__)
def test_page_and_json_tell_what_was_dropped_and_why(
    laboratory: BenchLaboratory, tmp_path: Path, refusal: Exception
) -> None:
    laboratory.fails[2] = refusal
    outcome = investigate(laboratory)
    (dropped,) = outcome.journal.dropped
    write_report(outcome, tmp_path / "page.html", {"rig": "lab.toml"})
    assert f"{dropped.manoeuvre.words}: {refusal}" in (tmp_path / "page.html").read_text(encoding="utf-8")
    assert outcome_as_json(outcome)["dropped"] == [
        {"manoeuvre": dropped.manoeuvre.words, "why": str(refusal)}
    ]


def test_a_refusal_is_one_line_at_the_terminal() -> None:
    shown: list[str] = []
    AtTerminal(input, ask=True, say=shown.append).told(Dropped(FAR, "step 3 is beyond the reach of the arm"))
    assert shown == [f"Dropped: {FAR.words}: step 3 is beyond the reach of the arm"]
