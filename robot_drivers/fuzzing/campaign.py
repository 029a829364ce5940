"""Running many inputs through the parsers, in chunks that a seed and a number reproduce."""

import faulthandler
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from itertools import islice
from random import Random

from robot_drivers.fuzzing.bounds import HangError, limit_memory, time_bound
from robot_drivers.fuzzing.target import Target
from robot_drivers.fuzzing.targets import TARGETS

if sys.platform != "win32":
    import resource

CHUNK = 1000
"""Inputs of one chunk; all for the same parser."""

LONGEST_INPUT_S = 1.0
"""CPU time after which a parser is said to hang."""

_STUCK_CHUNK_S = 600.0
_MOST_FINDINGS = 5  # kept of one chunk
_LONGEST_CASE = 600


@dataclass(frozen=True, slots=True)
class Finding:
    """What a parser did wrong; ``chunk`` and ``seed`` reproduce it."""

    target: str
    seed: int
    chunk: int
    complaint: str
    case: str


@dataclass(frozen=True, slots=True)
class Tally:
    """Counts of one parser.

    ``slowest_s`` is the longest CPU time of one input, ``peak_bytes`` the most memory that a process has held.
    """

    inputs: int = 0
    taken: int = 0
    refused: int = 0
    cpu_s: float = 0.0
    slowest_s: float = 0.0
    peak_bytes: int = 0

    def __add__(self, other: "Tally") -> "Tally":
        return Tally(
            self.inputs + other.inputs,
            self.taken + other.taken,
            self.refused + other.refused,
            self.cpu_s + other.cpu_s,
            max(self.slowest_s, other.slowest_s),
            max(self.peak_bytes, other.peak_bytes),
        )


@dataclass(frozen=True, slots=True)
class ChunkResult:
    """What came of one chunk."""

    chunk: int
    target: str
    tally: Tally
    findings: tuple[Finding, ...]


def run_chunk(seed: int, chunk: int, targets: Sequence[Target] = TARGETS) -> ChunkResult:
    """Run one chunk; which parser gets it follows from its number."""
    target = targets[chunk % len(targets)]
    random = Random(seed << 40 | chunk)
    tally = Tally()
    findings: list[Finding] = []
    faulthandler.dump_traceback_later(_STUCK_CHUNK_S, exit=True)  # for what no signal can interrupt
    try:
        with time_bound() as bound:
            for _ in range(CHUNK):
                case = target.generate(random)
                outcome, complaint = _judge(target, case, bound)
                tally += outcome
                if complaint and len(findings) < _MOST_FINDINGS:
                    findings.append(Finding(target.name, seed, chunk, complaint, repr(case)[:_LONGEST_CASE]))
    finally:
        faulthandler.cancel_dump_traceback_later()
    return ChunkResult(chunk, target.name, tally + Tally(peak_bytes=_peak_bytes()), tuple(findings))


def run_campaign(
    seed: int, chunks: Iterable[int], processes: int, tell: Callable[[ChunkResult], None]
) -> list[Finding]:
    """Run chunks in several processes; tell each result as it comes; return what was found.

    A process that dies, of a hang that nothing else ends or of the system's want of memory, is a finding too.
    """
    findings: list[Finding] = []
    waiting = iter(chunks)
    with ProcessPoolExecutor(processes, initializer=_begin_work) as pool:
        running: dict[Future[ChunkResult], int] = {}
        while True:
            for chunk in islice(waiting, 2 * processes - len(running)):
                running[pool.submit(run_chunk, seed, chunk)] = chunk
            if not running:
                return findings
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                chunk = running.pop(future)
                try:
                    result = future.result()
                except BrokenProcessPool as error:
                    name = TARGETS[chunk % len(TARGETS)].name
                    return [
                        *findings,
                        Finding(name, seed, chunk, f"the process ended: {error}", "one of its chunk"),
                    ]
                findings += result.findings
                tell(result)


def _judge(target: Target, case: object, bound: Callable[[float], None]) -> tuple[Tally, str]:
    """Return the counts of one input, and a complaint or nothing."""
    taken = refused = 0
    complaint = ""
    begin_s = time.process_time()
    bound(LONGEST_INPUT_S)
    try:
        taken = int(target.check(case))
    except target.errors:
        refused = 1
    except HangError:
        complaint = f"needs more than {LONGEST_INPUT_S:g} s"
    except Exception as error:  # noqa: BLE001 - whatever else a parser raises is what this program looks for
        place = traceback.extract_tb(error.__traceback__)[-1]
        complaint = f"{type(error).__name__}: {error} ({place.name}, line {place.lineno})"
    finally:
        bound(0.0)
    cpu_s = time.process_time() - begin_s
    return Tally(1, taken, refused, cpu_s, cpu_s), complaint


def _begin_work() -> None:
    """Leave interrupts to the process that hands out the work, and bound the memory of this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    limit_memory()


def _peak_bytes() -> int:
    if sys.platform == "win32":
        return 0
    kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return kilobytes if sys.platform == "darwin" else 1024 * kilobytes
