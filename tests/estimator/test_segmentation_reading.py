"""Where voxels lie, whichever format and library they come from."""

import gzip
import re
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from estimator.errors import InputError
from estimator.segmentation.label_map import LabelMap
from estimator.segmentation.reading import read_label_map
from tests.estimator.segmentation_files import FloatArray, write_by_simpleitk, write_nifti

TURNED = Rotation.from_euler("xyz", [0.3, -0.5, 0.9]).as_matrix()
SHEARED = np.array([[1.0, 0.2, 0.0], [0.0, np.sqrt(0.96), 0.1], [0.0, 0.0, np.sqrt(0.99)]])
DIRECTIONS = {
    "along the axes": np.eye(3),
    "turned": TURNED,
    "turned over": np.diag([-1.0, 1.0, 1.0]),
    "axes exchanged": np.array([[0.0, 1, 0], [0, 0, -1], [1, 0, 0]]),
    "turned and mirrored": TURNED @ np.diag([1.0, -1.0, 1.0]),
}
RAS = np.diag([-1.0, -1.0, 1.0, 1.0])
VOXEL = (1, 2, 3)


def geometry(direction: FloatArray) -> FloatArray:
    """Voxels of 0.7 x 0.8 x 5 mm with an odd origin."""
    T_lps_index = np.eye(4)
    T_lps_index[:3, :3] = direction * (0.7, 0.8, 5.0)
    T_lps_index[:3, 3] = (-30.5, 12.25, 100.0)
    return T_lps_index


def one_voxel(label: int = 7) -> np.ndarray:
    labels = np.zeros((6, 5, 4), np.uint8)
    labels[VOXEL] = label
    return labels


def place_of(found: LabelMap, label: int | str = 7) -> FloatArray:
    """The centre of the one voxel of a label, LPS, mm."""
    (index,) = np.argwhere(found.mask(label, "file"))
    return np.asarray((found.T_lps_index @ [*index, 1])[:3])


@pytest.mark.parametrize("name", ["a.nii", "a.nii.gz", "a.nrrd", "a.nhdr", "a.mha", "a.mhd"])
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_a_voxel_lies_where_the_library_that_wrote_it_says(tmp_path: Path, name: str, direction: str) -> None:
    import SimpleITK

    T_lps_index = geometry(DIRECTIONS[direction])
    write_by_simpleitk(one_voxel(), T_lps_index, tmp_path / name)
    image = SimpleITK.ReadImage(str(tmp_path / name))
    found = read_label_map(tmp_path / name)
    assert place_of(found) == pytest.approx(image.TransformIndexToPhysicalPoint(VOXEL), abs=1e-4)
    assert place_of(found) == pytest.approx((T_lps_index @ [*VOXEL, 1])[:3], abs=1e-4)
    assert found.spacing_mm == pytest.approx([0.7, 0.8, 5.0], rel=1e-6)
    assert found.remarks == ()


@pytest.mark.parametrize("name", ["a.nrrd", "a.mha"])
def test_a_sheared_grid_stays_sheared(tmp_path: Path, name: str) -> None:
    T_lps_index = geometry(SHEARED)
    write_by_simpleitk(one_voxel(), T_lps_index, tmp_path / name)
    assert place_of(read_label_map(tmp_path / name)) == pytest.approx(
        (T_lps_index @ [*VOXEL, 1])[:3], abs=1e-9
    )


def test_a_sheared_sform_stays_sheared(tmp_path: Path) -> None:
    T_lps_index = geometry(SHEARED)
    write_nifti(one_voxel(), tmp_path / "a.nii", RAS @ T_lps_index)
    assert place_of(read_label_map(tmp_path / "a.nii")) == pytest.approx(
        (T_lps_index @ [*VOXEL, 1])[:3], abs=1e-4
    )


