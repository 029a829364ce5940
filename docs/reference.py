"""Make the reference of every module from its docstrings: ``python docs/reference.py FOLDER``, then open index.html.

It ends with status 1 where a module cannot be imported or a docstring cannot be read.
"""

import argparse
import os
import sys
import warnings
from pathlib import Path

ROOMS = ("robot_drivers", "estimator", "daq", "gui")


def main(arguments: list[str]) -> int:
    """Write the pages of the rooms and return the exit status."""
    parser = argparse.ArgumentParser(description="Make the reference from the docstrings.")
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="of the pages")
    parser.add_argument("--module", action="append", metavar="NAME", help="only this one; repeat for several")
    options = parser.parse_args(arguments)
    # libraries ask the system who it is when they are imported
    os.environ["PDOC_ALLOW_EXEC"] = "1"
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    import pdoc

    pdoc.render.configure(docformat="numpy", footer_text="Soft-tissue retraction laboratory")
    with warnings.catch_warnings(record=True) as complaints:
        warnings.simplefilter("always", UserWarning)
        # what only a type checker can evaluate is printed as it is written
        warnings.filterwarnings("ignore", message="Error parsing type annotation")
        pdoc.pdoc(*(options.module or ROOMS), output_directory=options.folder)
    for complaint in complaints:
        sys.stderr.write(f"{complaint.message}\n")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
