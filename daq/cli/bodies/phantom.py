"""``retract phantom``: the surface of a segmented organ, in the image's frame or in that of the tissue."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.files.atomic import appearing
from estimator.errors import InputError
from estimator.report.drawing.phantom_picture import draw_phantom
from estimator.segmentation.beads import spread_beads
from estimator.segmentation.label_map import RAS_TO_LPS, LabelMap
from estimator.segmentation.parts import Label, RegionLabel, Selection
from estimator.segmentation.phantom import SegmentedPhantom, segmented_phantom
from estimator.segmentation.points import read_fiducials, read_points
from estimator.segmentation.reading import read_label_map
from estimator.segmentation.registration import Registration, registered_by_fiducials, registered_by_surface
from estimator.segmentation.writing import PHANTOM_FILE, Origin, write_phantom

_EXAMPLES = """  retract phantom liver.nii.gz --output phantoms/liver --centred
  retract phantom liver.seg.nrrd --label liver --cavity cyst --region tumour=3:modulus_ratio=2.5 --output phantoms/P07
  retract phantom liver.mha --label liver=1 --fiducials pairs.csv --output phantoms/P07
  retract phantom liver.nii.gz --onto scan.ply --beads 16 --output phantoms/P07
  retract mesh phantoms/P07/phantom.ply

