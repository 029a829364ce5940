"""The virtual rig that the command line runs."""

from daq.virtual_rig.fem_phantom import FemPhantom
from daq.virtual_rig.layout import SPECIMEN, placed_beads
from daq.virtual_rig.processes import VirtualRigSettings

YOUNGS_MODULUS = 15e3
POISSON_RATIO = 0.45


def standard_settings(seed: int = 0) -> VirtualRigSettings:
    """Return the paper's phantom with a common silicone's stiffness; the seed places the beads and makes the noise."""
    phantom = FemPhantom(SPECIMEN, placed_beads(seed), YOUNGS_MODULUS, POISSON_RATIO)
    return VirtualRigSettings(phantom, seed=seed)
