"""Processes that run emulated devices: waiting for what they tell, ending them, and ports for them."""

import random
import socket
from collections.abc import Iterable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from daq.errors import SessionError

_END_TIMEOUT_S = 5.0
# No system hands these out by itself, Linux from 32768, others from 49152: nobody is given one before it is used.
_NOT_HANDED_OUT = range(20_000, 32_000)
_PORTS_TRIED = 100


def told(control: Connection, who: str) -> Any:
    """Wait for what a process tells once it has started, and return it.

    That takes as long as it takes: a busy computer that compiles the solver for the first time needs minutes.

    Raises
    ------
    SessionError
        It has ended; ``who`` is what it is called there.
    """
    try:
        return control.recv()
    except EOFError as error:
        raise SessionError(f"{who} ended at its start; see the messages above") from error


def end_all(processes: Iterable[BaseProcess]) -> None:
    """Wait in this order for processes that have been told to end, and kill those that do not."""
    for process in processes:
        process.join(_END_TIMEOUT_S)
        if process.is_alive():
            process.kill()
            process.join()
        process.close()


def free_udp_port() -> int:
    """Return a port of the loopback interface that a robot driver will be able to listen on, minutes later too.

    Raises
    ------
    SessionError
        None is free.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for port in random.sample(_NOT_HANDED_OUT, _PORTS_TRIED):
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise SessionError(
        f"UDP ports {_NOT_HANDED_OUT[0]} to {_NOT_HANDED_OUT[-1]}: none is free for the robot; end what listens there"
    )
