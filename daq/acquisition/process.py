"""The acquisition process itself: sessions in its main thread, the client heard, watched and told in three others.

What the client sends is read by one thread, which therefore notices its end at once; another looks how long it has
been silent; a third tells it the telemetry, and may wait for a client that does not read without keeping anybody.
"""

import pickle
import queue
import signal
import threading
from pathlib import Path
from typing import BinaryIO

from daq.acquisition.connections import Connections
from daq.acquisition.counting import Counting
from daq.acquisition.failures import failure_of
from daq.acquisition.link import Link
from daq.acquisition.live_view import LiveView
from daq.acquisition.messages import (
    VERSION,
    Alive,
    Check,
    Checked,
    Close,
    Command,
    Ended,
    Hold,
    Look,
    Mark,
    Note,
    Open,
    Opened,
    Refused,
    Release,
    Seen,
    Start,
    TakeTare,
    Tared,
    Telemetry,
)
from daq.acquisition.silence import Silence
from daq.devices import Devices, connected
from daq.errors import DaqError, SessionError
from daq.recording.folder import read_info
from daq.recording.streams import FORCE, Streams
from daq.rig import Rig, make_devices
from daq.session.session import Label, Session
from daq.timing.laboratory_time import in_the_time_of
from robot_drivers.clock import host_time_ns, host_time_s
from robot_drivers.errors import DeviceError
from robot_drivers.real_time import shorten_collections

_TELEMETRY_PERIOD_S = 1.0 / 30.0
_SLOWEST_PACE_S = 0.05  # of cameras that set the pace
_WATCH_PERIOD_S = 0.05
_CONNECT_AGAIN_S = 2.0
_TOLD_TO_END = "the acquisition process was told to end"


def serve(commands: BinaryIO, reports: BinaryIO) -> None:
    """Do what the client says until it closes or is gone."""
    link = Link(reports)
    try:
        first = _first(commands)
        if not isinstance(first, Open) or first.version != VERSION:
            raise SessionError(
                f"the client speaks another version of the messages than {VERSION}; start it anew"
            )
        with in_the_time_of(first.rig), connected(make_devices(first.rig)) as devices:
            shorten_collections()
            link.send(Opened({role: device.identity for role, device in devices.all().items()}))
            host = Host(first.rig, devices, link)
            # a handler must not wait for what the main thread holds
            signal.signal(
                signal.SIGTERM, lambda *_: threading.Thread(target=host.end, args=(_TOLD_TO_END,)).start()
            )
            host.run(commands)
    except (DaqError, DeviceError) as error:
        link.send(Refused(failure_of(error)))


def _first(commands: BinaryIO) -> object:
    """Return the client's first message.

    Raises
    ------
    SessionError
        What it is made of cannot be imported in this process.
    """
    try:
        return pickle.load(commands)
    except (AttributeError, ImportError) as error:
        raise SessionError(
            f"the rig cannot be read in the process that records ({error}); a driver and its settings belong into an "
            "installed package, not into the script that runs"
        ) from error


