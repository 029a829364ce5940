"""A fiducial comes loose and slides on the tissue: no label of the catalogue."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import OUTSIDE, Amplitude, Constant, Effect, Readings, Values
from estimator.effects.shared.axes import AXES
from estimator.effects.shared.instants import ORDER, bead, bead_constant, number_of_beads
from estimator.effects.shared.misfit import fiducial_misfit
from estimator.experiment import Experiment

FloatArray = NDArray[np.float64]

_ONSET = Constant("onset", "1", (0.1, 0.25, 0.4, 0.55, 0.7), 0.0, 0.95)
_SPAN = Constant("span", "1", (0.15, 0.4), 0.02, 1.0)
_TRIED_BEADS = 2
# Beside the rim of the grasp strains are singular, and no mesh tells a bead's motion well enough to miss a slide.
_BESIDE_GRASP_M = 3e-3


class LooseBead(Effect):
    """In one experiment one bead slides on the tissue as that moves farther than before, and does not slide back.

    With u the farthest that the bead's place has moved so far, as a share of the farthest it ever moves there, it is
    aside by the slide times (u − onset)/span, kept between 0 and 1. The next experiment begins with a look at where
    the beads are.
    """

    label = OUTSIDE
    group = "vision"
    stage = "vision"
    acts_on = ("readings",)
    words = "A fiducial comes loose and slides on the tissue."
    form = "loose_bead"
    amplitudes = tuple(Amplitude(f"slide_{axis}", "m", scale=1e-3, smallest=1e-4) for axis in AXES)
    constants = (bead_constant("bead"), ORDER, _ONSET, _SPAN)

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the beads, clear of the grasp, of which a slide in one experiment lowers the misfit most."""
        found: list[tuple[float, dict[str, float]]] = []
        for each in baseline:
            misfit, farthest = fiducial_misfit(each), _farthest(each)
            beside_grasp = (
                each.experiment.grasp.box.distance(each.experiment.fiducials_rest) < _BESIDE_GRASP_M
            )
            for onset in _ONSET.grid:
                for span in _SPAN.grid:
                    course = _course(farthest, onset, span)
                    along = np.einsum("nm,nmc->mc", course, misfit)
                    gain = (along**2).sum(axis=1) / np.maximum((course**2).sum(axis=0), 1e-300)
                    gain[beside_grasp] = -1.0
                    number = int(np.argmax(gain))
                    place = {"bead": float(number), "order": float(each.experiment.order)}
                    found.append((float(gain[number]), {**place, "onset": onset, "span": span}))
        found.sort(key=lambda pair: -pair[0])
        best: dict[tuple[float, float], dict[str, float]] = {}
        for _, start in found:
            best.setdefault((start["bead"], start["order"]), start)
        return list(best.values())[:_TRIED_BEADS]

    def choices(self, experiments: Sequence[Experiment]) -> int:
        """Return the number of beads and experiments."""
        return number_of_beads(experiments) * len(experiments)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Move the bead."""
        if readings.experiment.order != round(values["order"]):
            return readings
        number = bead(values, "bead")
        slide = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        course = _course(_farthest(readings)[:, number], values["onset"], values["span"])
        fiducials = readings.fiducials.copy()
        fiducials[:, number] += course[:, None] * slide
        return readings.with_fiducials(fiducials)


def _farthest(readings: Readings) -> FloatArray:
    """Return how far each bead's place has moved at the most so far (n, m), as a share of the farthest."""
    away = np.linalg.norm(readings.fiducials - readings.rest_fiducials, axis=-1)
    farthest = np.maximum.accumulate(away, axis=0)
    return np.asarray(farthest / np.maximum(farthest[-1], np.finfo(float).tiny))


def _course(farthest: FloatArray, onset: float, span: float) -> FloatArray:
    return np.asarray(np.clip((farthest - onset) / span, 0.0, 1.0))
