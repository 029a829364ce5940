"""All faults of the campaign, in the order of its table."""

from daq.faults.clock_faults import CLOCKS
from daq.faults.device_faults import LOSS, LOST_AND_BACK, RUBBISH, STOPS
from daq.faults.fault import Fault
from daq.faults.program_faults import PROGRAMS

FAULTS: tuple[Fault, ...] = (*LOST_AND_BACK, *LOSS, *RUBBISH, *CLOCKS, *STOPS, *PROGRAMS)
