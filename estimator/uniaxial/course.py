"""The course of a test's first loading as magnitudes of strain and stress, each from its own zero."""

from dataclasses import dataclass, replace

import numpy as np

from estimator.uniaxial.instrument import of_the_instrument
from estimator.uniaxial.loading import IndexArray, first_loading, lines_told, runs_backwards
from estimator.uniaxial.records import FloatArray, Mode
from estimator.uniaxial.zero import find_preload, find_slack, find_start


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """A first loading.

    Attributes
    ----------
    strain, stress : (n,) magnitudes, which grow; stress in Pa
    lines : (n,) of the file
    strain_sign, stress_sign : that the file gives to loading
    assumed, left_out : a sentence each
    """

    strain: FloatArray
    stress: FloatArray
    lines: IndexArray
    strain_sign: float
    stress_sign: float
    assumed: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()


def course_of(
    strain: FloatArray,
    stress: FloatArray,
    lines: IndexArray,
    time: FloatArray | None,
    *,
    keep_zero: bool,
    over_first: bool = False,
) -> Course:
    """Return the first loading, without slack unless zeros are kept.

    Parameters
    ----------
    strain, stress : (n,) with the signs of the file
    time : (n,) where it is known
    keep_zero : leave strain and stress as they are written
    over_first : strain is over the length at its zero; without slack, over that at the end of the slack
    """
    assumed: tuple[str, ...] = ()
    odd, odd_told = of_the_instrument(strain, stress, lines)
    strain, stress, lines = strain[~odd], stress[~odd], lines[~odd]
    time = None if time is None else time[~odd]
    if runs_backwards(strain, stress, time):
        strain, stress, lines = strain[::-1], stress[::-1], lines[::-1]
        why = "time falls" if time is not None else "strain and stress fall from the first row to the last"
        assumed = (f"the rows run from the end of the test to its beginning: {why}",)
    loading = first_loading(strain, stress, lines)
    before = np.concatenate([loading.waiting, loading.rows[~np.isin(loading.rows, loading.waiting)]])
    signs = loading.strain_sign, loading.stress_sign
    course = Course(
        signs[0] * strain[loading.rows],
        signs[1] * stress[loading.rows],
        lines[loading.rows],
        *signs,
        assumed,
        (*odd_told, *loading.left_out),
    )
    if keep_zero or not len(loading.rows):
        return course
    return _without_slack(course, signs[0] * strain[before], signs[1] * stress[before], over_first=over_first)


def without_preload(course: Course, mode: Mode, reach: float) -> Course:
    """Return a course whose stress vanishes at zero strain.

    Parameters
    ----------
    reach : strain up to which a law will be fitted
    """
    preload = find_preload(course.strain, course.stress, mode, reach)
    if preload is None:
        return course
    read = f"stress at zero strain is {preload.stress / 1e3:.3g} kPa"
    if preload.strain > 0:
        told = f"{read}: a preload, so that zero strain lies {preload.strain:.3g} before that of the file"
        return replace(course, strain=course.strain + preload.strain, assumed=(*course.assumed, told))
    told = f"{read}: an offset of the load cell, which is subtracted"
    return replace(course, stress=course.stress - preload.stress, assumed=(*course.assumed, told))


def _without_slack(course: Course, strain: FloatArray, stress: FloatArray, *, over_first: bool) -> Course:
    slack = find_slack(strain, stress)
    if slack is None:
        return _from_its_start(course)
    loose = course.strain < slack.strain + slack.toe
    end = f"{course.strain_sign * slack.strain:.3g}"
    told = f"{lines_told(course.lines[loose])}: slack, no load up to a strain of {end}"
    if slack.toe:
        told = f"{told}, and the bend behind it"
    moved = f"zero strain lies where the specimen takes load, at {end} of the file"
    length = 1 + course.strain_sign * slack.strain if over_first else 1.0
    if over_first:
        moved = f"{moved}, and is over the height there"
    offset = slack.stress if abs(slack.stress) > _least_offset(stress) else 0.0
    zero = f"; stress counts from the {offset / 1e3:.3g} kPa that are read before" if offset else ""
    return replace(
        course,
        strain=(course.strain[~loose] - slack.strain) / length,
        stress=course.stress[~loose] - offset,
        lines=course.lines[~loose],
        assumed=(*course.assumed, moved + zero),
        left_out=(*course.left_out, *([told] if loose.any() else [])),
    )


def _from_its_start(course: Course) -> Course:
    """Return a course whose strain counts from its first row where no load is borne there."""
    start = find_start(course.strain, course.stress)
    if start is None:
        return course
    told = f"no load is borne at the first strain, {course.strain_sign * start:.3g}: zero strain lies there"
    return replace(course, strain=course.strain - start, assumed=(*course.assumed, told))


def _least_offset(stress: FloatArray) -> float:
    return 1e-3 * float(np.ptp(stress))
