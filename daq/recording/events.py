"""The names of the events in a recording that other rooms read again."""

MOVE_BEGIN = "move_begin"
MOVE_END = "move_end"
MEASURE_BEGIN = "measure_begin"
MEASURE_END = "measure_end"
DEPTH_SCALE = "depth_scale"
"""What the counts of a camera's depth images mean, before the first of them and where it changes."""

GUARD_LATENCY = "guard_latency"
PACE = "laboratory_pace"
"""How many times slower than real time an emulated laboratory ran."""
