"""The fault campaign: what its checks catch, how runs are chosen and kept, and one run of it."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daq.cli import main
from daq.errors import DaqError
from daq.faults.bench import TruePath
from daq.faults.campaign import fault_of, keep, named, read_results, single_run
from daq.faults.catalogue import FAULTS
from daq.faults.checks import judge
from daq.faults.fault import Fault
from daq.faults.table import complaints, rows, text
from daq.faults.trial import Outcome, moved_for_s, nominal_s, way_m
from daq.virtual_rig.layout import REST_TOOL
from estimator.errors import InputError

HELD, SAMPLES, MARKED, TOLD, NEXT = (
    "held in time, or goes on",
    "acknowledged samples there",
    "trial marked",
    "reason in one line",
    "next session",
)
STREAMS = ("force", "robot", "camera/left", "camera/right")


def called(label: str) -> Fault:
    (fault,) = named([label])
    return fault


SATURATED, LOSS, EDITED, LEAP = map(
    called, ("saturated", "force sensor: 5 %", "rig file", "robot jumps ahead")
)
GOOD = Outcome(
    fault=SATURATED.label,
    seed=1,
    run=0,
    instant_s=1.5,
    moved_for_s=0.02,
    way_m=0.004,
    acknowledged=dict.fromkeys(STREAMS, 100),
    found=dict.fromkeys(STREAMS, 101),
    told="the force sensor is saturated or faulty (status 0x80020000); the stop was sent 1 ms after that was told",
    state="sealed",
    problems=("the force sensor is saturated or faulty",),
    resets=dict.fromkeys(STREAMS, 0),
    late_s=dict.fromkeys(STREAMS, 0.002),
    next_failure="",
    load=1.0,
    seconds=9.0,
)
WENT_ON = replace(
    GOOD,
    fault=LOSS.label,
    moved_for_s=2.0,
    way_m=0.009,
    told="",
    problems=("force sensor: 12 samples lost on the way",),
)
UNTOUCHED = replace(WENT_ON, fault=EDITED.label, problems=())
LEAPT = replace(
    WENT_ON,
    fault=LEAP.label,
    problems=("robot: its clock jumped or began anew 1 times",),
    resets={"robot": 1, "force": 0},
)


@pytest.mark.parametrize(
    ("fault", "outcome"), [(SATURATED, GOOD), (LOSS, WENT_ON), (EDITED, UNTOUCHED), (LEAP, LEAPT)]
)
def test_what_ended_as_it_must_passes_every_check(fault: Fault, outcome: Outcome) -> None:
    assert not [complaint for complaint in judge(fault, outcome).values() if complaint]


@pytest.mark.parametrize(
    ("fault", "outcome", "check", "words"),
    [
        (SATURATED, replace(GOOD, moved_for_s=0.5), HELD, "moved for 0.500 s, the bar is 0.3 s"),
        (LOSS, replace(WENT_ON, told="the force sensor has been silent"), HELD, "ended with"),
        (LOSS, replace(WENT_ON, way_m=0.006), HELD, "6.00 mm from rest instead of 9 mm"),
        (SATURATED, replace(GOOD, found=GOOD.found | {"robot": 98}), SAMPLES, "robot: 2 of 100 missing"),
        (SATURATED, replace(GOOD, found={}), SAMPLES, "camera/left: 100 of 100 missing"),
        (SATURATED, replace(GOOD, acknowledged={}), SAMPLES, "nothing was tested"),
        (
            SATURATED,
            replace(GOOD, acknowledged=GOOD.acknowledged | {"force": 0}),
            SAMPLES,
            "nothing was tested",
        ),
        (LEAP, replace(LEAPT, late_s={"robot": 0.4}), SAMPLES, "robot: instants off by 0.4 s"),
        (SATURATED, replace(GOOD, problems=()), MARKED, "not marked"),
        (EDITED, replace(UNTOUCHED, problems=("robot: 1 samples lost",)), MARKED, "marked for nothing"),
        (EDITED, replace(UNTOUCHED, state="recovered"), MARKED, "left in the state recovered"),
        (LOSS, replace(WENT_ON, resets={"force": 31}), MARKED, "began? anew: force"),
        (LEAP, replace(LEAPT, resets={}), MARKED, "begin anew: none"),
        (SATURATED, replace(GOOD, told=""), TOLD, "not one line"),
        (SATURATED, replace(GOOD, told=f"{GOOD.told}\nand more"), TOLD, "not one line"),
        (SATURATED, replace(GOOD, told="force of 742 N exceeds the limit of 15 N"), TOLD, "not the cause"),
        (LOSS, replace(WENT_ON, problems=("robot: 1 samples lost",)), TOLD, "not one line"),
        (SATURATED, replace(GOOD, next_failure="the robot is held"), NEXT, "the robot is held"),
    ],
)
def test_a_check_complains_of_what_is_wrong_and_of_nothing_else(
    fault: Fault, outcome: Outcome, check: str, words: str
) -> None:
    complained = {name: complaint for name, complaint in judge(fault, outcome).items() if complaint}
    assert list(complained) == [check]
    assert words.replace("began? ", "begin ") in complained[check]


def test_a_recording_that_was_cut_off_is_marked_by_its_state() -> None:
    killed = called("recorder killed")
    outcome = replace(
        GOOD,
        fault=killed.label,
        state="recording",
        problems=(),
        told="the acquisition process has died; its messages are above",
    )
    assert not any(judge(killed, outcome).values())


def moving_until(stop_ns: int) -> TruePath:
    """A tool that goes 1 mm/s from rest and stands from an instant on; a place every 4 ms."""
    times = np.arange(0, 2_000_000_000, 4_000_000)
    way = np.minimum(times, stop_ns) * 1e-12
    return TruePath(times, np.array(REST_TOOL.position) + np.outer(way, (1.0, 0.0, 0.0)))


def test_standstill_is_measured_on_the_true_path() -> None:
    path = moving_until(1_500_000_000)
    assert moved_for_s(path, 1_000_000_000) == pytest.approx(0.5, abs=0.03)
    assert moved_for_s(path, 1_600_000_000) == 0.0
    assert way_m(path) == pytest.approx(1.5e-3)


def test_noise_of_standing_is_no_motion() -> None:
    path = moving_until(0)
    noise = np.random.default_rng(0).normal(0.0, 1e-6, path.position.shape)
    assert moved_for_s(TruePath(path.time_ns, path.position + noise), 0) == 0.0


def test_every_fault_can_be_noticed_before_its_session_ends() -> None:
    assert len({fault.label for fault in FAULTS}) == len(FAULTS)
    for fault in FAULTS:
        assert 0 <= fault.from_s < nominal_s(fault.client.motion) - fault.tells_s - 1.0
        assert fault.right
        assert (fault.expected.within_s > 0) == (fault.expected.ends == "held")


def test_faults_come_in_turn_and_are_found_by_a_word() -> None:
    assert [fault_of(run, FAULTS) for run in range(len(FAULTS))] == list(FAULTS)
    assert fault_of(len(FAULTS) + 1, FAULTS) is FAULTS[1]
    assert {fault.label for fault in named(["window"])} == {"window killed", "window frozen"}
    with pytest.raises(DaqError, match="no fault is called 'flood'"):
        named(["flood"])


def test_a_campaign_that_was_cut_off_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "new" / "results.jsonl"
    keep(path, GOOD)
    with path.open("ab") as file:
        file.write(b'{"fault": "cut o')
    assert read_results(path, 1) == {0: GOOD}
    keep(path, replace(GOOD, run=1))
    keep(path, replace(GOOD, run=2, seed=8))
    assert read_results(path, 1) == {0: GOOD, 1: replace(GOOD, run=1)}
    path.write_text('{"other": 1}\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"results\.jsonl, line 1: has not the entries"):
        read_results(path, 1)


def test_the_table_tells_the_worst_and_every_complaint() -> None:
    late = replace(GOOD, run=26, moved_for_s=0.4, next_failure="the robot is held")
    found = rows([GOOD, late, WENT_ON], FAULTS)
    told = text(found)
    assert "| force sensor saturated | 2 | 1/2 | 2/2 | 2/2 | 2/2 | 1/2 | 0.40 s (0.3 s) |" in told
    assert "| force sensor: 5 % lost, 5 % overtaken | 1 | 1/1 | 1/1 | 1/1 | 1/1 | 1/1 | goes on |" in told
    assert [row.whole for row in found] == [True, False]
    lines = complaints([GOOD, late, WENT_ON], FAULTS)
    assert len(lines) == 2
    assert all(line.startswith("run 26 (force sensor saturated), ") for line in lines)


def test_a_check_that_does_not_apply_is_not_counted_as_held() -> None:
    assert "| rig file edited meanwhile | 1 | 1/1 | 1/1 | 1/1 | – | 1/1 | goes on |" in text(
        rows([UNTOUCHED], FAULTS)
    )


def test_the_command_lists_the_faults_and_what_is_right(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["faults", "--list", "--json", "--only", "disk"]) == 0
    (told,) = json.loads(capsys.readouterr().out)["faults"].values()
    assert "can be recovered" in told


@pytest.mark.parametrize(
    ("words", "mistake"),
    [(["--runs", "0"], "at least 1"), (["--run", "-1"], "at least 0"), (["--only", "flood"], "'flood'")],
)
def test_a_mistake_is_told_in_one_line(
    words: list[str], mistake: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["faults", *words]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert mistake in told.err
    assert told.err.count("\n") == 1


def test_a_finished_campaign_is_judged_from_its_results(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "results.jsonl"
    keep(path, replace(WENT_ON, fault=LOSS.label))
    command = ["faults", "--runs", "1", "--only", LOSS.label, "--out", str(path), "--json"]
    assert main(command) == 0
    assert json.loads(capsys.readouterr().out)["passed"]
    keep(path, replace(WENT_ON, told="held"))
    assert main(command) == 1
    assert "ended with: held" in json.loads(capsys.readouterr().out)["complaints"][0]


@pytest.mark.skipif(sys.platform != "linux", reason="the campaign needs Linux")
def test_a_run_breaks_a_session_and_finds_all_that_was_acknowledged() -> None:
    """How soon the robot stands is for the campaign to tell, which states the load of the machine."""
    outcome = single_run(1, 0, SATURATED)
    assert set(outcome.acknowledged) == set(STREAMS)
    assert all(0 < outcome.acknowledged[stream] <= outcome.found[stream] for stream in STREAMS)
    assert outcome.told
    assert outcome.problems
    assert outcome.state == "sealed"
