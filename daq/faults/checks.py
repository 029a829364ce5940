"""What must be true after a fault, from the outcome alone: nothing here asks the programs that were under it."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from daq.faults.clients import MOTION
from daq.faults.fault import Fault
from daq.faults.trial import Outcome

_WHOLE_WAY_M = MOTION.steps * MOTION.step_length
_ON_PLACE_M = 5e-4
# Instants mapped across a jump are off by a share of it, stamps of a busy machine by milliseconds.
_LATE_S = 0.25


@dataclass(frozen=True, slots=True)
class Check:
    """One question.

    Attributes
    ----------
    name : in the table
    complaint : what is wrong with an outcome after a fault, in words; "" for nothing, None where it does not apply
    """

    name: str
    complaint: Callable[[Fault, Outcome], str | None]


def held_or_goes_on(fault: Fault, outcome: Outcome) -> str:
    """The robot stands in time, by the log of the emulated arm; or the session has gone all its way."""
    if fault.expected.ends == "held":
        late = outcome.moved_for_s > fault.expected.within_s
        return (
            f"moved for {outcome.moved_for_s:.3f} s, the bar is {fault.expected.within_s:g} s" if late else ""
        )
    if outcome.told:
        return f"ended with: {outcome.told}"
    if abs(outcome.way_m - _WHOLE_WAY_M) > _ON_PLACE_M:
        return f"ended {outcome.way_m * 1e3:.2f} mm from rest instead of {_WHOLE_WAY_M * 1e3:g} mm"
    return ""


def acknowledged_samples(fault: Fault, outcome: Outcome) -> str:
    """Every sample that was said to be written can be read, and was taken when its stamps say."""
    if not outcome.acknowledged or not all(outcome.acknowledged.values()):
        return "nothing was acknowledged, so nothing was tested"
    missing = [
        f"{stream}: {count - outcome.found.get(stream, 0)} of {count} missing"
        for stream, count in outcome.acknowledged.items()
        if outcome.found.get(stream, 0) < count
    ]
    late = [
        f"{stream}: instants off by {late_s:.3g} s"
        for stream, late_s in outcome.late_s.items()
        if late_s > _LATE_S
    ]
    return "; ".join(missing + late)


def trial_marked(fault: Fault, outcome: Outcome) -> str:
    """The folder says that something happened, and which clocks began anew; or that nothing did."""
    found = {stream for stream, count in outcome.resets.items() if count}
    if found != fault.expected.resets and fault.expected.ends == "goes on":
        return f"clocks found to begin anew: {', '.join(sorted(found)) or 'none'}"
    if outcome.state not in ("sealed", "recording"):
        return f"left in the state {outcome.state}"
    marked = bool(outcome.problems) or outcome.state == "recording"
    if marked == fault.expected.marked:
        return ""
    return f"marked for nothing: {'; '.join(outcome.problems)}" if marked else "not marked"


def reason_told(fault: Fault, outcome: Outcome) -> str | None:
    """The cause stands in one line: told to the client where the session ended, in the folder where it went on."""
    pattern = fault.expected.reason
    if not pattern:
        return None
    lines = [outcome.told]
    if fault.expected.ends == "goes on":
        lines = [problem for problem in outcome.problems if re.search(pattern, problem)]
    if not lines or not all(map(_one_line, lines)):
        return f"not one line: {outcome.told!r}, {list(outcome.problems)!r}"
    return "" if all(re.search(pattern, line) for line in lines) else f"not the cause: {lines[0]}"


def next_session(fault: Fault, outcome: Outcome) -> str:
    """The next session on the same devices ends well, and bears nothing of the fault."""
    return outcome.next_failure


def _one_line(text: str) -> bool:
    """Tell whether a text is one line with something in it."""
    return bool(text.strip()) and not re.search(r"[\r\n]", text.strip())


CHECKS = (
    Check("held in time, or goes on", held_or_goes_on),
    Check("acknowledged samples there", acknowledged_samples),
    Check("trial marked", trial_marked),
    Check("reason in one line", reason_told),
    Check("next session", next_session),
)


def judge(fault: Fault, outcome: Outcome) -> Mapping[str, str | None]:
    """Return what each check, by its name, has to complain of."""
    return {check.name: check.complaint(fault, outcome) for check in CHECKS}
