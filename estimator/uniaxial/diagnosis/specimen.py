r"""Nominal stress of a homogeneous specimen along a test, per Young's modulus, with whatever may cause a gap.

Along the travel d of a test (a strain), from the machine to the tissue:

* machine: d - c P/E is left of the travel, c being the stiffness of the specimen over that of the machine
* slack: below it nothing is borne
* clamps: of what the travel goes beyond a strain, a share slips and never comes back; or a piece slips at once
* permanent set: a share of the largest strain that the specimen has seen stays (R. Diani, B. Fayolle & P. Gilormini,
  Eur. Polym. J. 45 (2009) 601, on the phenomenon)
* a hyperelastic law (:mod:`estimator.uniaxial.stress`)
* stress softening: P η, with

      η = 1 - (1/r) erf((W_max - W) / (m W_top + β W_max))

  where W_max is the largest energy so far and W_top that of the test (R. W. Ogden & D. G. Roxburgh, Proc. R. Soc.
  Lond. A 455 (1999) 2861; the term β W_max as in common finite element programs)
* relaxation: P + Σ g ∫ exp(-(t - s)/τ) dP(s), quasi-linear (Y. C. Fung, Biomechanics (1993), section 7.6); E is that
  of the stress that stays
* friction on the platens: they slide, and the mean pressure on a cylinder of diameter D and height H is

      P (1 ± μ D / (3 H) λ^(-3/2)),  - while the platens go back

  (E. Siebel, Stahl und Eisen 43 (1923) 1295, as in G. E. Dieter, Mechanical Metallurgy, 3rd ed. (1986), section 15.3),
  or they hold a share k of the faces: P (1 + 2 k S² λ^(-3)), S = D / (4 H) (A. N. Gent & P. B. Lindley, Proc. Inst.
  Mech. Eng. 173 (1959) 111)
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.special import erf

from estimator.materials.law import Law
from estimator.materials.neo_hookean import NeoHookean
from estimator.uniaxial.diagnosis.rows import Rows
from estimator.uniaxial.records import FloatArray
from estimator.uniaxial.stress import unit_stress_and_energy

SUPPOSED_SHAPE_FACTOR = 0.25
"""Of a cylinder whose sizes nobody stated: as high as it is wide."""

_SOFTENING_SHARE_OF_LARGEST = 0.1
_JUMP_WIDTH = 0.01  # of the range of strain, over which a jump is spread
_MACHINE_STEPS = 12
_MACHINE_TOLERANCE = 1e-4
_LEAST_STRETCH = 0.02


@dataclass(frozen=True, slots=True)
class Specimen:
    """What may be wrong with a Neo-Hookean specimen in a perfect machine; by default nothing.

    Attributes
    ----------
    law, shape : hyperelastic law and its shape parameters
    relaxation : relaxing share of the stress that stays, and time, s, of every term
    softening : largest share of stress that is lost, and energy over which, of the largest
    permanent_set : share of the largest strain so far
    slack : strain
    compliance : of the machine, over that of the specimen
    creeping_slip : share of the travel that slips, and strain from which on
    sudden_slip : strain that slips, and strain at which
    sliding_friction : coefficient on the platens, and strain over which it turns round
    held_faces : share of the loaded faces that stick to the platens
    """

    law: Law = field(default_factory=NeoHookean)
    shape: tuple[float, ...] = ()
    relaxation: tuple[tuple[float, float], ...] = ()
    softening: tuple[float, float] = (0.0, 1.0)
    permanent_set: float = 0.0
    slack: float = 0.0
    compliance: float = 0.0
    creeping_slip: tuple[float, float] = (0.0, 0.0)
    sudden_slip: tuple[float, float] = (0.0, 0.0)
    sliding_friction: tuple[float, float] = (0.0, 1.0)
    held_faces: float = 0.0


def stress_per_modulus(specimen: Specimen, rows: Rows) -> FloatArray:
    """Return nominal stress over Young's modulus (n,), in the direction of loading.

    Raises
    ------
    SolverError
        A strain lies beyond the law's limit.
    """
    borne = _stress(specimen, rows, rows.strain)
    if not specimen.compliance:
        return borne
    # Each row by its own secant: what a row bears depends on its own travel first, on those before it little.
    slope = np.full_like(borne, -specimen.compliance)
    for _ in range(_MACHINE_STEPS):
        found = _stress(specimen, rows, rows.strain - specimen.compliance * borne)
        step = (found - borne) / (1 - slope)
        if np.abs(step).max() <= _MACHINE_TOLERANCE * np.abs(borne).max():
            break
        ahead = _stress(specimen, rows, rows.strain - specimen.compliance * (borne + step))
        moved = np.abs(step) > _MACHINE_TOLERANCE**2 * np.abs(borne).max()
        slope = np.where(moved, (ahead - found) / np.where(moved, step, 1.0), slope)
        slope = np.minimum(slope, 0.0)
        borne = borne + (found - borne) / (1 - slope)
    return borne


def _stress(specimen: Specimen, rows: Rows, travel: FloatArray) -> FloatArray:
    strain = _strain_of_specimen(specimen, travel)
    loose = (specimen.slack, specimen.permanent_set, specimen.creeping_slip[0], specimen.sudden_slip[0])
    if any(loose) and not rows.carries_reverse:
        strain = np.maximum(strain, 0.0)
    elastic, energy, stretch = _elastic(specimen, rows, strain)
    stays = stress = elastic * _softened(specimen, energy) if specimen.softening[0] else elastic
    for share, time in specimen.relaxation:
        stress = stress + share * _relaxing(stays, rows.time, time)
    if rows.test.mode == "compression":
        stress = stress * _platens(specimen, rows, strain, stretch)
    return stress if rows.carries_reverse else np.maximum(stress, 0.0)


def _strain_of_specimen(specimen: Specimen, travel: FloatArray) -> FloatArray:
    slack = specimen.slack
    strain = travel - np.clip(travel, -slack, slack) if slack else travel
    share, onset = specimen.creeping_slip
    if share:
        strain = strain - share * np.maximum(np.maximum.accumulate(strain) - onset, 0.0)
    size, onset = specimen.sudden_slip
    if size:
        width = _JUMP_WIDTH * float(np.ptp(travel))
        strain = strain - size * np.clip((np.maximum.accumulate(strain) - onset) / width, 0.0, 1.0)
    if specimen.permanent_set:
        largest = np.maximum(np.maximum.accumulate(strain), 0.0)
        strain = strain - specimen.permanent_set * largest
    return strain


def _elastic(specimen: Specimen, rows: Rows, strain: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return stress and energy per modulus, and stretch."""
    shape = np.array(specimen.shape)
    if rows.test.mode == "shear":
        return *unit_stress_and_energy(specimen.law, shape, strain, "shear"), 1 + strain
    sign = 1.0 if rows.test.mode == "tension" else -1.0
    stretch = np.maximum(1 + sign * strain, _LEAST_STRETCH)
    stress, energy = unit_stress_and_energy(specimen.law, shape, stretch, "uniaxial")
    return sign * stress, energy, stretch


