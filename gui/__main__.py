"""``python -m gui``; its other processes import this module too, and need no Qt."""

import sys

if __name__ == "__main__":
    from gui.app import main

    sys.exit(main())
