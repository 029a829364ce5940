"""Reads a whole bench test: all cycles, holds and rates, where a record of the first loading is not enough."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.uniaxial.course import course_of
from estimator.uniaxial.diagnosis.bench_test import BenchMode, BenchTest
from estimator.uniaxial.loading import first_loading, lines_told, runs_backwards
from estimator.uniaxial.reading.language.units import factor_of
from estimator.uniaxial.reading.language.vocabulary import EXTENSOMETER_WORDS
from estimator.uniaxial.reading.language.words import has_word
from estimator.uniaxial.reading.mode import decide_mode
from estimator.uniaxial.reading.other_tests import refuse_other_test
from estimator.uniaxial.reading.record import Opened, evidence_of, opened, other_test_in
from estimator.uniaxial.reading.stated import NOTHING_STATED, Stated
from estimator.uniaxial.reading.tables.choosing import column_of
from estimator.uniaxial.records import FloatArray

_FEWEST_ROWS = 12
_GONE_BACK = 0.9  # of the strain at which load begins to fall
_RESTING = 0.05  # of the range of strain
_BORNE_ON, _BORNE_AT_REST = 0.5, 0.1  # of the load before it falls


def read_bench_test(path: Path | str, stated: Stated = NOTHING_STATED, *, shear: bool = False) -> BenchTest:
    """Read all rows of a test; those behind a tear are left out.

    Parameters
    ----------
    stated : the user's word on what the file leaves open
    shear : the user's word that it is simple shear; else a title, a fact or the name of the file may say so

    Raises
    ------
    InputError
        As :func:`read_record`, or strain or stress never changes.
    """
    read = opened(path, stated)
    curve, time = read.curve, _time(read)
    strain, stress, lines = curve.strain, curve.stress, curve.lines
    assumed = list(curve.assumed)
    if runs_backwards(strain, stress, time):
        strain, stress, lines = strain[::-1], stress[::-1], lines[::-1]
        time = None if time is None else time[::-1]
        assumed.append("the rows run from the end of the test to its beginning")
    if np.ptp(stress) == 0 or (np.ptp(strain) == 0 and (time is None or strain[0] == 0)):
        raise InputError(f"{read.file}: strain or stress does not change; check which columns hold them")
    if time is not None and not np.all(np.diff(time) >= 0):
        assumed.append("time goes back within the table and is not used")
        time = None
    strain_sign, stress_sign, end = _signs_and_end(strain, stress, lines)
    if end < _FEWEST_ROWS:
        raise InputError(
            f"{read.file}: {end} rows before the specimen tears; a diagnosis needs {_FEWEST_ROWS}"
        )
    left_out = list(read.table.left_out)
    if end < len(strain):
        left_out.append(f"{lines_told(lines[end:])}: behind the fall of stress")
    mode, supposed = _mode(read, stated, stated_shear=shear, stated_mode=stated.mode)
    assumed.extend(supposed)
    return BenchTest(
        name=read.file.stem,
        mode=mode,
        strain=strain_sign * strain[:end],
        stress=stress_sign * stress[:end],
        time=None if time is None else time[:end],
        shape_factor=read.specimen.shape_factor,
        gauge_length=None if read.specimen.gauge_length is None else read.specimen.gauge_length.value,
        area=None if read.specimen.area is None else read.specimen.area.value,
        strain_on_specimen=has_word(curve.abscissa.title.text, EXTENSOMETER_WORDS),
        path=read.file,
        found=read.found,
        assumed=tuple(assumed),
        left_out=tuple(left_out),
    )


def _time(read: Opened) -> FloatArray | None:
    choice = column_of(read.block, "time")
    if choice is None or read.curve.time is None:
        return None
    unit = choice.title.unit
    return read.curve.time * (1.0 if unit is None else factor_of(unit, "time", choice.title.text))


def _signs_and_end(
    strain: FloatArray, stress: FloatArray, lines: NDArray[np.intp]
) -> tuple[float, float, int]:
    """Return the signs of loading in the file, and the row behind the last one of a whole specimen."""
    if np.ptp(strain) == 0:
        return float(np.sign(strain[0])), float(np.sign(stress[np.argmax(np.abs(stress))])), len(strain)
    loading = first_loading(strain, stress, lines)
    course, load = loading.strain_sign * strain, loading.stress_sign * stress
    return loading.strain_sign, loading.stress_sign, _whole(course, load, loading.torn_at)


def _whole(course: FloatArray, load: FloatArray, fallen_at: int | None) -> int:
    """Return how many rows are of a whole specimen, given the row behind which load falls.

    A load that falls and is borne on is one that relaxes in a hold, or slips.
    """
    if fallen_at is None:
        return len(course)
    back = np.flatnonzero(course[fallen_at + 1 :] < _GONE_BACK * course[fallen_at])
    end = fallen_at + 1 + int(back[0]) if len(back) else len(course)
    behind = slice(fallen_at + 1, end)
    resting = float(np.ptp(course[fallen_at:end])) <= _RESTING * float(np.ptp(course))
    least = (_BORNE_AT_REST if resting else _BORNE_ON) * load[fallen_at]
    return len(course) if end > fallen_at + 1 and load[behind].min() > least else fallen_at + 1


def _mode(
    read: Opened, stated: Stated, *, stated_shear: bool, stated_mode: str | None
) -> tuple[BenchMode, tuple[str, ...]]:
    if stated_shear:
        return "shear", ()
    other = None if stated_mode is not None else other_test_in(read, stated)
    if other is not None and other.kind == "shear":
        return "shear", (f"simple shear, from {other.reason}",)
    refuse_other_test(other, str(read.file))
    curve = read.curve
    course = course_of(curve.strain, curve.stress, curve.lines, curve.time, keep_zero=stated.keep_zero)
    if not len(course.strain):
        raise InputError(f"{read.file}: nothing tells whether the test pulled or pushed; add --mode")
    decision = decide_mode(evidence_of(read, stated, course), str(read.file))
    return decision.mode, ((f"{decision.mode}, from {decision.reason}",) if decision.supposed else ())
