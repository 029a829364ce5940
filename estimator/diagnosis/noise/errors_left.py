"""How much is left of the errors that rows may have in common."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ErrorsLeft:
    """Shares of the errors that rows may have in common at most.

    Attributes
    ----------
    elsewhere : of what meshes leave anywhere
    beside_rim : (m,) of what they leave beyond that of each bead, where it is beside the rim of the grasp; empty for
        all of it
    at_rest : of the deviation of the beads' stated rest positions
    """

    elsewhere: float
    beside_rim: tuple[float, ...]
    at_rest: float


AT_MOST = ErrorsLeft(1.0, (), 1.0)
