"""Where the beads are in a pair of live images, who they are, and how well the two cameras agree.

Of one camera the beads are found in the image, and neither placed nor named.

Computed in a process of its own (:mod:`gui.jobs.companion`).
"""

from dataclasses import dataclass

import numpy as np

from daq.acquisition.messages import Seen
from daq.one_thread import compute_in_one_thread
from daq.progress import Progress, silent
from daq.rig import Rig
from daq.vision.beads import Detections, detect_beads
from daq.vision.errors import VisionError
from daq.vision.identity import IdentityTracker
from daq.vision.planar import at_height
from daq.vision.stereo import epipolar_distance_px, match
from robot_drivers.protocols import FloatArray, IntArray

UNNAMED = -1
_WAITING = "The beads get their numbers once the phantom is seen at rest."


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
    marks : in the left and the right image, or in the only one
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
    """Follows the beads through live pairs; whoever is lost is sought anew from the design's places."""

    def __init__(self, rig: Rig) -> None:
        compute_in_one_thread()
        self._rig = rig
        self._stereo = rig.stereo() if len(rig.cameras) > 1 else None
        self._planar = None if rig.planar_view is None else rig.planar_view.camera()
        self._tracker: IdentityTracker | None = None

    def __call__(self, seen: Seen, progress: Progress = silent) -> BeadView:
        """Look at a pair of images; it is done before ``progress`` could be told anything."""
        if self._stereo is None:
            return self._in_one(seen)
        settings = self._rig.vision
        left, right = (detect_beads(image, settings.beads) for image in seen.images.values())
        matches = match(self._stereo, left, right, settings.stereo)
        words, named = "", np.empty(0, dtype=np.intp)
        try:
            named = self._named(matches.points.positions, seen.time_ns * 1e-9)
        except VisionError:
            self._tracker, words = None, _WAITING
        distances = epipolar_distance_px(
            self._stereo, left.centres[matches.left], right.centres[matches.right]
        ).diagonal()
        image = next(iter(seen.images.values()))
        return BeadView(
            (_marks(left, matches.left, named), _marks(right, matches.right, named)),
            (image.shape[1], image.shape[0]),
            distances,
            int(np.sum(named >= 0)),
            len(self._rig.specimen.fiducials_m),
            words,
        )

    def _in_one(self, seen: Seen) -> BeadView:
        """Look at the image of the only camera."""
        (image,) = seen.images.values()
        found = detect_beads(image, self._rig.vision.beads)
        size, beads = (image.shape[1], image.shape[0]), len(self._rig.specimen.fiducials_m)
        if self._planar is None:
            marks = Marks(found.centres, found.radii, np.full(len(found), UNNAMED, dtype=np.int64))
            words = f"{len(found)} beads are in the image; one camera measures no place in space"
            return BeadView((marks,), size, np.empty(0), 0, beads, words)
        height_m = float(np.mean([rest[2] for rest in self._rig.specimen.fiducials_m]))
        face = at_height(self._planar, found.centres, height_m)
        met = np.flatnonzero(np.isfinite(face).all(axis=1))
        words, named = "", np.empty(0, dtype=np.intp)
        try:
            named = self._named(face[met], seen.time_ns * 1e-9)
        except VisionError:
            self._tracker, words = None, _WAITING
        marks = _marks(found, met, named)
        return BeadView((marks,), size, np.empty(0), int(np.sum(named >= 0)), beads, words)

    def _named(self, points: FloatArray, time_s: float) -> IntArray:
        """Return the row of the point that is each fiducial, -1 where unseen."""
        if self._tracker is None:
            self._tracker = IdentityTracker(self._rig.specimen.fiducials_m, self._rig.vision.identity)
        named = self._tracker.assign(points, time_s).points
        if np.all(named < 0):
            self._tracker = None
        return named


def _marks(found: Detections, rows: IntArray, named: IntArray) -> Marks:
    names = np.full(len(found), UNNAMED, dtype=np.int64)
    for fiducial, point in enumerate(named.tolist()):
        if point >= 0:
            names[rows[point]] = fiducial
    return Marks(found.centres, found.radii, names)
