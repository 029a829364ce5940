"""What kinds of effects there are, and on which block of the rig each kind acts: where a laboratory would look."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

Group = Literal[
    "material",
    "inhomogeneity",
    "anchor",
    "grasp",
    "environment",
    "geometry",
    "force",
    "timing",
    "vision",
    "robot",
    "numerics",
]

# What of the phantom a picture marks for a block; empty where it shows nothing of it.
Pictured = Literal["anchor", "grasp", "underside", ""]


@dataclass(frozen=True, slots=True)
class Block:
    """A part of the rig.

    Attributes
    ----------
    name : in tables and files
    words : where that is, as a line in a table says it
    pictured : what a picture of the phantom marks
    """

    name: str
    words: str
    pictured: Pictured = ""


INTERIOR = Block("interior", "in the tissue")
ANCHOR = Block("anchor", "at the anchor", "anchor")
GRASP = Block("grasp", "at the grasp", "grasp")

GROUPS: Mapping[Group, Block] = MappingProxyType(
    {
        "material": INTERIOR,
        "inhomogeneity": INTERIOR,
        "anchor": ANCHOR,
        "grasp": GRASP,
        "environment": Block("support", "at the support and around", "underside"),
        "geometry": Block("geometry", "the phantom's dimensions"),
        "force": Block("force", "not in the tissue: the force sensor"),
        "timing": Block("timing", "not in the tissue: the clocks"),
        "vision": Block("vision", "not in the tissue: the cameras"),
        "robot": Block("robot", "not in the tissue: the robot"),
        "numerics": Block("numerics", "not in the tissue: the computation"),
    }
)

BLOCK_OF_GROUP: Mapping[Group, str] = MappingProxyType({group: block.name for group, block in GROUPS.items()})
