"""What a soak makes of its seconds: a file that has each at once, and what grew."""

import csv
from dataclasses import replace
from pathlib import Path

import pytest

from gui.soak.log import SoakLog
from gui.soak.meter import Resources, Second
from gui.soak.plot import plot_soak
from gui.soak.result import SoakResult, images_shown_per_s
from gui.soak.series import series_of

SECOND = Second(
    time_s=1.0,
    duration_s=1.0,
    window=Resources(300.0, 17, 36),
    recorder=Resources(100.0, 20, 15),
    window_late_s=0.03,
    recorder_late_s=0.01,
    block_s=0.02,
    work_s=0.01,
    blocks=0,
    telemetry=30,
    repaints=600,
    images={"left": 30, "right": 30},
    received={"camera/left": 30, "camera/right": 30, "force": 7000},
)
STEADY = [replace(SECOND, time_s=float(number)) for number in range(1, 101)]


def result_of(seconds: list[Second], minutes: float = 100.0) -> SoakResult:
    return SoakResult(
        minutes=minutes,
        wanted_minutes=100.0,
        series=series_of(seconds),
        sessions=3,
        troubles=(),
        longest_block_s=0.02,
        longest_work_s=0.01,
        blocks=0,
        telemetry_per_s=30.0,
        images_per_s={"left": 30.0, "right": 30.0},
        repaints=60_000,
        cpu_share=0.3,
        load_average=1.0,
        received_per_s={"camera/left": 30.0, "camera/right": 30.0},
    )


def failed(result: SoakResult) -> list[str]:
    return [bar for bar, held in result.bars.items() if not held]


def test_what_stays_as_it_is_passes() -> None:
    result = result_of(STEADY)
    assert result.passed
    assert "GROWS" not in str(result)
    assert result.as_json()["series"]["memory of the window"]["usual"] == (300.0,) * 10


@pytest.mark.parametrize(
    ("name", "grown"),
    [
        ("memory of the window", {"window": Resources(360.0, 17, 36)}),
        ("memory of the recorder", {"recorder": Resources(160.0, 20, 15)}),
        ("threads of the recorder", {"recorder": Resources(100.0, 30, 15)}),
        ("handles of the window", {"window": Resources(300.0, 17, 50)}),
        ("latency of the window", {"window_late_s": 0.2}),
        ("latency of the recorder", {"recorder_late_s": 0.2}),
    ],
)
def test_what_is_more_at_the_end_than_at_the_beginning_is_named(name: str, grown: dict[str, object]) -> None:
    seconds = [*STEADY[:50], *(replace(second, **grown) for second in STEADY[50:])]  # type: ignore[arg-type]
    result = result_of(seconds)
    assert [one.quantity.name for one in result.series if not one.flat] == [name]
    assert failed(result) == ["memory, threads, handles and latencies are flat"]
    (line,) = [line for line in str(result).splitlines() if "GROWS" in line]
    assert line.startswith(name)


def test_a_peak_that_passes_is_no_growth() -> None:
    peak = replace(SECOND, window=Resources(900.0, 40, 90), window_late_s=2.0)
    assert result_of([*STEADY[:50], peak, *STEADY[50:]]).passed


def test_an_interrupted_run_has_not_passed() -> None:
    assert failed(result_of(STEADY, minutes=40.0)) == ["measured for 100 min"]


def test_a_recorder_that_tells_nothing_is_not_flat() -> None:
    silent = [replace(second, window_late_s=float("nan")) for second in STEADY[50:]]
    grown = [one.quantity.name for one in series_of([*STEADY[:50], *silent]) if not one.flat]
    assert grown == ["latency of the window"]


def test_what_a_system_does_not_tell_is_not_called_flat() -> None:
    untold = [replace(second, window=Resources(), recorder=Resources()) for second in STEADY]
    assert failed(result_of(untold)) == ["memory, threads, handles and latencies are flat"]


def test_while_a_session_is_sealed_no_image_is_missed() -> None:
    sealing = replace(SECOND, recorder_late_s=float("nan"), images={})
    assert images_shown_per_s([*STEADY[:20], *[sealing] * 50]) == {"left": 30.0, "right": 30.0}


def test_every_second_is_in_the_file_as_soon_as_it_was_measured(tmp_path: Path) -> None:
    with SoakLog(tmp_path / "seconds.csv") as log:
        for count, second in enumerate(STEADY[:3], start=1):
            log.add(second)
            with (tmp_path / "seconds.csv").open(newline="") as file:
                rows = list(csv.DictReader(file))
            assert len(rows) == count
    assert rows[-1]["time_s"] == "3.0"
    assert (rows[-1]["recorder_handles"], rows[-1]["received_force"]) == ("15", "7000")


def test_the_picture_shows_a_run_of_a_few_seconds_too(tmp_path: Path) -> None:
    plot_soak(STEADY[:2], tmp_path / "soak.png")
    assert (tmp_path / "soak.png").stat().st_size > 10_000
