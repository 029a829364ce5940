"""The outline of a body from above, and of what is held of it."""

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray
from organ_cases import CYST, LENGTH_M, TUMOUR, ball, organ_meshed_anew
from retraction_cases import SMALL_BLOCK

from estimator.experiment import Box, Experiment
from estimator.report.drawing.silhouette import extent_mm, held_from_above, shadow_edge, silhouette
from estimator.surfaces.repair import closed_surface
from estimator.surfaces.surface import Surface

FloatArray = NDArray[np.float64]

ANGLE = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], dtype=float)
CAP = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5)])


@pytest.fixture(scope="module")
def pull(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Experiment]:
    with organ_meshed_anew(tmp_path_factory) as planned:
        yield planned


def prism(outline: FloatArray, cap: NDArray[np.int64]) -> Surface:
    count = len(outline)
    points = np.vstack([np.column_stack([outline, np.full(count, z)]) for z in (0.0, 0.5)])
    now = np.arange(count)
    after = np.roll(now, -1)
    walls = [
        np.stack([now, after, after + count], axis=1),
        np.stack([now, after + count, now + count], axis=1),
    ]
    return closed_surface(points, np.vstack([cap + count, cap[:, ::-1], *walls]), "prism")


def area_within(pieces: FloatArray) -> float:
    (x0, y0), (x1, y1) = pieces.transpose(1, 2, 0)
    return float(np.sum(x0 * y1 - x1 * y0) / 2)


def test_the_outline_of_a_block_is_its_rectangle() -> None:
    size = 1e3 * np.array(SMALL_BLOCK.phantom.size_m)
    pieces = silhouette(SMALL_BLOCK.phantom)
    assert area_within(pieces) == pytest.approx(size[0] * size[1])
    assert np.ptp(extent_mm(SMALL_BLOCK.phantom), axis=0) == pytest.approx(size)


def test_the_outline_of_an_angle_follows_its_notch() -> None:
    pieces = shadow_edge(prism(ANGLE, CAP))
    assert area_within(pieces) == pytest.approx(3.0)
    lengths = np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1)
    assert lengths.sum() == pytest.approx(8.0)


def test_the_outline_of_a_ball_is_its_equator() -> None:
    pieces = shadow_edge(ball(TUMOUR, 0.012))
    assert np.linalg.norm(pieces - TUMOUR[:2], axis=-1) == pytest.approx(0.012, abs=5e-4)
    assert area_within(pieces) == pytest.approx(np.pi * 0.012**2, rel=0.05)


def test_an_organ_is_drawn_as_itself_and_not_as_its_bounding_box(pull: Experiment) -> None:
    pieces = silhouette(pull.phantom)
    width, depth, _ = np.ptp(extent_mm(pull.phantom), axis=0)
    assert width == pytest.approx(1e3 * LENGTH_M, abs=3)
    assert np.ptp(pieces.reshape(-1, 2), axis=0) == pytest.approx((width, depth), abs=1.0)
    assert 0.6 * width * depth < area_within(pieces) < 0.85 * width * depth
    from_cyst = np.linalg.norm(pieces - 1e3 * np.array(CYST[:2]), axis=-1)
    assert from_cyst.min() > 15


def test_a_box_holds_what_lies_in_it_of_an_organ(pull: Experiment) -> None:
    lower, upper = 1e-3 * extent_mm(pull.phantom)
    end = Box((-0.2, -0.2, -0.2), (-0.05, 0.2, 0.2))
    held = held_from_above(end, pull.phantom)
    assert (held[:, 0].min(), held[:, 0].max()) == pytest.approx((1e3 * lower[0], -50), abs=1.0)
    assert np.ptp(held[:, 1]) < 0.8 * 1e3 * (upper - lower)[1]


def test_a_box_holds_its_part_of_a_block() -> None:
    held = held_from_above(SMALL_BLOCK.grasp.box, SMALL_BLOCK.phantom)
    low, high = extent_mm(SMALL_BLOCK.phantom)[:, :2]
    assert ((held >= low) & (held <= high)).all()