@given(
    st.lists(st.floats(-np.pi, np.pi), min_size=3, max_size=3),
    st.lists(st.floats(0.1, 8.0), min_size=3, max_size=3),
    st.lists(st.floats(-500, 500), min_size=3, max_size=3),
    st.sampled_from([1, -1]),
)
@settings(max_examples=25, deadline=None)
def test_any_grid_in_metaimage_and_nrrd(
    tmp_path_factory: pytest.TempPathFactory,
    angles: list[float],
    spacing: list[float],
    origin: list[float],
    handed: int,
) -> None:
    T_lps_index = np.eye(4)
    T_lps_index[:3, :3] = Rotation.from_rotvec(angles).as_matrix() * np.array(spacing) * (1, 1, handed)
    T_lps_index[:3, 3] = origin
    folder = tmp_path_factory.mktemp("grid")
    for name in ("a.mha", "a.nrrd"):
        write_by_simpleitk(one_voxel(), T_lps_index, folder / name)
        assert place_of(read_label_map(folder / name)) == pytest.approx(
            (T_lps_index @ [*VOXEL, 1])[:3], abs=1e-6
        )


@pytest.mark.parametrize(("unit", "to_mm"), [(1, 1e3), (2, 1.0), (3, 1e-3)])
def test_nifti_in_metres_and_micrometres_is_in_millimetres_afterwards(
    tmp_path: Path, unit: int, to_mm: float
) -> None:
    T_lps_index = geometry(TURNED)
    stated = RAS @ T_lps_index
    stated[:3] /= to_mm
    write_nifti(one_voxel(), tmp_path / "a.nii", stated, unit=unit)
    found = read_label_map(tmp_path / "a.nii")
    assert place_of(found) == pytest.approx((T_lps_index @ [*VOXEL, 1])[:3], abs=1e-3)
    assert found.spacing_mm == pytest.approx([0.7, 0.8, 5.0], rel=1e-5)


def test_nifti_with_a_qform_alone_is_turned_by_its_quaternion(tmp_path: Path) -> None:
    write_nifti(one_voxel(), tmp_path / "a.nii", None, qform=(0, 0, 1, -50, 0, 4))
    assert place_of(read_label_map(tmp_path / "a.nii")) == pytest.approx([51.0, 2.0, 7.0])


def test_sform_and_qform_that_disagree_are_told(tmp_path: Path) -> None:
    shifted = np.eye(4)
    shifted[:3, 3] = (10, 20, 30)
    write_nifti(one_voxel(), tmp_path / "a.nii", shifted, qform=(0, 0, 0, -50, 0, 0))
    found = read_label_map(tmp_path / "a.nii")
    assert place_of(found) == pytest.approx([-11.0, -22.0, 33.0])
    assert re.search(
        r"its sform .* and qform .* put voxels up to 70 apart; the sform is taken", found.remarks[0]
    )


def test_nifti_of_two_streams_of_gzip_is_read_whole(tmp_path: Path) -> None:
    import nibabel

    nibabel.save(nibabel.Nifti1Image(one_voxel(), np.eye(4)), tmp_path / "a.nii")
    content = (tmp_path / "a.nii").read_bytes()
    (tmp_path / "a.nii.gz").write_bytes(gzip.compress(content[:400]) + gzip.compress(content[400:]))
    assert place_of(read_label_map(tmp_path / "a.nii.gz")) == pytest.approx([-1, -2, 3])


@pytest.mark.parametrize(
    ("space", "signs"),
    [
        ("left-posterior-superior", (1, 1, 1)),
        ("right-anterior-superior", (-1, -1, 1)),
        ("LAS", (1, -1, 1)),
    ],
)
def test_the_space_of_nrrd_says_which_way_its_axes_go(
    tmp_path: Path, space: str, signs: tuple[int, int, int]
) -> None:
    (tmp_path / "a.nrrd").write_bytes(nrrd_header(f"space: {space}") + one_voxel().tobytes(order="F"))
    found = read_label_map(tmp_path / "a.nrrd")
    assert place_of(found) == pytest.approx(np.multiply(signs, (10 + 2, 20 + 6, 30 + 12)))


