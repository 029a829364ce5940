"""Where the beads are in a pair of live images, who they are, and how well the two cameras agree.

Of one calibrated camera the beads are named by where they are on the phantom's face; of one that is not they are found
in the image, and neither placed nor named.

Computed in a process of its own (:mod:`gui.jobs.companion`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from daq.acquisition.messages import Seen
from daq.calibration_files.in_force import calibrations_in_force
from daq.errors import DaqError
from daq.one_thread import compute_in_one_thread
from daq.progress import Progress, silent
from daq.rig import Rig
from daq.vision.beads import Detections, detect_beads
from daq.vision.camera_model import PinholeCamera, StereoCalibration
from daq.vision.errors import VisionError
from daq.vision.identity import IdentityTracker
from daq.vision.planar import at_height, face_height_m
from daq.vision.stereo import epipolar_distance_px, match
from robot_drivers.protocols import FloatArray, IntArray

UNNAMED = -1
_WAITING = "The beads get their numbers once the phantom is seen at rest."
_UNPLACED = (
    "one camera measures no place in space, and those on one flat face with [planar_view] in the rig file"
)


@dataclass(frozen=True, slots=True)
class Marks:
    """The beads in one image: centres (n, 2) and radii (n,) in px, names (n,), ``UNNAMED`` where not known."""

    centres: FloatArray
    radii: FloatArray
    names: IntArray


@dataclass(frozen=True, slots=True)
class BeadView:
    """What a pair of images shows.

    Attributes
    ----------
    marks : in the left and the right image, or in the only one; none where the cameras' calibration cannot be read
    size : width and height of the images, px
    epipolar_px : (m,) distance of each matched bead from the epipolar line of its partner
    named, expected : fiducials that are recognised, and that the specimen has
    words : what hinders, empty if nothing does
    """

    marks: tuple[Marks, ...]
    size: tuple[int, int]
    epipolar_px: FloatArray
    named: int
    expected: int
    words: str = ""


class BeadViewer:
    """Follows the beads through live images; whoever is lost is sought anew from the design's places.

    The cameras are calibrated as the calibrations say that are in force for the next session.

    Parameters
    ----------
    rig : that is connected
    serials : serial number of each connected device by its role
    """

    def __init__(self, rig: Rig, serials: Mapping[str, str]) -> None:
        compute_in_one_thread()
        self._rig, self._serials = rig, serials
        self._look: Callable[[Seen], BeadView] | None = None
        self._tracker: IdentityTracker | None = None

    def __call__(self, seen: Seen, progress: Progress = silent) -> BeadView:
        """Look at images of one moment; it is done before ``progress`` could be told anything."""
        try:
            if self._look is None:
                self._look = self._prepared()
        except DaqError as error:
            return BeadView((), (1, 1), np.empty(0), 0, self._expected, str(error))
        return self._look(seen)

    @property
    def _expected(self) -> int:
        return len(self._rig.specimen.fiducials_m)

    def _prepared(self) -> Callable[[Seen], BeadView]:
        """Return what looks at images with the cameras of the rig; raises DaqError where they cannot measure."""
        rig = calibrations_in_force(self._rig, self._serials).apply(self._rig)
        if len(rig.cameras) > 1:
            return partial(self._in_two, rig.stereo())
        design = rig.specimen.fiducials_m
        if rig.depth_view is not None:
            # to name the beads their usual height will do: only what is recorded is measured with its depth
            usual_m = float(np.mean([height for _, _, height in design])) if design else 0.0
            return partial(self._on_face, rig.depth_view.camera(), usual_m)
        if rig.planar_view is None:
            return self._in_image
        return partial(self._on_face, rig.planar_view.camera(), face_height_m(design))

    def _in_two(self, stereo: StereoCalibration, seen: Seen) -> BeadView:
        """Look at the images of a stereo pair."""
        settings = self._rig.vision
        left, right = (detect_beads(image, settings.beads) for image in seen.images.values())
        matches = match(stereo, left, right, settings.stereo)
        named, words = self._named(matches.points.positions, seen)
        distances = epipolar_distance_px(
            stereo, left.centres[matches.left], right.centres[matches.right]
        ).diagonal()
        marks = (_marks(left, matches.left, named), _marks(right, matches.right, named))
        return BeadView(marks, _size(seen), distances, int(np.sum(named >= 0)), self._expected, words)

    def _on_face(self, camera: PinholeCamera, height_m: float, seen: Seen) -> BeadView:
        """Look at the image of the only camera, whose beads are on the face of this height."""
        found = self._detected(seen)
        places = at_height(camera, found.centres, height_m)
        met = np.flatnonzero(np.isfinite(places).all(axis=1))
        named, words = self._named(places[met], seen)
        marks = (_marks(found, met, named),)
        return BeadView(marks, _size(seen), np.empty(0), int(np.sum(named >= 0)), self._expected, words)

    def _in_image(self, seen: Seen) -> BeadView:
        """Look at the image of a camera that measures nothing."""
        found = self._detected(seen)
        marks = _marks(found, np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp))
        words = f"{len(found)} beads are in the image; {_UNPLACED}"
        return BeadView((marks,), _size(seen), np.empty(0), 0, self._expected, words)

    def _detected(self, seen: Seen) -> Detections:
        (image,) = seen.images.values()
        return detect_beads(image, self._rig.vision.beads)

    def _named(self, points: FloatArray, seen: Seen) -> tuple[IntArray, str]:
        """Return the row of the point that is each fiducial, -1 where unseen, and what hinders."""
        if self._tracker is None:
            self._tracker = IdentityTracker(self._rig.specimen.fiducials_m, self._rig.vision.identity)
        try:
            named = self._tracker.assign(points, seen.time_ns * 1e-9).points
        except VisionError:
            self._tracker = None
            return np.empty(0, dtype=np.intp), _WAITING
        if np.all(named < 0):
            self._tracker = None
        return named, ""


def _size(seen: Seen) -> tuple[int, int]:
    """Return width and height of the images, px."""
    image = next(iter(seen.images.values()))
    return (image.shape[1], image.shape[0])


def _marks(found: Detections, rows: IntArray, named: IntArray) -> Marks:
    names = np.full(len(found), UNNAMED, dtype=np.int64)
    for fiducial, point in enumerate(named.tolist()):
        if point >= 0:
            names[rows[point]] = fiducial
    return Marks(found.centres, found.radii, names)