Reads NIfTI, NRRD, MetaImage (.mha, .mhd) and DICOM-SEG. pairs.csv has the columns image_x_mm image_y_mm image_z_mm
tissue_x_mm tissue_y_mm tissue_z_mm; a CSV file of points for --onto x_mm y_mm z_mm."""


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "phantom", "make a phantom of a segmented image", _EXAMPLES, run)
    parser.add_argument(
        "segmentation", type=Path, metavar="SEGMENTATION", help="label map, told by its content"
    )
    parser.add_argument("--output", type=Path, metavar="DIR", required=True, help="folder; must not exist")
    parser.add_argument(
        "--label",
        action="append",
        default=[],
        metavar="[NAME=]LABEL",
        help="of the tissue, by its number or the name that the file gives it; repeat for several that are one organ "
        "(default: the only label)",
    )
    parser.add_argument(
        "--cavity",
        action="append",
        default=[],
        metavar="LABEL",
        help="of what is no tissue, as a cyst; repeatable",
    )
    parser.add_argument(
        "--region",
        action="append",
        default=[],
        metavar="NAME=LABEL:modulus_ratio=R",
        help="of tissue that is R times as stiff as the rest; repeatable",
    )
    parser.add_argument("--fill-holes", action="store_true", help="take holes that no label names as tissue")
    parser.add_argument(
        "--largest", action="store_true", help="take the largest piece of an organ in several"
    )
    parser.add_argument(
        "--frame",
        choices=("LPS", "RAS"),
        default="LPS",
        help="axes of the image's frame, in which image_x_mm of fiducials are too (default: %(default)s, as DICOM)",
    )
    where = parser.add_argument_group("where the tissue frame is (default: the image's frame)")
    where.add_argument(
        "--centred", action="store_true", help="origin in the middle of the bounding box, axes of the image"
    )
    where.add_argument(
        "--fiducials", type=Path, metavar="CSV", help="pairs of points in image and tissue frame"
    )
    where.add_argument(
        "--onto",
        type=Path,
        metavar="FILE",
        help="points or a surface in the tissue frame that it is laid onto",
    )
    parser.add_argument("--density", type=float, default=1070.0, metavar="KG_M3", help="default: %(default)s")
    parser.add_argument(
        "--beads", type=int, default=0, metavar="N", help="propose places for so many beads on its upper side"
    )


def run(options: argparse.Namespace) -> Result:
    """Make the surfaces, register them, and write them with a picture."""
    if options.output.exists():
        raise InputError(f"{options.output}: exists already; name a new folder")
    if options.centred and (options.fiducials or options.onto):
        raise InputError("--centred: the registration tells where the tissue frame is; give one of both")
    source = str(options.segmentation)
    labels = read_label_map(options.segmentation)
    selection = _selection(options, labels)
    T_frame_lps = RAS_TO_LPS if options.frame == "RAS" else np.eye(4)
    with progress() as tell:
        tell("making the surface", 0, 2)
        in_lps = segmented_phantom(labels, selection, source)
        tell("registering", 1, 2)
        made = _registration(options, in_lps.moved(T_frame_lps))
    origin = _origin(options, in_lps, made, T_frame_lps)
    found = in_lps.moved(origin.T_phantom_lps)
    beads = spread_beads(found.surface, options.beads)
    title = f"{origin.frame}; {found.surface.volume_m3 * 1e6:.4g} cm3, {100 * found.volume_error:+.2g} % of the voxels'"
    with appearing(options.output) as draft:
        write_phantom(found, beads, origin, options.density, draft)
        pairs = None if made is None else (made.points, made.reached)
        draw_phantom(found.surface, found.regions, pairs, title, draft / "phantom.png")
    return Result(
        "\n".join(_told(labels, found, origin, options)), _data(labels, found, origin, options.output)
    )


def _selection(options: argparse.Namespace, labels: LabelMap) -> Selection:
    organ = tuple(_label(text.rpartition("=")[2]) for text in options.label) or _only(options, labels)
    return Selection(
        organ,
        tuple(_label(text) for text in options.cavity),
        tuple(_region(text) for text in options.region),
        options.fill_holes,
        options.largest,
    )


def _only(options: argparse.Namespace, labels: LabelMap) -> tuple[Label, ...]:
    """Return the label that is not named as anything else, if there is one alone."""
    named = [_label(text) for text in options.cavity] + [_region(text).label for text in options.region]
    found = [
        int(value) for layer in labels.layers for value in np.unique(layer) if value and value not in named
    ]
    if len(found) == 1:
        return (found[0],)
    shown = ", ".join(map(str, found[:12])) or "none"
    raise InputError(
        f"{options.segmentation}: which label is the organ? There are {shown}; name it with --label"
    )


def _label(text: str) -> Label:
    return int(text) if text.isdecimal() else text


def _region(text: str) -> RegionLabel:
    name, _, rest = text.partition("=")
    label, _, ratio = rest.partition(":modulus_ratio=")
    try:
        value = float(ratio)
    except ValueError:
        value = np.nan
    plain = name.replace("_", "").replace("-", "")
    if not (plain.isascii() and plain.isalnum() and len(name) <= 40 and label and 1e-3 <= value <= 1e3):
        raise InputError(
            f"--region {text}: write it as NAME=LABEL:modulus_ratio=R, the name of letters, digits, _ and -, R from "
            "0.001 to 1000"
        )
    return RegionLabel(name, _label(label), value)


def _registration(options: argparse.Namespace, found: SegmentedPhantom) -> Registration | None:
    by_pairs = None
    if options.fiducials is not None:
        by_pairs = registered_by_fiducials(*read_fiducials(options.fiducials), str(options.fiducials))
    if options.onto is None:
        return by_pairs
    start = None if by_pairs is None else by_pairs.T_tissue_image
    return registered_by_surface(found.surface, read_points(options.onto), start)


def _origin(
    options: argparse.Namespace, in_lps: SegmentedPhantom, made: Registration | None, T_frame_lps: Any
) -> Origin:
    if made is not None:
        return Origin(options.segmentation, "tissue frame", made.T_tissue_image @ T_frame_lps, made)
    if not options.centred:
        return Origin(options.segmentation, f"the image's frame ({options.frame})", T_frame_lps, None)
    T_phantom_lps = T_frame_lps.copy()
    T_phantom_lps[:3, 3] -= in_lps.moved(T_frame_lps).surface.bounds.mean(axis=0)
    frame = f"axes of the image ({options.frame}), origin in the phantom's middle"
    return Origin(options.segmentation, frame, T_phantom_lps, None)


def _told(
    labels: LabelMap, found: SegmentedPhantom, origin: Origin, options: argparse.Namespace
) -> Sequence[str]:
    voxel = " x ".join(f"{edge:.3g}" for edge in labels.spacing_mm)
    size = " x ".join(f"{edge:.1f}" for edge in 1e3 * np.ptp(found.surface.bounds, axis=0))
    lines = [
        f"voxels           {' x '.join(map(str, labels.layers[0].shape))} of {voxel} mm",
        f"frame            {origin.frame}",
        f"volume           {found.surface.volume_m3 * 1e6:.3f} cm3 ({100 * found.volume_error:+.3f} % of the voxels')",
        f"size             {size} mm, {len(found.surface.triangles)} triangles",
        f"in common        {100 * found.in_common:.1f} % of voxels and surface (Dice)",
        f"cavities         {found.cavities}",
    ]
    for name, region in found.regions.items():
        ratio = found.modulus_ratios[name]
        lines.append(f"region           {name}, {region.volume_m3 * 1e6:.3g} cm3, {ratio:g} times as stiff")
    if (made := origin.registration) is not None:
        error = f"rms {made.rms_m * 1e3:.2f} mm, at most {made.distances_m.max() * 1e3:.2f} mm"
        left_out = made.left_out_m[np.isfinite(made.left_out_m)]
        if len(left_out):
            error += f"; each left out in turn, rms {np.sqrt(np.mean(left_out**2)) * 1e3:.2f} mm"
        lines.append(f"registration     by {made.method}, {len(made.points)} points: {error}")
        lines += [f"Warning: {remark}" for remark in made.remarks]
    elif not options.centred:
        lines.append(
            "Note: in the image's frame; --centred, --fiducials or --onto bring it to that of the tissue"
        )
    lines += [f"Note: {remark}" for remark in found.remarks]
    return [*lines, f"written          {options.output / PHANTOM_FILE}, with its surfaces and phantom.png"]


def _data(labels: LabelMap, found: SegmentedPhantom, origin: Origin, output: Path) -> dict[str, Any]:
    made = origin.registration
    left_out = [] if made is None else [None if np.isnan(one) else one for one in made.left_out_m.tolist()]
    return {
        "voxels": list(labels.layers[0].shape),
        "spacing_mm": labels.spacing_mm.tolist(),
        "frame": origin.frame,
        "T_phantom_lps": origin.T_phantom_lps.tolist(),
        "volume_m3": found.surface.volume_m3,
        "volume_error": found.volume_error,
        "triangles": len(found.surface.triangles),
        "in_common": found.in_common,
        "cavities": found.cavities,
        "regions": {name: one.volume_m3 for name, one in found.regions.items()},
        "registration": None
        if made is None
        else {
            "method": made.method,
            "rms_m": made.rms_m,
            "distances_m": made.distances_m.tolist(),
            "left_out_m": left_out,
            "remarks": list(made.remarks),
        },
        "remarks": list(found.remarks),
        "files": sorted(str(file) for file in output.iterdir()),
    }
