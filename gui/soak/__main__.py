"""``python -m gui.soak``."""

import sys

from gui.soak.running import main

if __name__ == "__main__":
    sys.exit(main())
