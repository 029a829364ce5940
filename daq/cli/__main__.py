"""``python -m daq.cli`` is ``retract``."""

import sys

from daq.cli import main

if __name__ == "__main__":
    sys.exit(main())
