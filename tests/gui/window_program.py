"""A real window that records a slow pull, for a test to kill or to freeze; SIGUSR1 freezes its interface thread."""

import signal
import sys
import time
from pathlib import Path

from PySide6.QtWidgets import QApplication

from daq.rig import read_rig
from gui.app import Desk
from gui.pages.acquire import AcquirePage
from gui.pages.rig import RigPage
from gui.rehearsal import wait_until
from robot_drivers.real_time import prefer_this_process


def main() -> None:
    prefer_this_process()
    application = QApplication(sys.argv[:1])
    signal.signal(signal.SIGUSR1, lambda *_: time.sleep(30.0))
    desk = Desk(read_rig(Path(sys.argv[1])), Path(sys.argv[2]))
    desk.open()
    assert desk.window is not None
    assert desk.context is not None
    link = desk.context.link
    desk.window.page(RigPage).connect_button.click()
    wait_until(lambda: link.state.phase == "ready", "a connected rig")
    page = desk.window.page(AcquirePage)
    page.trial_panel.form.set_values(
        {
            "steps": 1,
            "step_length_m": 0.006,
            "return_steps": 0,
            "speed_m_s": 0.0005,
            "settle_s": 0.1,
            "measure_s": 0.3,
        }
    )
    page.start_button.click()
    wait_until(lambda: link.state.step >= 1, "the first step")
    sys.stdout.write(f"{link.state.session}\n")
    sys.stdout.flush()
    application.exec()


if __name__ == "__main__":
    main()