def nrrd_header(space: str, encoding: str = "encoding: raw") -> bytes:
    lines = ["NRRD0004", "type: uchar", "dimension: 3", "sizes: 6 5 4", space, encoding]
    lines += [
        "space directions: (2,0,0) (0,3,0) (0,0,4)",
        "space origin: (10,20,30)",
        "kinds: domain domain domain",
    ]
    return ("\n".join(lines) + "\n\n").encode()


def test_the_centering_of_nrrd_does_not_move_its_origin(tmp_path: Path) -> None:
    for centring in ("cell", "node"):
        stated = f"centerings: {' '.join([centring] * 3)}\nkinds:".encode()
        header = nrrd_header("space: LPS").replace(b"kinds:", stated)
        (tmp_path / "a.nrrd").write_bytes(header + one_voxel().tobytes(order="F"))
        assert place_of(read_label_map(tmp_path / "a.nrrd")) == pytest.approx([12, 26, 42])


def test_segments_of_slicer_that_overlap_are_read_by_name(tmp_path: Path) -> None:
    labels = np.zeros((2, 6, 5, 4), np.uint8)
    labels[0, 1, 2, 3] = labels[1, 1, 2, 3] = labels[1, 4, 4, 0] = 1
    lines = [
        *("NRRD0004", "type: uchar", "dimension: 4", "space: left-posterior-superior", "sizes: 2 6 5 4"),
        *(
            "space directions: none (1,0,0) (0,1,0) (0,0,1)",
            "kinds: list domain domain domain",
            "encoding: raw",
        ),
        *("space origin: (0,0,0)", "Segment0_Name:=liver", "Segment0_LabelValue:=1", "Segment0_Layer:=0"),
        *("Segment1_Name:=tumour", "Segment1_LabelValue:=1", "Segment1_Layer:=1"),
    ]
    (tmp_path / "a.seg.nrrd").write_bytes(("\n".join(lines) + "\n\n").encode() + labels.tobytes(order="F"))
    found = read_label_map(tmp_path / "a.seg.nrrd")
    assert place_of(found, "liver") == pytest.approx(VOXEL)
    assert found.mask("tumour", "file").sum() == 2
    with pytest.raises(
        InputError, match=r"label 1 is in 2 segments that overlap; name one of 1 \(liver\), 1 \(tumour\)"
    ):
        found.mask(1, "file")


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("overlapping", [False, True])
def test_segments_of_dicom_lie_where_their_frames_say(
    tmp_path: Path, direction: str, overlapping: bool
) -> None:
    T_lps_index = geometry(DIRECTIONS[direction])
    liver, tumour = np.zeros((6, 5, 4), dtype=bool), np.zeros((6, 5, 4), dtype=bool)
    liver[VOXEL] = True
    tumour[4, 3, 1] = True
    if overlapping:
        tumour[VOXEL] = True
    from tests.estimator.dicom_seg_files import write_dicom_seg

    write_dicom_seg({"liver": liver, "tumour": tumour}, T_lps_index, tmp_path / "a.dcm")
    found = read_label_map(tmp_path / "a.dcm")
    assert place_of(found, "liver") == pytest.approx((T_lps_index @ [*VOXEL, 1])[:3], abs=1e-6)
    assert place_of(found, 1) == pytest.approx((T_lps_index @ [*VOXEL, 1])[:3], abs=1e-6)
    places = (
        np.argwhere(found.mask("tumour", "file")) @ found.T_lps_index[:3, :3].T + found.T_lps_index[:3, 3]
    )
    wanted = np.argwhere(tumour) @ T_lps_index[:3, :3].T + T_lps_index[:3, 3]
    assert np.sort(places, axis=0) == pytest.approx(np.sort(wanted, axis=0), abs=1e-6)


