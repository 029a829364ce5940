import os
import subprocess
import sys

REPAINT = """
import sys
from PySide6.QtCore import QTimer
from PySide6.QtGui import QImage, QPainter
from PySide6.QtWidgets import QApplication, QLabel

application = QApplication([])
image = QImage(8, 8, QImage.Format.Format_RGB32)
label = QLabel()
timer = QTimer()
for i in range(20_000):
    painter = QPainter(image)
    painter.setPen(0)
    painter.drawLine(0, 0, 7, 7)
    painter.end()
    label.setText(str(i))
    label.update()
    timer.setInterval(i)
label.show()
for _ in range(100):
    label.repaint()
print(label.text())
"""


def test_qt_survives_twenty_thousand_repaints() -> None:
    """PySide6 6.12.0 gave back one None too many per call and aborted Python 3.11 after some 17 000 calls."""
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    command = [sys.executable, "-c", REPAINT]
    result = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert (result.returncode, result.stdout.strip(), result.stderr) == (0, "19999", "")
