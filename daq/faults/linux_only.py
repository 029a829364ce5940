"""What only Linux lets one program do to another; `retract faults` says so elsewhere, before it imports this."""

import sys

if sys.platform == "linux":
    import os
    import resource
    import signal

    _UNLIMITED = resource.RLIM_INFINITY

    def kill(process_id: int) -> None:
        """End a program without any chance to say a word."""
        os.kill(process_id, signal.SIGKILL)

    def freeze(process_id: int) -> None:
        """Let a program hang, as one that waits for something does."""
        os.kill(process_id, signal.SIGSTOP)

    def thaw(process_id: int) -> None:
        """Let it go on."""
        os.kill(process_id, signal.SIGCONT)

    def fill_disk(process_id: int) -> None:
        """Let no file of a program grow any more: what a full disk does to it, and to nobody else."""
        resource.prlimit(process_id, resource.RLIMIT_FSIZE, (1, _UNLIMITED))

    def make_room(process_id: int) -> None:
        """Let its files grow again."""
        resource.prlimit(process_id, resource.RLIMIT_FSIZE, (_UNLIMITED, _UNLIMITED))

    def load_average() -> float:
        """Return the load of the machine over the last minute."""
        return os.getloadavg()[0]