def refusals(folder: Path) -> dict[str, tuple[Path, str]]:
    import SimpleITK

    write_nifti(one_voxel(), folder / "unknown.nii", None)
    write_nifti(one_voxel(), folder / "whole.nii", np.eye(4))
    (folder / "short.nii").write_bytes((folder / "whole.nii").read_bytes()[:400])
    (folder / "cut.nii.gz").write_bytes(gzip.compress((folder / "whole.nii").read_bytes())[:-20])
    content = bytearray((folder / "whole.nii").read_bytes())
    content[344:348] = b"ni1\0"
    (folder / "pair.hdr").write_bytes(content)
    flat = np.eye(4)
    flat[:3, 2] = (1, 0, 0)
    write_nifti(one_voxel(), folder / "flat.nii", flat)
    (folder / "mins.nrrd").write_bytes(
        b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 6 5 4\naxis mins: 1 2 3\nspacings: 1 1 1\nencoding: raw\n\n"
        + bytes(120)
    )
    (folder / "handed.nrrd").write_bytes(nrrd_header("space: 3D-left-handed") + bytes(120))
    (folder / "lost.nhdr").write_bytes(nrrd_header("space: LPS", "encoding: raw\ndata file: lost.raw"))
    write_by_simpleitk(one_voxel(), np.eye(4), folder / "whole.mhd")
    (folder / "whole.raw").write_bytes(bytes(100))
    (folder / "words.mha").write_bytes(
        b"ObjectType = Image\nNDims = 3\nDimSize = a b c\nElementDataFile = LOCAL\n"
    )
    image = SimpleITK.GetImageFromArray(np.full((3, 3, 3), 0.37, np.float32))
    SimpleITK.WriteImage(image, str(folder / "probabilities.mha"))
    (folder / "text.txt").write_text("liver")
    return {
        "without orientation": (folder / "unknown.nii", "states neither sform nor qform, so nobody can tell"),
        "cut short": (folder / "short.nii", "cannot be read as NIfTI"),
        "packed and cut short": (folder / "cut.nii.gz", "is cut short"),
        "a pair": (folder / "pair.hdr", "is in Analyze, or one of a pair"),
        "two axes alike": (folder / "flat.nii", "two axes of its grid have the same direction"),
        "axis mins": (folder / "mins.nrrd", "has no space directions, only spacings, axis mins"),
        "left-handed": (folder / "handed.nrrd", "its space is 3d-left-handed, which may be mirrored"),
        "without its data": (folder / "lost.nhdr", "cannot be read as NRRD"),
        "data cut short": (folder / "whole.mhd", "there are 100 voxels of 120"),
        "no numbers": (folder / "words.mha", "its header is not as the format has it (invalid literal"),
        "probabilities": (folder / "probabilities.mha", "a voxel is 0.37; labels are whole numbers"),
        "another kind": (folder / "text.txt", "give a segmentation in NIfTI"),
        "absent": (folder / "nothing.nii", "there is no such file"),
    }


@pytest.mark.parametrize(
    "what",
    [
        "without orientation",
        "cut short",
        "packed and cut short",
        "a pair",
        "two axes alike",
        "axis mins",
        "left-handed",
        "without its data",
        "data cut short",
        "no numbers",
        "probabilities",
        "another kind",
        "absent",
    ],
)
def test_what_cannot_be_placed_is_refused_in_one_line(tmp_path: Path, what: str) -> None:
    file, told = refusals(tmp_path)[what]
    with pytest.raises(InputError) as refused:
        read_label_map(file)
    assert str(file) in str(refused.value)
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_absent_label_is_refused_with_those_that_there_are(tmp_path: Path) -> None:
    write_nifti(one_voxel(), tmp_path / "a.nii", np.eye(4))
    with pytest.raises(InputError, match="has no voxel of label 3; it holds 7"):
        read_label_map(tmp_path / "a.nii").mask(3, "a.nii")


def test_big_endian_nifti_is_read(tmp_path: Path) -> None:
    import nibabel

    image = nibabel.Nifti1Image(one_voxel().astype(">i2"), RAS, nibabel.Nifti1Header(endianness=">"))
    image.header.set_data_dtype(np.int16)
    nibabel.save(image, tmp_path / "a.nii")
    assert struct.unpack(">i", (tmp_path / "a.nii").read_bytes()[:4]) == (348,)
    assert place_of(read_label_map(tmp_path / "a.nii")) == pytest.approx(VOXEL)
