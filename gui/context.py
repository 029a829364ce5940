"""What every page of the window is given, and how a page asks another one for something.

A page is a ``QWidget`` with a class attribute ``title``, made as ``SomePage(context)``. It listens to the signals of
``link``, ``jobs`` and ``navigator`` and imports no other page. No page opens a modal dialog or a nested event loop
(``exec``, the static functions of ``QFileDialog`` and ``QMessageBox``): the software stop has to be clickable at all
times. Dialogs are shown with ``setModal(False)`` and ``show()``; questions and errors go to ``navigator.tell``.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from daq.rig import Rig
from gui.messages import Message

if TYPE_CHECKING:  # both are handed on, not used here
    from gui.jobs.running import Jobs
    from gui.rig.link import AcquisitionLink


class Navigator(QObject):
    """Requests from page to page; whoever is asked also comes to the front.

    Attributes
    ----------
    estimate_requested : tuple of Path, folders of sessions or experiments to estimate from
    diagnose_requested : tuple of Path, the same to diagnose
    replay_requested : Path of a session
    trial_requested : daq.plans.Trial to put into the queue of the Acquire page
    session_recorded : Path of a session that has just been sealed
    calibration_kept : Path of a calibration that has just got its verdict
    message_told : Message for the operator, shown at the foot of the window
    """

    estimate_requested = Signal(object)
    diagnose_requested = Signal(object)
    replay_requested = Signal(object)
    trial_requested = Signal(object)
    session_recorded = Signal(object)
    calibration_kept = Signal(object)
    message_told = Signal(object)

    def tell(self, message: Message) -> None:
        """Show the operator a message."""
        self.message_told.emit(message)


@dataclass(frozen=True)
class Context:
    """What a page may use.

    Attributes
    ----------
    rig : as its file says; what is connected may have emulated devices in it, see ``link.rig``
    sessions_folder : where sessions are recorded and looked for
    link : to the acquisition process
    jobs : computations in other processes
    navigator : requests to other pages
    """

    rig: Rig
    sessions_folder: Path
    link: "AcquisitionLink"
    jobs: "Jobs"
    navigator: Navigator
