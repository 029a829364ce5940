"""When an effect acts, between the tissue and the recording, and on what."""

from typing import Literal, get_args

# Where an effect comes between the tissue and the recording: effects act in this order.
Stage = Literal["tissue", "mounting", "surroundings", "motion", "force", "vision"]
STAGES: tuple[Stage, ...] = get_args(Stage)

# The places where an effect may act: the methods that it may override.
Hook = Literal["material", "problem", "beads", "log_modulus", "terms", "motion", "seen", "readings"]
HOOKS: tuple[Hook, ...] = get_args(Hook)
