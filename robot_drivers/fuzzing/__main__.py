"""Feed damaged bytes to every parser of the drivers and judge what they make of it.

A parser may refuse an input by the errors that it documents. Anything else is a finding: another exception, more than
a second of CPU time, a gigabyte of memory, or a value that differs from what an independent reading of the bytes says.

Examples::

    python -m robot_drivers.fuzzing --count 100000                 half a minute
    python -m robot_drivers.fuzzing --count 10000000 --processes 2 the long run
    python -m robot_drivers.fuzzing --count 10000000 --first 4200000   go on with a run that was interrupted
    python -m robot_drivers.fuzzing --seed 7 --first 31000 --count 1000   the chunk of a finding again

The exit status is 1 where something was found.
"""

import argparse
import sys
import time
from collections.abc import Sequence

from robot_drivers.fuzzing.campaign import CHUNK, ChunkResult, Finding, Tally, run_campaign
from robot_drivers.fuzzing.targets import TARGETS

_TELL_EVERY_S = 10.0


class _Progress:
    """Adds up results and says from time to time how far everything is done."""

    def __init__(self, first: int, count: int) -> None:
        self.tallies = {target.name: Tally() for target in TARGETS}
        self._end = first + count
        self._done: set[int] = set()
        self._next_chunk = first // CHUNK
        self._begin_s = self._told_s = time.monotonic()

    @property
    def total(self) -> Tally:
        return sum(self.tallies.values(), Tally())

    @property
    def resume_at(self) -> int:
        """The first input that is not done yet."""
        return self._next_chunk * CHUNK

    @property
    def seconds(self) -> float:
        return time.monotonic() - self._begin_s

    def tell(self, result: ChunkResult) -> None:
        self.tallies[result.target] += result.tally
        self._done.add(result.chunk)
        while self._next_chunk in self._done:
            self._done.remove(self._next_chunk)
            self._next_chunk += 1
        for finding in result.findings:
            sys.stderr.write(f"{_told(finding)}\n")
        if time.monotonic() - self._told_s > _TELL_EVERY_S:
            self._told_s = time.monotonic()
            sys.stderr.write(
                f"{self.resume_at} of {self._end} inputs, {self.total.inputs / self.seconds:.0f} a second; "
                f"resume with --first {self.resume_at}\n"
            )

    def table(self) -> str:
        lines = [f"{'parser':26} {'inputs':>9} {'taken':>9} {'refused':>9} {'1/s CPU':>9} {'slowest ms':>10}"]
        for name, tally in [*self.tallies.items(), ("all", self.total)]:
            rate = tally.inputs / tally.cpu_s if tally.cpu_s else 0.0
            lines.append(
                f"{name:26} {tally.inputs:9d} {tally.taken:9d} {tally.refused:9d} {rate:9.0f} "
                f"{1e3 * tally.slowest_s:10.1f}"
            )
        peak = self.total.peak_bytes / 2**20
        lines.append(
            f"{self.seconds:.0f} s, {self.total.inputs / self.seconds:.0f} a second, peak {peak:.0f} MiB"
        )
        return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a campaign."""
    parser = argparse.ArgumentParser(
        prog="python -m robot_drivers.fuzzing",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--count", type=int, default=100_000, help="inputs (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="default %(default)s")
    parser.add_argument("--first", type=int, default=0, help="number of the first input, to resume a run")
    parser.add_argument("--processes", type=int, default=1, help="default %(default)s")
    parser.add_argument("--list", action="store_true", help="say how each parser is judged, and end")
    options = parser.parse_args(arguments)
    if options.list:
        sys.stdout.writelines(f"{target.name:26} {target.oracle}\n" for target in TARGETS)
        return 0
    if options.count < 1 or options.first < 0 or options.processes < 1 or options.seed < 0:
        parser.error("--count and --processes must be positive, --first and --seed not negative")
    chunks = range(options.first // CHUNK, -(-(options.first + options.count) // CHUNK))
    progress = _Progress(options.first, options.count)
    try:
        findings = run_campaign(options.seed, chunks, options.processes, progress.tell)
    except KeyboardInterrupt:
        sys.stderr.write(f"interrupted; resume with --first {progress.resume_at}\n")
        return 130
    sys.stdout.write(f"{progress.table()}\n{len(findings)} findings\n")
    return 1 if findings else 0


def _told(finding: Finding) -> str:
    return (
        f"FINDING in {finding.target}: {finding.complaint}\n  input {finding.case}\n"
        f"  again: --seed {finding.seed} --first {finding.chunk * CHUNK} --count {CHUNK}"
    )


if __name__ == "__main__":
    sys.exit(main())
