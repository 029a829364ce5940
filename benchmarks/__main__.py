"""The command line of the benchmarks."""

import argparse
import sys

from benchmarks import accuracy, online, scaling, speed

_COMMANDS = {
    "speed": speed.lines,
    "online": online.lines,
    "scaling": scaling.lines,
    "accuracy": accuracy.lines,
}


def main() -> None:
    """Run one benchmark and print its lines as they come."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("benchmark", choices=_COMMANDS)
    for line in _COMMANDS[parser.parse_args().benchmark]():
        sys.stdout.write(line + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
