"""The virtual rig that the command line runs."""

from typing import Literal

from daq.virtual_rig.layout import GRASP_CENTRE, SPECIMEN, placed_beads
from daq.virtual_rig.physics.free_air import FreeAir
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.virtual_rig.processes import VirtualRigSettings

YOUNGS_MODULUS = 15e3
POISSON_RATIO = 0.45


def standard_settings(seed: int = 0) -> VirtualRigSettings:
    """Return the paper's phantom with a common silicone's stiffness; the seed places the beads and makes the noise."""
    from daq.virtual_rig.physics.fem_phantom import (
        FemPhantom,
    )  # compiled mechanics, which a real rig has no use for

    phantom = FemPhantom(SPECIMEN, placed_beads(seed), YOUNGS_MODULUS, POISSON_RATIO)
    return VirtualRigSettings(phantom, seed=seed)


MARKER_ON_GRIPPER = (-0.012, 0.004, 0.015)
FORCE_DELAY_S, CAMERA_DELAY_S = 0.020, 0.030


def calibration_settings(kind: str, seed: int = 0) -> VirtualRigSettings:
    """Return a rig to calibrate: free air, or springs for ``time``, whose streams are late by known times then.

    For ``camera`` it has one camera, as the rigs that this calibration is made of.
    """
    if kind == "time":
        springs = SpringPhantom(GRASP_CENTRE, placed_beads(seed))
        return VirtualRigSettings(
            springs, seed=seed, force_delay_s=FORCE_DELAY_S, camera_delay_s=CAMERA_DELAY_S
        )
    cameras: Literal[1, 2] = 1 if kind == "camera" else 2
    return VirtualRigSettings(FreeAir(SPECIMEN.fiducials_m, MARKER_ON_GRIPPER), seed=seed, cameras=cameras)
