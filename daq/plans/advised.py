"""The manoeuvres that a diagnosis advises, as trials that the laboratory can carry out."""

import csv
import re
from pathlib import Path

from daq.plans import Trial
from estimator.diagnosis.result import Manoeuvre

_STEPS = 4
_SETTLE_S, _MEASURE_S, _HOLD_S = 0.5, 0.8, 30.0
_COLUMNS = ("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad", "settle_s", "measure_s", "phase")


def advised_trial(manoeuvre: Manoeuvre, folder: Path) -> Trial:
    """Return the trial of a manoeuvre that was advised.

    Its table is written into ``folder``, out in equal steps, a long hold, and back.
    """
    words = manoeuvre.words
    folder.mkdir(parents=True, exist_ok=True)
    table = folder / f"{re.sub('[^a-z0-9]+', '_', words.split(',')[0].lower()).strip('_')}.csv"
    with table.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(_COLUMNS)
        writer.writerows(_rows(manoeuvre))
    return Trial(str(table.absolute()), notes=words)


def _rows(manoeuvre: Manoeuvre) -> list[tuple[float | str, ...]]:
    shares = [step / _STEPS for step in range(1, _STEPS + 1)]
    out = [(share, _SETTLE_S, "hold") for share in shares]
    back = [(share, _SETTLE_S, "return_hold") for share in (*reversed(shares[:-1]), 0.0)]
    return [
        (
            *_scaled(manoeuvre.offset_m, share),
            *_scaled(manoeuvre.turn_rad, share),
            settle_s,
            _MEASURE_S,
            phase,
        )
        for share, settle_s, phase in [*out, (1.0, _HOLD_S, "hold"), *back]
    ]


def _scaled(vector: tuple[float, float, float], share: float) -> tuple[float, ...]:
    return tuple(round(share * value, 9) for value in vector)
