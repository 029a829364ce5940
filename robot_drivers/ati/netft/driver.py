"""Driver of an ATI force/torque sensor behind a Net F/T box or an Ethernet Axia: RDT stream over UDP.

Units and factors are read from the box's active configuration, never assumed. The driver never biases by
itself.
"""

import contextlib
import socket
from dataclasses import replace

import numpy as np

from robot_drivers.ati.netft import rdt
from robot_drivers.ati.netft.command_interface import CommandInterface
from robot_drivers.ati.netft.configuration import NetFTConfiguration, read_configuration, set_rdt_rate
from robot_drivers.ati.netft.receiver import DatagramReceiver, Datagrams, LinkStatistics
from robot_drivers.ati.netft.sequence import SequenceTracker
from robot_drivers.ati.netft.settings import NetFTSettings
from robot_drivers.ati.netft.web import WebPages
from robot_drivers.ati.transducer.status import STATUS_MAPS, StatusMap, status_map
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import (
    ConfigurationError,
    DeviceError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)
from robot_drivers.protocols import DeviceIdentity, StreamStatistics, WrenchBlock

_LONGEST_PATIENCE_S = 10.0
_LARGEST_COUNT = 2**31 - 2  # a channel at the end of its range is clipped
_START_COMMANDS = {"real-time": rdt.Command.START_REAL_TIME, "buffered": rdt.Command.START_BUFFERED}


