"""The answers that are no label of the catalogue."""

from estimator.effects.effect import OUTSIDE

NONE = "none"
UNKNOWN = OUTSIDE
