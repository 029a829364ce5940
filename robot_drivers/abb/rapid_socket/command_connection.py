"""The command connection to the RAPID server: requests from any thread, answers by number, a heartbeat."""

import queue
import select
import socket
import threading
from collections.abc import Sequence
from dataclasses import dataclass

from robot_drivers.abb.rapid_socket.codes import Command, ReplyKind
from robot_drivers.abb.rapid_socket.frames import (
    LARGEST_MOVE_SEQUENCE,
    LARGEST_SEQUENCE,
    REPLY_BYTES,
    FrameSplitter,
    Reply,
    TextReply,
    decode_reply,
    encode_request,
)
from robot_drivers.clock import Reader, host_time_ns, host_time_s, new_reader, seconds_until
from robot_drivers.errors import (
    DeviceError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
    MotionRefusedError,
)

_RECEIVE_BYTES = 4096


@dataclass(frozen=True, slots=True)
class ConnectionSettings:
    """Where the command server is and how quickly it must answer.

    ``heartbeat_period_s`` must be well below the controller's watchdog (0.5 s). A connection on which nothing
    came for ``silence_limit_s`` is given up.
    """

    host: str
    port: int
    connect_timeout_s: float = 3.0
    heartbeat_period_s: float = 0.1
    silence_limit_s: float = 1.0


class Exchange:
    """A request that was sent and the replies to it."""

    def __init__(self, seq: int, command: Command) -> None:
        self.seq = seq
        self.command = command
        self._replies: queue.SimpleQueue[Reply | TextReply | DeviceError] = queue.SimpleQueue()

    def deliver(self, reply: Reply | TextReply | DeviceError) -> None:
        """Hand over a reply, or the error that keeps it from coming."""
        self._replies.put(reply)

    def poll(self, timeout_s: float) -> Reply | TextReply | None:
        """Return the final reply, None if it does not come in time; ACCEPTED is passed over.

        Raises
        ------
        DeviceError
            When the connection is lost meanwhile.
        """
        deadline_ns = host_time_ns() + round(timeout_s * 1e9)
        while True:
            pause_s = seconds_until(deadline_ns)
            try:
                reply = self._replies.get(timeout=pause_s)
            except queue.Empty:
                if pause_s == 0.0:
                    return None
                continue
            if isinstance(reply, DeviceError):
                raise reply
            if is_final(reply):
                return reply

    def outcome(self, timeout_s: float) -> Reply | TextReply:
        """Return the final reply.

        Raises
        ------
        DeviceTimeoutError
            When none comes in time.
        DeviceError
            When the connection is lost meanwhile.
        """
        reply = self.poll(timeout_s)
        if reply is None:
            raise DeviceTimeoutError(
                f"no answer to {self.command.name} from the robot controller in {timeout_s:g} s; "
                "another client may hold its command port"
            )
        return reply


def is_final(reply: Reply | TextReply) -> bool:
    """Tell whether no further reply to the same request follows."""
    return isinstance(reply, TextReply) or reply.kind is not ReplyKind.ACCEPTED


