"""Images of two cameras are paired by what their names tell, whatever is missing on either side."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.calibration.view_names import pair_names
from daq.errors import CalibrationError

# how people name the images of the left and the right camera; {n} is the number of the moment
BY_NUMBER = {
    "left, right": ("left_{n:04d}.png", "right_{n:04d}.png"),
    "no zeros before": ("left{n}.png", "right{n}.png"),
    "zeros before on one side": ("left_{n:05d}.png", "right_{n}.png"),
    "capitals": ("Image_L_{n}.PNG", "Image_R_{n}.PNG"),
    "camel case": ("imageL{n:03d}.png", "imageR{n:03d}.png"),
    "the number first": ("{n:03d}-left.png", "{n:03d}-right.png"),
    "cam0, cam1": ("cam0_{n}.png", "cam1_{n}.png"),
    "camera_1, camera_2": ("day2_camera_1_{n}.png", "day2_camera_2_{n}.png"),
    "folders": ("left/{n:04d}.png", "right/{n:04d}.png"),
    "folders and names": ("left/left_{n:04d}.png", "right/right_{n:04d}.png"),
    "numbered folders": ("image_00/data/{n:010d}.png", "image_01/data/{n:010d}.png"),
    "serials beside": ("left_13021234_{n}.png", "right_13021235_{n}.png"),
    "a folder of both": ("left_and_right/left_{n}.png", "left_and_right/right_{n}.png"),
    "German": ("links_{n}.png", "rechts_{n}.png"),
    "French": ("gauche_{n:03d}.png", "droite_{n:03d}.png"),
    "Spanish": ("Izquierda/{n}.png", "Derecha/{n}.png"),
    "Italian, short": ("sx{n}.png", "dx{n}.png"),
    "Swedish": ("vänster_{n}.png", "höger_{n}.png"),
    "Danish": ("venstre_{n}.png", "højre_{n}.png"),
    "Polish": ("lewa_{n}.png", "prawa_{n}.png"),
    "Russian": ("левый_{n}.png", "правый_{n}.png"),
    "Japanese": ("左カメラ_{n}.png", "右カメラ_{n}.png"),
    "Korean": ("왼쪽_{n}.png", "오른쪽_{n}.png"),
    "a date before": ("2026-05-04_143210_left_{n:04d}.png", "2026-05-04_143210_right_{n:04d}.png"),
}
# the same with the time of the moment in s
BY_TIME = {
    "ns since 1970": lambda t: f"{1_680_000_000_000_000_000 + round(t * 1e9)}",
    "us since 1970": lambda t: f"{1_680_000_000_000_000 + round(t * 1e6)}",
    "ms since 1970": lambda t: f"{1_680_000_000_000 + round(t * 1e3)}",
    "s since 1970": lambda t: f"{1_680_000_000 + t:.6f}",
    "calendar": lambda t: (
        f"2026-05-04_14-{10 + int(t // 60):02d}-{int(t % 60):02d}.{round(t % 1 * 1e3) % 1000:03d}"
    ),
    "calendar without marks": lambda t: (
        f"20260504T14{10 + int(t // 60):02d}{int(t % 60):02d}_{int(t % 1 * 1e6):06d}"
    ),
    "s since the beginning": lambda t: f"{t:.3f}",
}

lost = st.sets(st.integers(0, 19), max_size=8)


@pytest.mark.parametrize("naming", BY_NUMBER.values(), ids=BY_NUMBER)
@given(lost_left=lost, lost_right=lost, seed=st.randoms(use_true_random=False))
def test_images_of_one_number_are_a_pair_whatever_is_lost(
    naming: tuple[str, str], lost_left: set[int], lost_right: set[int], seed: object
) -> None:
    left, right = naming
    names = [left.format(n=n) for n in range(20) if n not in lost_left]
    names += [right.format(n=n) for n in range(20) if n not in lost_right]
    seed.shuffle(names)  # type: ignore[attr-defined] # a random.Random
    found = pair_names(names)
    both = [n for n in range(20) if n not in lost_left | lost_right]
    assert found.pairs == tuple((left.format(n=n), right.format(n=n)) for n in both)
    single = [left.format(n=n) for n in lost_right - lost_left] + [
        right.format(n=n) for n in lost_left - lost_right
    ]
    assert sorted(found.alone) == sorted(single)
    first = min(n for n in range(20) if n not in lost_left & lost_right)
    assert found.first_paired == (first in both)


@pytest.mark.parametrize("written", BY_TIME.values(), ids=BY_TIME)
@given(lost_left=lost, lost_right=lost, late_ms=st.integers(-9, 9))
def test_images_of_nearly_one_time_are_a_pair(
    written: object, lost_left: set[int], lost_right: set[int], late_ms: int
) -> None:
    assert callable(written)
    left = [f"left_{written(3.0 + 0.5 * n)}.png" for n in range(20)]
    right = [f"right_{written(3.0 + 0.5 * n + late_ms * 1e-3)}.png" for n in range(20)]
    names = [name for n, name in enumerate(left) if n not in lost_left]
    names += [name for n, name in enumerate(right) if n not in lost_right]
    found = pair_names(names)
    assert found.pairs == tuple((left[n], right[n]) for n in range(20) if n not in lost_left | lost_right)
    assert "within 20 ms" in found.told_by


def test_times_further_apart_than_the_tolerance_are_no_pair() -> None:
    names = [f"left_{10 + n}.000.png" for n in range(5)] + [f"right_{10 + n}.050.png" for n in range(5)]
    with pytest.raises(CalibrationError, match=r"nearest two are 50 ms apart; give a larger --tolerance"):
        pair_names(names)
    assert len(pair_names(names, tolerance_s=0.05).pairs) == 5


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["a1.png", "b1.png", "a2.png", "b2.png"], "do not tell the left camera from the right one"),
        (["left_1.png", "left_2.png"], "do not tell the left camera from the right one"),
        (["left_1.png", "left_3.png", "right_2.png", "right_4.png"], "no image of one camera has the number"),
        (["left_1.png", "left_01.png", "right_1.png"], "have the same number"),
        (
            ["13021234_1.png", "13021235_1.png", "13021234_2.png", "13021235_2.png"],
            "--sides 13021234 13021235, the left one first",
        ),
    ],
)
def test_names_that_do_not_tell_are_refused_in_one_line(names: list[str], words: str) -> None:
    with pytest.raises(CalibrationError) as refused:
        pair_names(names)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_what_names_hold_can_be_said() -> None:
    names = [f"{serial}_{n}.png" for serial in (13021235, 13021234) for n in range(3)]
    found = pair_names(names, marks=("13021235", "13021234"))
    assert found.pairs == tuple((f"13021235_{n}.png", f"13021234_{n}.png") for n in range(3))
    with pytest.raises(CalibrationError, match="look at --sides"):
        pair_names(names, marks=("4711", "4712"))


def test_an_image_of_no_camera_is_left_out_by_name() -> None:
    found = pair_names(["left_1.png", "right_1.png", "the board.png", "left_and_right_2.png"])
    assert found.pairs == (("left_1.png", "right_1.png"),)
    assert found.alone == ("left_and_right_2.png", "the board.png")


# counted cameras that no word announces; told by most of the names going in pairs
COUNTED = {
    "infrared": ("rs_Infrared_1_{n}.png", "rs_Infrared_2_{n}.png"),
    "letters": ("camA_{n}.png", "camB_{n}.png"),
    "bare folders": ("0/{n}.png", "1/{n}.png"),
    "behind the number": ("view{n:03d}_0.png", "view{n:03d}_1.png"),
}


@pytest.mark.parametrize("naming", COUNTED.values(), ids=COUNTED)
@pytest.mark.parametrize(("lost_left", "lost_right"), [(set(), set()), ({3, 7}, {5}), (set(), {1, 2, 20})])
def test_counted_cameras_are_told_by_the_names_going_in_pairs(
    naming: tuple[str, str], lost_left: set[int], lost_right: set[int]
) -> None:
    left, right = naming
    names = [left.format(n=n) for n in range(1, 21) if n not in lost_left]
    names += [right.format(n=n) for n in range(1, 21) if n not in lost_right]
    found = pair_names(names)
    both = [n for n in range(1, 21) if n not in lost_left | lost_right]
    assert found.pairs == tuple((left.format(n=n), right.format(n=n)) for n in both)
    assert "is taken for the left camera" in found.told_by


@pytest.mark.parametrize(
    "names",
    [[f"img_{n}.png" for n in range(20)], ["a_1.png", "a_2.png"], ["x0_1.png", "x1_1.png", "x1_2.png"]],
)
def test_numbers_of_moments_are_not_taken_for_cameras(names: list[str]) -> None:
    with pytest.raises(CalibrationError, match=r"do not tell the left camera from the right one"):
        pair_names(names)


def test_marks_with_accents_are_found() -> None:
    names = [f"{side}_{n}.png" for side in ("Münze", "Küche") for n in range(4)]
    assert len(pair_names(names, ("Münze", "Küche")).pairs) == 4
