"""``retract calibrate`` with stored views: what is paired, what is left out, and what is said about it."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import pytest

from daq.cli import main
from daq.rig import write_rig
from daq.virtual_rig.layout import Addresses, rig_description
from daq.virtual_rig.operator import BOARD, board_pose
from daq.virtual_rig.rendering.board_scene import BoardScene
from daq.virtual_rig.rendering.scene import flea2_pair

VIEWS = 18


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Images of a board as OpenCV printed it before 4.6."""
    folder = tmp_path_factory.mktemp("views")
    cameras = flea2_pair()
    board = replace(BOARD, legacy_pattern=True)
    for side, camera in (("left", cameras.left), ("right", cameras.right)):
        scene = BoardScene(camera, board)
        for number in range(VIEWS):
            image = scene.render(board_pose(number), number)
            assert cv2.imwrite(str(folder / f"{side}_{number:04d}.png"), image)
    return folder


@pytest.fixture
def calibrated(
    tmp_path: Path, views: Path, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, dict[str, float], str]]:
    """Calibrate the pair from some of the views; what came out, the figures by name, and what was said."""
    flea2_pair().save(tmp_path / "stereo.toml")
    described = rig_description(
        Addresses(1, 2, 3, 4, 5, 6, ("tcp://a:1", "tcp://b:2")), tmp_path / "stereo.toml"
    )
    write_rig(described, tmp_path / "rig.toml")

    def calibrate(*lost: str, swapped: tuple[int, int] | None = None) -> tuple[int, dict[str, float], str]:
        given = tmp_path / "given"
        shutil.copytree(views, given)
        for name in lost:
            (given / name).unlink()
        if swapped is not None:
            first, second = (given / f"right_{number:04d}.png" for number in swapped)
            first.rename(given / "aside")
            second.rename(first)
            (given / "aside").rename(second)
        command = ["calibrate", "stereo", str(tmp_path / "rig.toml"), "--images", str(given)]
        status = main([*command, "--output", str(tmp_path / "kept"), "--json"])
        said = capsys.readouterr()
        figures = json.loads(said.out)["figures"] if said.out else []
        return status, {figure["name"]: figure["value"] for figure in figures}, said.err

    return calibrate


def test_a_lost_view_on_each_side_costs_two_pairs_and_no_more(
    calibrated: Callable[..., tuple[int, dict[str, float], str]],
) -> None:
    status, figures, said = calibrated("left_0003.png", "right_0009.png")
    assert status == 0, said
    assert figures["views"] == VIEWS - 2
    assert figures["baseline"] == pytest.approx(flea2_pair().baseline_m, rel=1e-3)
    assert "without a partner, left out: left_0009.png, right_0003.png" in said
    assert "taken as with --legacy-pattern" in said
    assert "refining both cameras and all views together" in said


def test_a_pair_of_two_moments_is_left_out_by_name(
    calibrated: Callable[..., tuple[int, dict[str, float], str]],
) -> None:
    status, figures, said = calibrated(swapped=(5, 6))
    assert status == 0, said
    assert figures["pairs of views left out, as they disagree"] == 2
    assert figures["baseline"] == pytest.approx(flea2_pair().baseline_m, rel=1e-3)


def test_without_the_first_view_the_tissue_frame_is_not_known(
    calibrated: Callable[..., tuple[int, dict[str, float], str]],
) -> None:
    status, figures, said = calibrated("left_0000.png")
    assert status == 1
    assert figures["views of the board at its known place"] == 0
    assert "in the first view the board lies on the phantom" in said
