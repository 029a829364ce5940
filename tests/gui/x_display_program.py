"""The real window on an X display: connect, tare, pull, stop. Writes what came of it, and takes pictures."""

import json
import sys
from pathlib import Path

from PySide6.QtWidgets import QApplication

from daq.rig import read_rig
from gui.app import Desk
from gui.pages.acquire import AcquirePage
from gui.pages.rig import RigPage
from gui.rehearsal import wait_for, wait_until
from gui.theme import LIGHT, apply_theme
from robot_drivers.real_time import prefer_this_process

PATIENCE_S = 90.0


def main() -> None:
    rig_path, sessions, pictures = (Path(argument) for argument in sys.argv[1:])
    prefer_this_process()
    application = QApplication(sys.argv[:1])
    apply_theme(application, LIGHT)
    desk = Desk(read_rig(rig_path), sessions)
    desk.open()
    window, context = desk.window, desk.context
    assert window is not None
    assert context is not None
    link, rig_page, acquire = context.link, window.page(RigPage), window.page(AcquirePage)
    rig_page.connect_button.click()
    wait_until(lambda: link.state.reading is not None, "a connected rig", PATIENCE_S)
    wait_until(lambda: link.state.rows[0].counts.received > 2000, "a second of force", PATIENCE_S)
    rig_page.tare_button.click()
    wait_until(lambda: len(link.tares.tares) == 1, "the tare", PATIENCE_S)
    window.show_page("Acquire")
    acquire.trial_panel.choose("pull")
    slow = {"steps": 1, "step_length_m": 0.006, "return_steps": 0, "speed_m_s": 0.0005}
    acquire.trial_panel.form.set_values(slow)
    acquire.start_button.click()
    wait_until(lambda: link.state.step >= 1, "the first step", PATIENCE_S)
    session = link.state.session
    wait_for(0.3)
    application.primaryScreen().grabWindow(0).save(str(pictures / "moving.png"))
    window.rig_bar.stop.click()
    wait_until(lambda: link.state.phase == "held" and link.state.session is None, "a held robot", PATIENCE_S)
    wait_for(0.3)
    application.primaryScreen().grabWindow(0).save(str(pictures / "held.png"))
    told = {"platform": application.platformName(), "session": str(session), "words": link.state.words}
    desk.end()
    sys.stdout.write(f"{json.dumps(told)}\n")


if __name__ == "__main__":
    main()
