"""Trackers that take one bead for another, or read it beside where it is."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.effects.drawing import Draw, Random, drawn_between, drawn_direction, read_as
from estimator.blind.making.scenes.scene import Drawn, Form, Mechanics, Readings


def _mixed_up(kind: str) -> Draw:
    """Two beads, or three in a ring, bear each other's names for a while, now and then, or in later experiments."""

    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        count = 3 if kind == "three_in_a_ring" else 2
        beads = random.permutation(base.beads)[:count]
        start, seed = float(random.uniform(0.1, 0.5)), int(random.integers(2**31))
        length, share = float(random.uniform(0.15, 0.4)), float(random.uniform(0.15, 0.5))
        first = int(random.integers(2, 4))

        def rows(reading: Readings) -> NDArray[np.bool_]:
            done = reading.rows.time / reading.rows.time[-1]
            if kind == "now_and_then":
                return np.random.default_rng([seed, reading.rows.order]).random(len(done)) < share
            if kind == "from_a_later_experiment_on":
                return np.full(len(done), reading.rows.order >= first)
            return np.asarray((done >= start) & (done < (start + length if kind == "for_a_while" else 2.0)))

        def change(reading: Readings) -> Readings:
            changed, wrong = reading.beads.copy(), rows(reading)
            changed[np.ix_(wrong, beads)] = reading.beads[np.ix_(wrong, np.roll(beads, 1))]
            return replace(reading, beads=changed)

        return read_as({"kind": kind, "fiducials": beads.tolist(), "from_share_of_time": start}, change)

    return draw


def _misread(kind: str) -> Draw:
    def draw(random: Random, size: float, base: Mechanics) -> Drawn:
        bead, other = (int(b) for b in random.permutation(base.beads)[:2])
        error, seed = 0.0006 * size * drawn_direction(random), int(random.integers(2**31))
        share, start = float(random.uniform(0.2, 0.6)), float(random.uniform(0.2, 0.7))
        pulled = min(0.02 * size, 0.4)

        def change(reading: Readings) -> Readings:
            beads, count = reading.beads.copy(), len(reading.beads)
            done = reading.rows.time / reading.rows.time[-1]
            if kind == "towards_another":
                beads[:, bead] += pulled * (beads[:, other] - beads[:, bead])
            elif kind == "now_and_then":
                wrong = np.random.default_rng([seed, reading.rows.order]).random(count) < share
                beads[:, bead] += np.outer(wrong, 1.5 * error)
            elif kind == "with_the_pull":
                beads[:, bead] += np.outer(reading.rows.travel / 0.02, 2 * error)
            elif kind == "two_beads":
                beads[:, bead] += error
                beads[:, other] += np.roll(error, 1)
            else:
                beads[:, bead] += np.outer((done > start) & (reading.rows.order > 1), 1.5 * error)
            return replace(reading, beads=beads)

        parameters: dict[str, object] = {"kind": kind, "fiducial": bead, "error": error.tolist()}
        if kind in ("towards_another", "two_beads"):
            parameters["other"] = other
        return read_as(parameters, change)

    return draw


def _stuck(random: Random, size: float, base: Mechanics) -> Drawn:
    """The tracker follows the bead by a part: a window that lags behind it."""
    bead, lost = int(random.integers(base.beads)), min(0.05 * size * drawn_between(random, 0.7, 1.4), 0.9)

    def change(reading: Readings) -> Readings:
        beads = reading.beads.copy()
        beads[:, bead] -= lost * (beads[:, bead] - beads[0, bead])
        return replace(reading, beads=beads)

    return read_as({"kind": "follows in part", "fiducial": bead, "lost_share": lost}, change)


FORMS: dict[str, tuple[Form, ...]] = {
    "fiducial_mislabel": (
        Form("for_a_while", _mixed_up("for_a_while"), (1.0, 1.0), family="exact", beads=2),
        Form("three_in_a_ring", _mixed_up("three_in_a_ring"), (1.0, 1.0), family="far", beads=3),
        Form("now_and_then", _mixed_up("now_and_then"), (1.0, 1.0), family="exact", beads=2),
        Form(
            "from_a_later_experiment_on",
            _mixed_up("from_a_later_experiment_on"),
            (1.0, 1.0),
            family="exact",
            beads=2,
        ),
    ),
    "fiducial_misread": (
        Form("now_and_then", _misread("now_and_then"), (0.05, 8.0), family="far", beads=2),
        Form("with_the_pull", _misread("with_the_pull"), (0.05, 6.0), family="far", beads=2),
        Form("towards_another", _misread("towards_another"), (0.05, 8.0), family="near", beads=2),
        Form("two_beads", _misread("two_beads"), (0.05, 6.0), family="far", beads=2),
        Form("follows_in_part", _stuck, (0.05, 8.0), family="exact", beads=1),
    ),
}
