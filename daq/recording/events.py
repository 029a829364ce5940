"""The names of the events in a recording that other rooms read again."""

MOVE_BEGIN = "move_begin"
MOVE_END = "move_end"
MEASURE_BEGIN = "measure_begin"
MEASURE_END = "measure_end"
GUARD_LATENCY = "guard_latency"
PACE = "laboratory_pace"
"""How many times slower than real time an emulated laboratory ran."""
