"""The command line of the benchmarks."""

import argparse
import sys
from collections.abc import Callable, Iterator, Mapping

from benchmarks import (
    accuracy,
    bench_tests,
    budget,
    calibration,
    diagnosis,
    investigation,
    online,
    scaling,
    speed,
)
from estimator.errors import EstimatorError

_WITHOUT_OPTIONS: Mapping[str, Callable[[], Iterator[str]]] = {
    "speed": speed.lines,
    "online": online.lines,
    "scaling": scaling.lines,
    "accuracy": accuracy.lines,
}
_WITH_OPTIONS = {
    "diagnosis": diagnosis,
    "calibration": calibration,
    "bench-tests": bench_tests,
    "budget": budget,
    "investigation": investigation,
}


def main() -> int:
    """Run one benchmark and print its lines as they come."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    benchmarks = parser.add_subparsers(metavar="BENCHMARK", required=True)
    for name, lines in _WITHOUT_OPTIONS.items():
        one = benchmarks.add_parser(name, help=_summary(lines))
        one.set_defaults(lines=lambda _, lines=lines: lines())
    for name, module in _WITH_OPTIONS.items():
        one = benchmarks.add_parser(name, help=module.__doc__, description=module.__doc__)
        module.add_arguments(one)
        one.set_defaults(lines=module.lines)
    options = parser.parse_args()
    try:
        for line in options.lines(options):
            sys.stdout.write(line + "\n")
            sys.stdout.flush()
    except EstimatorError as error:
        sys.stderr.write(f"benchmarks: {error}\n")
        return 2
    return 0


def _summary(lines: Callable[[], Iterator[str]]) -> str | None:
    return sys.modules[lines.__module__].__doc__


if __name__ == "__main__":
    sys.exit(main())
