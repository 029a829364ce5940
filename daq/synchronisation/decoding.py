"""Images that are decoded a few ahead of whoever looks at them, in threads."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from numpy.typing import NDArray

_AHEAD = 4

Together = tuple[NDArray[Any], ...]
"""Images that were exposed together: one of each camera, or that of the only one and its depth."""

Decode = Callable[[], NDArray[Any]]


def decoded_ahead(wanted: Sequence[tuple[Decode, ...]]) -> Iterator[Together]:
    """Decode images that belong together, in order."""
    with ThreadPoolExecutor(_AHEAD) as pool:
        waiting = deque(tuple(map(pool.submit, together)) for together in wanted[:_AHEAD])
        for place in range(len(wanted)):
            due = waiting.popleft()
            for together in wanted[place + _AHEAD : place + _AHEAD + 1]:
                waiting.append(tuple(map(pool.submit, together)))
            yield tuple(image.result() for image in due)