class CommandConnection:
    """One connection to the command port. Once lost it stays lost; what it was doing is never repeated."""

    def __init__(self, settings: ConnectionSettings, motion_forbidden: bool) -> None:
        self._settings = settings
        self._lock = threading.Lock()
        self._exchanges: dict[int, Exchange] = {}
        self._next_sequence = LARGEST_MOVE_SEQUENCE
        self._last_move = 0
        self._motion_forbidden = motion_forbidden
        self._newest_reply: Reply | None = None
        self._lost: DeviceError | None = None
        self._closing, self._wake = socket.socketpair()
        # the controller of an emulated laboratory stops where no heartbeat comes: its time waits for it from here on
        beating = new_reader()
        try:
            self._socket = socket.create_connection(
                (settings.host, settings.port), timeout=settings.connect_timeout_s
            )
        except OSError as error:
            beating.close()
            self._closing.close()
            self._wake.close()
            raise DeviceUnreachableError(
                f"no robot controller at {self._address} ({error}); check the address, the network, and that "
                "the RAPID server runs"
            ) from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.settimeout(settings.silence_limit_s)
        self._thread = threading.Thread(target=self._run, args=(beating,), name="abb-command", daemon=True)
        self._thread.start()

    @property
    def newest_reply(self) -> Reply | None:
        """The last reply to anything, at most a heartbeat old while the connection stands."""
        return self._newest_reply

    def send(self, command: Command, numbers: Sequence[float] = ()) -> Exchange:
        """Send a request that moves nothing."""
        with self._lock:
            self._next_sequence = max(
                (self._next_sequence + 1) % (LARGEST_SEQUENCE + 1), LARGEST_MOVE_SEQUENCE + 1
            )
            return self._send_locked(Exchange(self._next_sequence, command), numbers)

    def send_move(self, numbers: Sequence[float]) -> Exchange:
        """Send a MOVE_L.

        Raises
        ------
        MotionRefusedError
            After :meth:`send_stop`, until :meth:`allow_motion`; nothing is sent then.
        """
        with self._lock:
            if self._motion_forbidden:
                raise MotionRefusedError("the robot is held; call resume() before it may move")
            sequence = self._last_move % LARGEST_MOVE_SEQUENCE + 1
            if sequence in self._exchanges:
                raise MotionRefusedError("the last motion has not been answered yet; hold and connect again")
            return self._send_locked(Exchange(sequence, Command.MOVE_L), numbers)

    def send_stop(self) -> Exchange:
        """Send STOP. No move that another thread is about to send gets out after it."""
        with self._lock:
            self._motion_forbidden = True
        return self.send(Command.STOP)

    def allow_motion(self) -> None:
        """Let moves be sent again."""
        with self._lock:
            self._motion_forbidden = False

    def request(self, command: Command, numbers: Sequence[float] = ()) -> Reply:
        """Send a request and wait for its final reply, within the silence limit."""
        reply = self.send(command, numbers).outcome(self._settings.silence_limit_s)
        if isinstance(reply, TextReply):
            raise DeviceProtocolError(f"text in answer to {command.name}")
        return reply

    def request_text(self, command: Command) -> str:
        """Send a request that is answered in words."""
        reply = self.send(command).outcome(self._settings.silence_limit_s)
        if not isinstance(reply, TextReply):
            raise DeviceProtocolError(f"{reply.kind.name} in answer to {command.name}, TEXT expected")
        return reply.text

    def close(self) -> None:
        """Close the connection; the controller stops a motion that is under way."""
        self._wake.close()
        self._thread.join()

    @property
    def _address(self) -> str:
        return f"{self._settings.host}:{self._settings.port}"

    def _connection_lost(self, error: OSError) -> DeviceUnreachableError:
        return DeviceUnreachableError(f"connection to robot controller {self._address} lost ({error})")

    def _send_locked(self, exchange: Exchange, numbers: Sequence[float]) -> Exchange:
        frame = encode_request(exchange.seq, exchange.command, numbers)
        if self._lost is not None:
            raise self._lost
        self._exchanges[exchange.seq] = exchange
        try:
            self._socket.sendall(frame)
        except OSError as error:
            del self._exchanges[exchange.seq]
            raise self._connection_lost(error) from error
        return exchange

    def _run(self, beating: Reader) -> None:
        try:
            self._serve(beating)
        except DeviceError as error:
            self._give_up(error)
        except OSError as error:
            self._give_up(self._connection_lost(error))
        finally:
            beating.close()
            self._closing.close()
            self._wake.close()

    def _serve(self, beating: Reader) -> None:
        splitter = FrameSplitter(REPLY_BYTES)
        next_beat = last_heard = host_time_s()
        while True:
            now = host_time_s()
            if now - last_heard > self._settings.silence_limit_s:
                hint = "; another client may hold its command port" if self._newest_reply is None else ""
                raise DeviceTimeoutError(
                    f"the robot controller {self._address} has been silent for {now - last_heard:.1f} s{hint}"
                )
            if now >= next_beat:
                self.send(Command.GET_STATE)
                next_beat = now + self._settings.heartbeat_period_s
            beating.caught_up(round(now * 1e9))
            readable, _, _ = select.select([self._socket, self._closing], [], [], max(next_beat - now, 0.0))
            if self._closing in readable:
                raise DeviceUnreachableError(f"connection to robot controller {self._address} is closed")
            if self._socket in readable:
                received = self._socket.recv(_RECEIVE_BYTES)
                if not received:
                    raise DeviceUnreachableError(f"robot controller {self._address} closed the connection")
                last_heard = host_time_s()
                for frame in splitter.split(received):
                    self._deliver(decode_reply(frame))

    def _deliver(self, reply: Reply | TextReply) -> None:
        with self._lock:
            if isinstance(reply, Reply):
                self._last_move = reply.last_move
                self._newest_reply = reply
            exchange = self._exchanges.get(reply.seq)
            if exchange is None:
                raise DeviceProtocolError(f"robot controller answers request {reply.seq}, never sent")
            if is_final(reply):
                del self._exchanges[reply.seq]
        exchange.deliver(reply)

    def _give_up(self, error: DeviceError) -> None:
        with self._lock:
            self._lost = error
            self._socket.close()
            waiting = list(self._exchanges.values())
            self._exchanges.clear()
        for exchange in waiting:
            exchange.deliver(error)
