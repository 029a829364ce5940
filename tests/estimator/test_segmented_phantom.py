"""The surface of a segmented organ: closed, smooth, of the voxels' volume, where the voxels are."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.errors import InputError
from estimator.segmentation.isosurface import isosurface
from estimator.segmentation.label_map import LabelMap, Segment
from estimator.segmentation.parts import RegionLabel, Selection
from estimator.segmentation.phantom import SegmentedPhantom, segmented_phantom
from estimator.surfaces.queries import inside
from estimator.surfaces.surface import directed_edges

FloatArray = NDArray[np.float64]

ORGAN, CYST, TUMOUR = 1, 2, 3


def label_map(labels: NDArray[np.integer], T_lps_index: FloatArray | None = None) -> LabelMap:
    stated = np.diag([2.0, 2.0, 2.0, 1.0]) if T_lps_index is None else T_lps_index
    return LabelMap((labels,), stated)


def ellipsoid(
    shape: tuple[int, int, int] = (40, 36, 32),
    radii: tuple[float, float, float] = (15, 12, 10),
    centre: tuple[float, float, float] = (20, 18, 16),
) -> NDArray[np.uint8]:
    index = np.moveaxis(np.indices(shape), 0, -1)
    return (np.linalg.norm((index - centre) / np.array(radii), axis=-1) < 1).astype(np.uint8)


def phantom(
    labels: NDArray[np.integer], T_lps_index: FloatArray | None = None, **more: object
) -> SegmentedPhantom:
    return segmented_phantom(
        label_map(labels, T_lps_index), replace(Selection((ORGAN,)), **more), "organ.nii"
    )  # type: ignore[arg-type]


def centroid(found: SegmentedPhantom) -> FloatArray:
    """Of the tissue, m, by the divergence theorem."""
    start = found.surface.vertices[0]
    corners = found.surface.corners - start
    weights = np.einsum("tx,tx->t", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2])
    return np.asarray(start + (weights[:, None] * corners.sum(axis=1) / 4).sum(axis=0) / weights.sum())


def is_closed(found: SegmentedPhantom) -> bool:
    edges = directed_edges(found.surface.triangles)
    there, back = ({tuple(edge) for edge in some.tolist()} for some in (edges, edges[:, ::-1]))
    return len(there) == len(edges) and there == back


@given(
    seed=st.integers(0, 10_000),
    angles=st.lists(st.floats(-3, 3), min_size=3, max_size=3),
    spacing=st.lists(st.floats(0.5, 4.0), min_size=3, max_size=3),
    handed=st.sampled_from([1, -1]),
)
@settings(max_examples=12, deadline=None)
def test_any_lump_on_any_grid_has_a_closed_surface_of_its_volume_at_its_place(
    seed: int, angles: list[float], spacing: list[float], handed: int
) -> None:
    random = np.random.default_rng(seed)
    labels = ellipsoid(radii=tuple(random.uniform(7, 13, 3)))
    for _ in range(3):
        labels |= ellipsoid(radii=(6, 6, 6), centre=tuple(random.uniform(12, 22, 3)))
    T_lps_index = np.eye(4)
    T_lps_index[:3, :3] = Rotation.from_rotvec(angles).as_matrix() * np.array(spacing) * (1, 1, handed)
    T_lps_index[:3, 3] = random.uniform(-300, 300, 3)
    found = phantom(labels, T_lps_index)
    voxels = np.count_nonzero(labels) * np.prod(spacing) * 1e-9
    assert found.surface.volume_m3 == pytest.approx(voxels, rel=1e-3)
    assert is_closed(found)
    centres = 1e-3 * (np.argwhere(labels) @ T_lps_index[:3, :3].T + T_lps_index[:3, 3])
    within = inside(found.surface, centres)
    assert within.mean() > 0.95
    assert np.linalg.norm(centroid(found) - centres.mean(axis=0)) < 0.1e-3 * max(spacing)


def test_the_surface_of_a_ball_is_that_of_the_ball() -> None:
    found = phantom(ellipsoid(radii=(12.3, 12.3, 12.3), shape=(40, 40, 40), centre=(20, 20, 20)))
    radii = np.linalg.norm(found.surface.vertices - 0.040, axis=1)
    off = radii - 2 * 12.3e-3
    assert np.abs(off).max() < 1e-3  # half a voxel
    assert np.sqrt(np.mean(off**2)) < 0.3e-3


def test_thin_slices_and_thick_ones_give_the_same_organ() -> None:
    fine = phantom(ellipsoid((40, 36, 64), (15, 12, 20), (20, 18, 32)), np.diag([1.0, 1.0, 1.0, 1.0]))
    thick = phantom(ellipsoid((40, 36, 16), (15, 12, 5), (20, 18, 8)), np.diag([1.0, 1.0, 4.0, 1.0]))
    assert thick.surface.volume_m3 == pytest.approx(fine.surface.volume_m3, rel=0.03)
    assert thick.surface.bounds == pytest.approx(fine.surface.bounds, abs=2e-3)


def test_a_cyst_is_a_cavity_and_a_tumour_a_region_of_their_volumes() -> None:
    labels = ellipsoid()
    labels[ellipsoid(radii=(4, 4, 4), centre=(14, 18, 16)) == 1] = CYST
    labels[ellipsoid(radii=(5, 5, 5), centre=(25, 18, 16)) == 1] = TUMOUR
    found = phantom(labels, cavities=(CYST,), regions=(RegionLabel("tumour", TUMOUR, 2.5),))
    of = {label: np.count_nonzero(labels == label) * 8e-9 for label in (ORGAN, CYST, TUMOUR)}
    assert found.surface.volume_m3 == pytest.approx(of[ORGAN] + of[TUMOUR], rel=1e-3)
    assert found.regions["tumour"].volume_m3 == pytest.approx(of[TUMOUR], rel=1e-3)
    assert found.cavities == 1
    assert found.modulus_ratios == {"tumour": 2.5}
    assert inside(found.surface, 2e-3 * np.array([[14, 18, 16], [25, 18, 16], [20, 18, 16]])).tolist() == [
        False,
        True,
        True,
    ]


def test_a_label_at_the_border_of_the_image_is_closed_flat_and_told() -> None:
    labels = ellipsoid(centre=(20, 18, 4))
    found = phantom(labels)
    assert is_closed(found)
    assert found.surface.volume_m3 == pytest.approx(np.count_nonzero(labels) * 8e-9, rel=1e-3)
    assert found.surface.vertices[:, 2].min() == pytest.approx(-1e-3, abs=0.6e-3)
    assert "reaches the border of the image (first k), where it is cut off flat" in found.remarks


def test_an_organ_in_pieces_is_refused_or_its_largest_taken() -> None:
    labels = ellipsoid(radii=(8, 8, 8), centre=(10, 18, 16)) | ellipsoid(radii=(5, 5, 5), centre=(30, 18, 16))
    with pytest.raises(
        InputError, match=r"organ.nii: the organ is in 2 pieces of .* cm3, .* cm3; .*--largest"
    ):
        phantom(labels)
    found = phantom(labels, largest=True)
    assert found.surface.bounds[1, 0] < 2e-3 * 20
    assert any(remark.startswith("left out 1 piece of") for remark in found.remarks)


def test_specks_are_dropped_and_pinholes_filled() -> None:
    labels = ellipsoid()
    labels[20, 18, 16] = 0
    labels[1, 1, 1] = 1
    found = phantom(labels)
    assert found.cavities == 0
    assert len(found.remarks) == 2
    assert found.surface.volume_m3 == pytest.approx(np.count_nonzero(ellipsoid()) * 8e-9, rel=1e-3)


def test_a_hole_that_no_label_names_is_told_and_may_be_filled() -> None:
    labels = ellipsoid() - ellipsoid(radii=(4, 4, 4))
    assert phantom(labels).cavities == 1
    assert "no label names" in phantom(labels).remarks[0]
    assert phantom(labels, fill_holes=True).cavities == 0


def test_a_cavity_that_is_open_is_no_part_of_the_organ() -> None:
    labels = ellipsoid()
    labels[(ellipsoid(radii=(5, 5, 5), centre=(20, 18, 25)) == 1) & (labels == 1)] = CYST
    found = phantom(labels, cavities=(CYST,))
    assert found.cavities == 0
    assert found.surface.volume_m3 == pytest.approx(np.count_nonzero(labels == ORGAN) * 8e-9, rel=1e-3)


def test_an_organ_of_a_slice_is_refused_or_of_its_volume() -> None:
    plate = np.zeros((30, 30, 5), np.uint8)
    plate[5:25, 5:25, 2] = 1
    found = phantom(plate)
    assert found.surface.volume_m3 == pytest.approx(400 * 8e-9, rel=0.01)
    assert is_closed(found)


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"organ": (9,)}, "has no voxel of label 9; it holds 1"),
        ({"organ": ("liver",)}, "has no voxel of label liver; it holds 1"),
        ({"cavities": (1,)}, "label 1 is named twice"),
        ({"regions": (RegionLabel("a", 1, 2.0),)}, "label 1 is named twice"),
    ],
)
def test_labels_that_cannot_be_are_refused(more: dict[str, object], told: str) -> None:
    with pytest.raises(InputError, match=f"organ.nii: {told}"):
        phantom(ellipsoid(), **more)


def test_a_region_beside_the_organ_joins_it() -> None:
    """A tumour that no other tissue surrounds is tissue all the same."""
    labels = ellipsoid()
    labels[20:, :, :][labels[20:, :, :] == 1] = TUMOUR
    found = phantom(labels, regions=(RegionLabel("tumour", TUMOUR, 3.0),))
    assert found.surface.volume_m3 == pytest.approx(np.count_nonzero(labels) * 8e-9, rel=1e-3)


def test_a_large_image_is_coarsened_in_place() -> None:
    labels = np.zeros((640, 20, 20), np.uint8)
    labels[10:630, 5:15, 6:14] = 1
    found = segmented_phantom(label_map(labels, np.diag([0.5, 2.0, 2.0, 1.0])), Selection((1,)), "rod")
    assert found.surface.volume_m3 == pytest.approx(620 * 80 * 2e-9, rel=1e-3)
    off_in_voxels = 1e3 * (centroid(found) - (0.15975, 0.019, 0.019)) / (0.5, 2.0, 2.0)
    assert np.abs(off_in_voxels).max() < 0.15  # of the image's; taken for another centre, it would be a half


def test_segments_are_found_by_name() -> None:
    labels = LabelMap((ellipsoid(),), np.diag([2.0, 2.0, 2.0, 1.0]), (Segment("liver", 1),))
    assert segmented_phantom(labels, Selection(("liver",)), "organ.nii").cavities == 0


@given(st.integers(0, 10_000), st.floats(0.3, 0.7))
@settings(max_examples=20, deadline=None)
def test_a_level_of_any_field_is_a_closed_surface_around_what_is_above(seed: int, level: float) -> None:
    field = np.pad(np.random.default_rng(seed).random((5, 6, 7), dtype=np.float32), 1)
    found = isosurface(field, level)
    edges = directed_edges(found.triangles)
    there = {tuple(edge) for edge in edges.tolist()}
    assert len(there) == len(edges)
    assert there == {(b, a) for a, b in there}
    assert 0 < found.volume < field.size
