"""The state stream of the RAPID server: pose, joints and status about 80 times a second over TCP."""

import contextlib
import socket
import threading
from collections import deque

import numpy as np

from robot_drivers.abb.rapid_socket.codes import Status
from robot_drivers.abb.rapid_socket.frames import STATE_BYTES, FrameSplitter, StateFrame, decode_state
from robot_drivers.abb.sequence import SequenceAccount
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError, DeviceProtocolError, DeviceUnreachableError
from robot_drivers.protocols import PoseBlock, StreamStatistics

_RECEIVE_BYTES = 4096
_LONGEST_QUEUE = 100_000  # 20 minutes; the oldest samples go first when nobody reads


class StateStream:
    """A connection to the state port, which a thread of its own receives and stamps."""

    def __init__(self, host: str, port: int, connect_timeout_s: float) -> None:
        try:
            self._socket = socket.create_connection((host, port), timeout=connect_timeout_s)
        except OSError as error:
            raise DeviceUnreachableError(
                f"no state stream at {host}:{port} ({error}); check that the RAPID task T_STATE runs"
            ) from error
        self._socket.settimeout(None)
        self._name = f"state stream of the robot controller {host}:{port}"
        self._account = SequenceAccount()
        self._samples: deque[tuple[int, int, StateFrame]] = deque(maxlen=_LONGEST_QUEUE)
        self._changed = threading.Condition()
        self._lost: DeviceError | None = None
        self._thread = threading.Thread(target=self._run, name="abb-state", daemon=True)
        self._thread.start()

    def read(self, timeout_s: float) -> PoseBlock:
        """Return the samples that arrived since the last call; wait up to ``timeout_s`` for a first one.

        Raises
        ------
        DeviceError
            When the stream has ended and everything received was read.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._samples or self._lost, timeout_s)
            if not self._samples and self._lost is not None:
                raise self._lost
            samples = list(self._samples)
            self._samples.clear()
        frames = [frame for _, _, frame in samples]
        n = len(samples)
        return PoseBlock(
            counter=np.array([counter for counter, _, _ in samples], np.int64),
            device_time_s=np.array([frame.device_time_s for frame in frames]),
            host_time_ns=np.array([stamp for _, stamp, _ in samples], np.int64),
            position=np.array([frame.T_base_tool.position for frame in frames]).reshape(n, 3),
            quaternion_wxyz=np.array([frame.T_base_tool.quaternion_wxyz for frame in frames]).reshape(n, 4),
            joints=np.array([frame.joints for frame in frames]).reshape(n, 6),
            moving=np.array([Status.MOVING in frame.status for frame in frames], np.bool_),
        )

    def statistics(self) -> StreamStatistics:
        """Return the counts."""
        with self._changed:
            return self._account.statistics

    def close(self) -> None:
        """End the stream."""
        with self._changed:
            if self._lost is None:
                self._lost = DeviceUnreachableError(f"the {self._name} is closed")
                with contextlib.suppress(OSError):  # the other side was quicker
                    self._socket.shutdown(socket.SHUT_RDWR)
        self._thread.join()
        self._socket.close()

    def _run(self) -> None:
        splitter = FrameSplitter(STATE_BYTES)
        try:
            while received := self._socket.recv(_RECEIVE_BYTES):
                stamp = host_time_ns()
                self._keep([decode_state(frame) for frame in splitter.split(received)], stamp)
            raise DeviceUnreachableError(f"the {self._name} ended; connect again")
        except DeviceProtocolError as error:
            with self._changed:
                self._account.malformed()
            self._end(error)
        except DeviceError as error:
            self._end(error)
        except OSError as error:
            self._end(DeviceUnreachableError(f"the {self._name} was lost ({error}); connect again"))

    def _keep(self, frames: list[StateFrame], stamp: int) -> None:
        with self._changed:
            for frame in frames:
                counter = self._account.accept(frame.number, frame.device_time_s)
                if counter is not None:
                    self._samples.append((counter, stamp, frame))
            self._changed.notify_all()

    def _end(self, error: DeviceError) -> None:
        with self._changed:
            self._lost = self._lost or error
            self._changed.notify_all()