class Host:
    """Carries out the commands of one client with connected devices."""

    def __init__(self, rig: Rig, devices: Devices, link: Link) -> None:
        self._rig = rig
        self._devices = devices
        self._link = link
        self._live = LiveView()
        self._counting = Counting(devices, self._live)
        self._connections = Connections(devices)
        self._starts: queue.SimpleQueue[Start | Check | None] = queue.SimpleQueue()
        self._session: Session | None = None
        self._progress = ("ready", 0, 0)
        # a client before may have died, or the robot was held by somebody else
        self._held = "the robot was held before it was connected" if devices.robot.state().stopped else ""
        self._silence = Silence(
            _WATCH_PERIOD_S, host_time_s, waiting_is_excused=rig.laboratory_clock is not None
        )
        self._closing = threading.Event()

    def run(self, commands: BinaryIO) -> None:
        """Run sessions until the client closes or is gone."""
        threads = [
            threading.Thread(target=self._hear, args=(commands,), name="client-ear", daemon=True),
            threading.Thread(target=self._watch, name="client-watch"),
            threading.Thread(target=self._tell, name="telemetry", daemon=True),
        ]
        for thread in threads:
            thread.start()
        try:
            while (start := self._next_start()) is not None:
                self._link.send(self._carry_out(start))
        finally:
            self._closing.set()

    def end(self, reason: str) -> None:
        """Hold the robot where a session runs, which is then sealed, and let :meth:`run` return; does not wait."""
        if (session := self._session) is not None:
            session.hold(reason)
        self._starts.put(None)

    def _next_start(self) -> Start | None:
        """Show what the devices bring until the next session is asked for, and connect again those that are lost."""
        while True:
            self._restore()
            try:
                return self._asked_for()
            except queue.Empty:
                continue  # something is lost

    def _restore(self) -> None:
        """Connect again what is lost; nothing moves, and a robot that has been stopped meanwhile stays held."""
        was_lost = self._connections.lost
        self._connections.restore()
        if was_lost and not self._connections.lost and not self._held and self._devices.robot.state().stopped:
            self._held = "the robot was held while it was not connected"

    def _asked_for(self) -> Start | None:
        """Show what the devices bring until a session is asked for; raises queue.Empty where a device is lost."""
        devices, connections = self._devices, self._connections
        try:
            devices.force_sensor.start()
        except DeviceError as error:
            connections.on_failure(FORCE, error)
        try:
            with Streams(devices, (self._live, self._connections)):
                while True:
                    try:
                        asked = self._starts.get(timeout=_CONNECT_AGAIN_S)
                    except queue.Empty:
                        connections.look()
                        if connections.lost:
                            raise
                        continue
                    if not isinstance(asked, Check):
                        return asked
                    self._link.send(self._checked(asked))
        finally:
            devices.force_sensor.stop()

    def _checked(self, check: Check) -> Checked:
        try:
            # never made: a session makes its folder only when it runs
            Session(self._rig, self._devices, check.trajectory, Path(), Label("check")).check()
        except (DaqError, DeviceError) as error:
            return Checked(check.trajectory, failure_of(error))
        return Checked(check.trajectory, None)

    def _carry_out(self, start: Start) -> Ended:
        failure = None
        try:
            self._connections.look()
            self._connections.require()
            session = self._session = Session(
                self._rig,
                self._devices,
                start.trajectory,
                start.folder,
                start.label,
                (self._live, self._connections),
            )
            return Ended(session.run(self._show_progress), None)
        except (DaqError, DeviceError) as error:
            failure = failure_of(error)
            if (held := self._session) is not None and held.stop is not None:
                self._held = str(error)
        finally:
            self._session, self._progress = None, ("ready", 0, 0)
        try:
            return Ended(read_info(start.folder), failure)
        except DaqError:
            return Ended(None, failure)

    def _show_progress(self, text: str, done: int, total: int) -> None:
        self._progress = (text, done, total)

    def _hear(self, commands: BinaryIO) -> None:
        """Take the client's commands until its end of the line is gone, however it went."""
        try:
            while not isinstance(command := pickle.load(commands), Close):
                threads = command.threads if isinstance(command, Alive) else ()
                self._silence.heard((*threads, threading.get_native_id()) if threads else ())
                self._obey(command)
            reason = "the client has closed"
        except (EOFError, OSError, pickle.UnpicklingError):
            reason = "the controlling program is gone"
        self.end(reason)

    def _obey(self, command: Command) -> None:
        try:
            match command:
                case Start() | Check() if self._session is not None:
                    raise SessionError("a session is running; wait for its end, or hold")
                case Start() | Check():
                    self._starts.put(command)
                case TakeTare():
                    self._link.send(Tared(self._live.tare()))
                case Look():
                    self._live.look.ask()
                case Hold(reason):
                    self._hold(reason)
                case Release():
                    self._devices.robot.resume()
                    self._held = ""
                case Note(text):
                    self._note(text)
                case Mark(problem):
                    if (session := self._session) is not None:
                        session.mark(problem)
                case Alive():
                    pass
        except (DaqError, DeviceError) as error:
            self._link.send(Refused(failure_of(error)))

    def _note(self, text: str) -> None:
        if self._session is None:
            raise SessionError("nothing is being recorded; note it once a session runs")
        self._session.note(text)

    def _hold(self, reason: str) -> None:
        if (session := self._session) is not None:
            session.hold(reason)
        else:
            self._devices.robot.hold()
        self._held = reason

    def _watch(self) -> None:
        """Hold the robot when the client has been silent for too long while a session runs."""
        while not self._closing.wait(_WATCH_PERIOD_S):
            silent = self._silence.look()
            if (session := self._session) is not None and silent and session.stop is None:
                self._hold(silent)

    def _tell(self) -> None:
        """Tell what is new in step with the cameras, so that each of their images is shown, or else by the clock."""
        paced = False
        while not self._closing.is_set():
            paced = self._live.wait_for_images(_SLOWEST_PACE_S if paced else _TELEMETRY_PERIOD_S)
            self._link.send(self._telemetry())
            if frames := self._live.look.take(tuple(self._devices.cameras)[:2]):
                images = {name: frame.image for name, frame in frames.items()}
                first = next(iter(frames.values()))
                self._link.send(Seen(images, first.pixel_format, first.host_time_ns))

    def _telemetry(self) -> Telemetry:
        force, pose, images = self._live.take()
        state, step, steps = self._progress
        session = self._session
        return Telemetry(
            time_ns=host_time_ns(),
            state=state,
            step=step,
            steps=steps,
            session=session.folder if session is not None else None,
            held=self._held,
            counts=self._counting.counts(session),
            force=force,
            pose=pose,
            images=images,
            zero=session.zero if session is not None else None,
            problems=session.problems() if session is not None else (),
        )
