"""A running RDT stream of one sensor: started, read, revived after silence and stopped."""

import contextlib
import socket
from dataclasses import dataclass

import numpy as np

from robot_drivers.ati.rdt import protocol
from robot_drivers.ati.rdt.receiver import DatagramReceiver, Datagrams, LinkStatistics
from robot_drivers.ati.rdt.sequence import SequenceTracker
from robot_drivers.ati.rdt.settings import RdtSettings
from robot_drivers.ati.transducer.status import StatusMap
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError, DeviceTimeoutError, DeviceUnreachableError
from robot_drivers.protocols import FloatArray, StreamStatistics, WrenchBlock

_LONGEST_PATIENCE_S = 10.0
_LARGEST_COUNT = 2**31 - 2  # a channel at the end of its range is clipped
_START_COMMANDS = {"real-time": protocol.Command.START_REAL_TIME, "buffered": protocol.Command.START_BUFFERED}


@dataclass(frozen=True, slots=True, eq=False)
class RecordMeaning:
    """What the numbers of a sensor's records mean.

    Attributes
    ----------
    si_per_count : (6,) N and N·m per count
    rated_wrench : (6,) ± N and N·m beyond which a sample is not usable
    status_map : meaning of the status word
    ticks_per_s : internal samples a second, which ``ft_sequence`` counts
    datagram_period_s : time between two datagrams; 0 where it is not known
    """

    si_per_count: FloatArray
    rated_wrench: tuple[float, ...]
    status_map: StatusMap
    ticks_per_s: float
    datagram_period_s: float = 0.0

    @property
    def largest_usable(self) -> FloatArray:
        """The largest component that is neither clipped nor beyond its rating, (6,)."""
        return np.minimum(self.rated_wrench, _LARGEST_COUNT * self.si_per_count)


