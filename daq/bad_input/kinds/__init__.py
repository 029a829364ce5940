"""All kinds of files that a user hands over, with the readers and the verbs that read them."""

from daq.bad_input.kind import Kind
from daq.bad_input.kinds import (
    bags,
    benchmarks,
    bodies,
    experiments,
    importing,
    laboratory,
    sessions,
    surfaces,
    uniaxial,
)

KINDS: tuple[Kind, ...] = (
    *laboratory.KINDS,
    *experiments.KINDS,
    *sessions.KINDS,
    *surfaces.KINDS,
    *bodies.KINDS,
    *uniaxial.KINDS,
    *importing.KINDS,
    *bags.KINDS,
    *benchmarks.KINDS,
)
