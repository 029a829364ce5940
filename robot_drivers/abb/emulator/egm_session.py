"""EGM of the emulated controller while it runs: the stream that measures, or the guidance that moves."""

from robot_drivers.abb.egm.codec import MciState
from robot_drivers.abb.emulator.arm import Arm
from robot_drivers.abb.emulator.egm import GENERATIONS, ControllerSample, EgmSender, robot_message
from robot_drivers.abb.emulator.guidance import Guidance, GuidanceSettings, GuidanceState
from robot_drivers.abb.emulator.rapid import RapidServer


class EgmSession:
    """What the controller sends to one PC, and takes from it; numbers begin at 0 with every start.

    Attributes
    ----------
    guidance : the present or last session of guidance
    """

    def __init__(self, arm: Arm, seed: int) -> None:
        self.guidance: Guidance | None = None
        self._arm = arm
        self._seed = seed
        self._sender: EgmSender | None = None
        self._generation = GENERATIONS[0]
        self._number = 0

    def start_stream(self, remote: tuple[str, int], generation: str) -> None:
        """Send the position stream to a PC from now on."""
        self.stop()
        self.guidance = None
        self._sender = EgmSender(remote, self._seed)
        self._generation, self._number = generation, 0

    def start_guidance(self, remote: tuple[str, int], generation: str, settings: GuidanceSettings) -> None:
        """Let a PC guide the arm from now on."""
        self.start_stream(remote, generation)
        self.guidance = Guidance(settings, self._arm)

    def restart(self) -> None:
        """Begin anew after a loss of power: a stream goes on with number 0, guidance has ended."""
        self._number = 0
        if self.guidance is not None:
            self.stop()

    def stop(self) -> None:
        """End stream or guidance."""
        if self._sender is not None:
            self._sender.close()
            self._sender = None

    def cycle(self, controller_us: int, rapid: RapidServer) -> None:
        """Take what the PC wants and send what the controller knows; nothing while neither runs."""
        sender, guidance = self._sender, self.guidance
        if sender is None:
            return
        if guidance is not None:
            if not rapid.program_running:
                return
            guidance.cycle(sender.receive())
            if guidance.state is not GuidanceState.RUNNING:
                return
        sample = ControllerSample(
            controller_us,
            self._arm.measure(),
            self._arm.reference(),
            rapid.motors_on,
            rapid.program_running,
            MciState.STOPPED if guidance is None else MciState.RUNNING,
            guidance is not None and guidance.converged,
        )
        message = robot_message(self._generation, self._number, sample)
        self._number += 1
        sender.send(message, rapid.faults)