def _softened(specimen: Specimen, energy: FloatArray) -> FloatArray:
    share, width = specimen.softening
    largest = np.maximum.accumulate(energy)
    over = width * largest[-1] + _SOFTENING_SHARE_OF_LARGEST * largest
    return np.asarray(1 - share * erf((largest - energy) / over))


def _relaxing(stress: FloatArray, time: FloatArray, relaxation_time: float) -> FloatArray:
    """Return the convolution with exp(-t/τ), exact for stress that is linear between rows."""
    steps = np.maximum(np.diff(time), 1e-9) / relaxation_time
    decay = np.exp(-steps)
    gain = -np.expm1(-steps) / steps * np.diff(stress)
    kept = np.empty_like(stress)
    value = kept[0] = stress[0]
    for place, (factor, added) in enumerate(zip(decay.tolist(), gain.tolist(), strict=True), start=1):
        value = factor * value + added
        kept[place] = value
    return kept


def _platens(specimen: Specimen, rows: Rows, strain: FloatArray, stretch: FloatArray) -> FloatArray:
    factor = rows.test.shape_factor or SUPPOSED_SHAPE_FACTOR
    found = np.ones_like(strain)
    friction, turning = specimen.sliding_friction
    if friction:
        ratio = 4 * factor * stretch**-1.5
        found = found + friction * ratio / 3 * _direction(strain, turning)
    if specimen.held_faces:
        found = found + 2 * specimen.held_faces * factor**2 * stretch**-3
    return found


def _direction(strain: FloatArray, turning: float) -> FloatArray:
    """Return 1 where the platens come on and -1 where they go back, with a short transition: the play operator."""
    found = np.ones_like(strain)
    value = 1.0
    for place, step in enumerate((np.diff(strain) * 2 / turning).tolist(), start=1):
        value = min(max(value + step, -1.0), 1.0)
        found[place] = value
    return found
