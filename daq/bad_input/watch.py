"""What no file may bring about while it is read: a program started, a connection opened, a pickle taken apart."""

import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

_FORBIDDEN = frozenset(
    {
        "os.system",
        "os.exec",
        "os.posix_spawn",
        "os.startfile",
        "subprocess.Popen",
        "pickle.find_class",
        "socket.connect",
        "socket.bind",
        "ctypes.dlopen",
        "urllib.Request",
    }
)


class _Watch:
    """What happened, for the time that somebody looks. An audit hook cannot be taken away again."""

    def __init__(self) -> None:
        self.seen: list[str] | None = None
        self.strangers: frozenset[int | None] = frozenset()
        self._installed = False

    def install(self) -> None:
        if not self._installed:
            sys.addaudithook(self._hook)
            self._installed = True

    def _hook(self, event: str, arguments: tuple[object, ...]) -> None:
        if self.seen is None or event not in _FORBIDDEN or threading.get_ident() in self.strangers:
            return
        if not (event == "pickle.find_class" and _within_numba()):
            self.seen.append(f"{event} {arguments!r}"[:200])


def _within_numba() -> bool:
    """Tell whether numba is loading a kernel of this program, which it keeps as a pickle beside the source."""
    frame: FrameType | None = sys._getframe()
    while frame is not None:
        if str(frame.f_globals.get("__name__")).startswith("numba."):
            return True
        frame = frame.f_back
    return False


_WATCH = _Watch()


@contextmanager
def watched() -> Iterator[Sequence[str]]:
    """Give a list to which every forbidden thing is added that happens meanwhile in this process.

    What other threads do that were there before is their own business.
    """
    _WATCH.install()
    here = threading.current_thread()
    _WATCH.strangers = frozenset(thread.ident for thread in threading.enumerate() if thread is not here)
    seen: list[str] = []
    _WATCH.seen = seen
    try:
        yield seen
    finally:
        _WATCH.seen = None
