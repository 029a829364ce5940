"""Consecutive blocks of samples, end to end."""

from collections.abc import Sequence
from dataclasses import fields
from typing import TypeVar

import numpy as np

from robot_drivers.protocols import PoseBlock, WrenchBlock

Block = TypeVar("Block", WrenchBlock, PoseBlock)


def joined(blocks: Sequence[Block]) -> Block:
    """Return consecutive blocks of one stream, of which there is at least one, as one block."""
    # an empty block need not know how many joints the robot has
    blocks = [block for block in blocks if len(block)] or blocks[:1]
    kind, names = type(blocks[0]), [field.name for field in fields(blocks[0])]
    return kind(*(np.concatenate([getattr(block, name) for block in blocks]) for name in names))
