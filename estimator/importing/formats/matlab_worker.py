"""Loads one MATLAB file in a process of its own: ``python matlab_worker.py FILE.mat ARRAYS.npz``.

scipy.io.loadmat does not check what it reads: a damaged file makes it crash, and the process that it is in. Only
arrays of numbers and texts leave this process, and how the file nests them, as JSON; nothing that is pickled.
"""

import json
import sys
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat

NESTING = "nesting"


def main(source: str, target: str) -> None:
    """Write every array as ``array_N`` and the nesting as ``nesting``, an array of the bytes of its JSON."""
    warnings.simplefilter("ignore")
    arrays: list[NDArray[Any]] = []
    nesting = json.dumps(_nested(loadmat(source, simplify_cells=True), arrays))
    named = {f"array_{number}": array for number, array in enumerate(arrays)}
    np.savez(target, **{NESTING: np.frombuffer(nesting.encode(), np.uint8)}, **named)  # type: ignore[arg-type] # names


def _nested(value: Any, arrays: list[NDArray[Any]]) -> dict[str, Any]:
    """Return how a value nests its arrays, which are added to ``arrays``; what is neither is left out."""
    if isinstance(value, dict):
        return {"struct": {str(name): _nested(part, arrays) for name, part in value.items()}}
    if isinstance(value, list | tuple):
        return {"list": [_nested(part, arrays) for part in value]}
    array = np.asarray(value)
    if array.dtype.kind == "O" and array.ndim:
        return {"objects": [_nested(part, arrays) for part in array]}
    if array.dtype.hasobject:
        return {}
    arrays.append(array)
    return {"array": len(arrays) - 1}


if __name__ == "__main__":
    main(*sys.argv[1:])