class RdtStream:
    """The stream of one sensor, which begins anew with every :meth:`start`.

    Parameters
    ----------
    settings : of the driver
    address : IPv4 address of the sensor
    meaning : of its records
    """

    def __init__(self, settings: RdtSettings, address: str, meaning: RecordMeaning) -> None:
        self._settings = settings
        self._peer = (address, settings.rdt_port)
        self._meaning = meaning
        self._largest_usable = meaning.largest_usable
        self._silence_s = max(settings.silence_s, 3 * meaning.datagram_period_s)
        self._start_command = _START_COMMANDS[settings.mode]
        self._receiver: DatagramReceiver | None = None
        self._tracker = SequenceTracker(meaning.ticks_per_s)
        self._streaming = False
        self._repeated_starts = 0
        self._last_sign_ns = 0
        self._patience_s = self._silence_s

    def start(self) -> None:
        """Begin streaming and wait for the first record.

        A socket of its own for every stream keeps records of a former one out.

        Raises
        ------
        DeviceTimeoutError
            No record came.
        """
        self.close()
        try:
            self._receiver = DatagramReceiver(self._peer, protocol.DATAGRAM_SIZES, self._settings.batch_s)
        except OSError as error:
            raise self._unreachable(error) from error
        self._tracker = SequenceTracker(self._meaning.ticks_per_s)
        self._streaming = True
        self._repeated_starts = 0
        self._patience_s = self._silence_s
        self._last_sign_ns = host_time_ns()
        self.send(self._start_command)
        deadline_ns = host_time_ns() + round(self._settings.start_timeout_s * 1e9)
        while not self._receiver.wait(min(self._patience_s, (deadline_ns - host_time_ns()) * 1e-9)):
            if host_time_ns() >= deadline_ns:
                self.stop()
                raise DeviceTimeoutError(
                    f"force sensor {self._settings.host} answers but sent no RDT record in "
                    f"{self._settings.start_timeout_s} s: check UDP port {self._settings.rdt_port}, "
                    "the firewall, and that RDT is enabled"
                )
            self._revive_when_silent()

    def read(self, timeout_s: float) -> WrenchBlock:
        """Return everything that arrived since the last call; wait up to ``timeout_s`` for a first sample."""
        datagrams = self._started().receive(timeout_s)
        if len(datagrams.sizes):
            self._last_sign_ns = host_time_ns()
            self._patience_s = self._silence_s
        elif self._streaming:
            self._revive_when_silent()
        return self._block(datagrams)

    def statistics(self) -> StreamStatistics:
        """Return the counts of this stream; ``malformed`` are datagrams of a wrong length and records that fit none."""
        counts = self._tracker.statistics
        malformed = counts.malformed + (self._receiver.malformed if self._receiver else 0)
        return StreamStatistics(
            counts.received, counts.lost, counts.duplicated, counts.late, counts.restarts, malformed
        )

    def link_statistics(self) -> LinkStatistics:
        """Return what the network did since the stream started."""
        receiver = self._started()
        return LinkStatistics(
            receiver.foreign,
            self._repeated_starts,
            receiver.local_port,
            receiver.buffer_bytes,
            receiver.kernel_stamps,
        )

    def set_bias(self) -> None:
        """Make the sensor subtract the present load from now on.

        The request is not acknowledged, and boxes differ in whether it ends the stream: so a running stream
        is started again in any case, which shows as one restart in the statistics. Samples read before that
        restart may be with or without the bias.
        """
        self.send(protocol.Command.SET_BIAS)
        if self._streaming:
            self.send(self._start_command)

    def send(self, command: protocol.Command) -> None:
        """Send a request, which nothing acknowledges.

        Raises
        ------
        DeviceUnreachableError
            The network is not there.
        """
        if command is self._start_command:
            self._tracker.expect_start()
        request = protocol.request(command)
        try:
            if self._receiver is not None:
                self._receiver.send(request)
            else:
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as once:
                    once.sendto(request, self._peer)
        except OSError as error:
            raise self._unreachable(error) from error

    def stop(self) -> None:
        """Stop streaming; what has arrived can still be read."""
        if self._streaming:
            self._streaming = False
            # A request that cannot be sent is like one that is lost on its way: none is acknowledged.
            with contextlib.suppress(DeviceUnreachableError):
                self.send(protocol.Command.STOP)

    def close(self) -> None:
        """Stop streaming and release the socket."""
        self.stop()
        if self._receiver is not None:
            self._receiver.close()
            self._receiver = None

    def _started(self) -> DatagramReceiver:
        if self._receiver is None:
            raise DeviceError(f"force sensor {self._settings.host} was not started: call start() first")
        return self._receiver

    def _unreachable(self, error: OSError) -> DeviceUnreachableError:
        return DeviceUnreachableError(
            f"force sensor {self._settings.host} cannot be reached ({error}): check cable and network"
        )

    def _revive_when_silent(self) -> None:
        now_ns = host_time_ns()
        if now_ns - self._last_sign_ns < self._patience_s * 1e9:
            return
        self._last_sign_ns = now_ns
        self._patience_s = min(2 * self._patience_s, max(self._silence_s, _LONGEST_PATIENCE_S))
        self._repeated_starts += 1
        # While the network is down a request cannot even be sent; that is the same silence.
        with contextlib.suppress(DeviceUnreachableError):
            self.send(self._start_command)

    def _block(self, datagrams: Datagrams) -> WrenchBlock:
        records = protocol.decode(datagrams.payload)
        host_time_ns = np.repeat(datagrams.host_time_ns, datagrams.sizes // protocol.RECORD.itemsize)
        placed = self._tracker.place(records.rdt_sequence, records.ft_sequence, host_time_ns)
        status = records.status[placed.index]
        wrench = records.counts[placed.index] * self._meaning.si_per_count
        in_range = (np.abs(wrench) <= self._largest_usable).all(axis=1)
        return WrenchBlock(
            counter=placed.counter,
            device_time_s=placed.tick / self._meaning.ticks_per_s,
            host_time_ns=host_time_ns[placed.index],
            status=status,
            usable=self._meaning.status_map.usable(status) & in_range,
            wrench=wrench,
        )


def address_of(host: str) -> str:
    """Return the IPv4 address of a force sensor.

    Raises
    ------
    DeviceUnreachableError
        Nobody knows the name.
    """
    try:
        return socket.gethostbyname(host)
    except OSError as error:
        raise DeviceUnreachableError(f"force sensor host {host!r} is unknown: {error}") from error