class NetFT:
    """A :class:`~robot_drivers.protocols.ForceSensor` on Net F/T.

    ``read`` belongs to one thread; ``set_bias`` and ``reset_latch`` may be called from another.

    Raises
    ------
    DeviceUnreachableError, DeviceProtocolError, ConfigurationError
        From ``connect``: the box does not answer, cannot be understood, or is set so that it cannot be used.
    """

    def __init__(self, settings: NetFTSettings) -> None:
        self._settings = settings
        self._web = WebPages(
            settings.host, settings.http_port, settings.answer_timeout_s, settings.request_pause_s
        )
        self._address = ""
        self._configuration: NetFTConfiguration | None = None
        self._status_map = status_map("")
        self._si_per_count = np.full(6, np.nan)
        self._largest_usable = np.full(6, np.nan)
        self._silence_s = settings.silence_s
        self._receiver: DatagramReceiver | None = None
        self._tracker = SequenceTracker(settings.internal_rate_hz)
        self._streaming = False
        self._repeated_starts = 0
        self._last_sign_ns = 0
        self._patience_s = settings.silence_s

    @property
    def identity(self) -> DeviceIdentity:
        """Who the sensor is; known once connected."""
        configuration = self._connected()
        scaling = configuration.scaling
        details = {
            "units": f"{scaling.force_unit}, {scaling.torque_unit}",
            "counts per unit": f"{scaling.counts_per_force:g}, {scaling.counts_per_torque:g}",
            "status map": self._status_map.product,
            "RDT mode": self._settings.mode,
        }
        if configuration.index is not None:
            details["configuration"] = f"{configuration.index}: {configuration.name}"
        if configuration.rdt_rate_hz is not None:
            details["RDT rate"] = f"{configuration.rdt_rate_hz} Hz"
        return DeviceIdentity(
            kind="force sensor",
            model=configuration.product or "ATI Net F/T",
            serial=configuration.calibration_serial,
            address=f"{self._settings.host}:{self._settings.rdt_port}",
            details=details,
        )

    def connect(self) -> None:
        """Read what the box is set to, and set the RDT rate where one is wanted. Nothing is biased."""
        settings = self._settings
        try:
            self._address = socket.gethostbyname(settings.host)
        except OSError as error:
            raise DeviceUnreachableError(
                f"force sensor host {settings.host!r} is unknown: {error}"
            ) from error
        configuration = self._read_configuration()
        if settings.rate_hz is not None and configuration.rdt_rate_hz != settings.rate_hz:
            set_rdt_rate(self._web, settings.rate_hz)
            configuration = replace(configuration, rdt_rate_hz=settings.rate_hz)
        if configuration.rdt_enabled is False:
            raise ConfigurationError(
                f"RDT is off on the force sensor {settings.host}: enable it on its Communications page"
            )
        self._status_map = self._choose_status_map(configuration.product)
        self._si_per_count = configuration.scaling.si_per_count
        self._largest_usable = np.minimum(settings.rated_wrench, _LARGEST_COUNT * self._si_per_count)
        self._silence_s = max(settings.silence_s, 3 * configuration.datagram_period_s(settings.mode))
        self._configuration = configuration

    def start(self) -> None:
        """Begin streaming and wait for the first record.

        A socket of its own for every stream keeps records of a former one out.

        Raises
        ------
        DeviceTimeoutError
            No record came.
        """
        self._connected()
        self.stop()
        self._close_receiver()
        try:
            self._receiver = DatagramReceiver(
                (self._address, self._settings.rdt_port), rdt.DATAGRAM_SIZES, self._settings.batch_s
            )
        except OSError as error:
            raise self._unreachable(error) from error
        self._tracker = SequenceTracker(self._settings.internal_rate_hz)
        self._streaming = True
        self._repeated_starts = 0
        self._patience_s = self._silence_s
        self._last_sign_ns = host_time_ns()
        self._send(_START_COMMANDS[self._settings.mode])
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
        """Return the counts of this stream; ``restarts`` also counts those by :meth:`set_bias`.

        ``malformed`` are datagrams of a wrong length and records that fit no stream.
        """
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

    def describe_status(self, status: int) -> tuple[str, ...]:
        """Return one line for each bit set in a status word."""
        return self._status_map.describe(status)

    def set_bias(self) -> None:
        """Make the box subtract the present load from now on.

        The request is not acknowledged, and boxes differ in whether it ends the stream: so a running stream
        is started again in any case, which shows as one restart in the statistics. Samples read before that
        restart may be with or without the bias.
        """
        self._connected()
        self._send(rdt.Command.SET_BIAS)
        if self._streaming:
            self._send(_START_COMMANDS[self._settings.mode])

    def reset_latch(self) -> None:
        """Clear the box's monitor-condition latch (not acknowledged)."""
        self._connected()
        self._send(rdt.Command.RESET_LATCH)

    def stop(self) -> None:
        """Stop streaming; what has arrived can still be read."""
        if self._streaming:
            self._streaming = False
            # A request that cannot be sent is like one that is lost on its way: none is acknowledged.
            with contextlib.suppress(DeviceUnreachableError):
                self._send(rdt.Command.STOP)

    def close(self) -> None:
        """Stop streaming and release the socket."""
        self.stop()
        self._close_receiver()

    def _connected(self) -> NetFTConfiguration:
        if self._configuration is None:
            raise DeviceError(f"force sensor {self._settings.host} is not connected: call connect() first")
        return self._configuration

    def _started(self) -> DatagramReceiver:
        if self._receiver is None:
            raise DeviceError(f"force sensor {self._settings.host} was not started: call start() first")
        return self._receiver

    def _read_configuration(self) -> NetFTConfiguration:
        settings = self._settings
        if settings.scaling_source == "web":
            return read_configuration(self._web, settings.configuration_index)
        with CommandInterface(settings.host, settings.command_port, settings.answer_timeout_s) as interface:
            return NetFTConfiguration(scaling=interface.read_calibration().scaling)

    def _choose_status_map(self, product: str) -> StatusMap:
        settings = self._settings
        chosen = STATUS_MAPS[settings.status_map] if settings.status_map else status_map(product)
        if settings.usable_status is None:
            return chosen
        return replace(chosen, usable_words=settings.usable_status)

    def _send(self, command: rdt.Command) -> None:
        if command is _START_COMMANDS[self._settings.mode]:
            self._tracker.expect_start()
        request = rdt.request(command)
        try:
            if self._receiver is not None:
                self._receiver.send(request)
            else:
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as once:
                    once.sendto(request, (self._address, self._settings.rdt_port))
        except OSError as error:
            raise self._unreachable(error) from error

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
            self._send(_START_COMMANDS[self._settings.mode])

    def _close_receiver(self) -> None:
        if self._receiver is not None:
            self._receiver.close()
            self._receiver = None

    def _block(self, datagrams: Datagrams) -> WrenchBlock:
        records = rdt.decode(datagrams.payload)
        host_time_ns = np.repeat(datagrams.host_time_ns, datagrams.sizes // rdt.RECORD.itemsize)
        placed = self._tracker.place(records.rdt_sequence, records.ft_sequence, host_time_ns)
        status = records.status[placed.index]
        wrench = records.counts[placed.index] * self._si_per_count
        return WrenchBlock(
            counter=placed.counter,
            device_time_s=placed.tick / self._settings.internal_rate_hz,
            host_time_ns=host_time_ns[placed.index],
            status=status,
            usable=self._status_map.usable(status) & (np.abs(wrench) <= self._largest_usable).all(axis=1),
            wrench=wrench,
        )
