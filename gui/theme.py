"""Colours and style of the window, light and dark; widgets that draw ask :func:`theme_of`."""

from dataclasses import dataclass
from string import Template

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QGuiApplication, QPalette
from PySide6.QtWidgets import QApplication, QWidget


@dataclass(frozen=True, slots=True)
class Theme:
    """Colours by what they are for, as ``#rrggbb``.

    Attributes
    ----------
    window, surface, line : background, cards on it, and their edges
    text, muted : what is read first and second
    accent, on_accent : what can be acted upon, and text on it
    good, doubtful, bad : what lamps and bands show; ``on_bad`` is text on the last
    channels : of x, y and z, told apart by the colour-blind as well
    """

    dark: bool
    window: str
    surface: str
    line: str
    text: str
    muted: str
    accent: str
    on_accent: str
    good: str
    doubtful: str
    bad: str
    on_bad: str
    channels: tuple[str, str, str]


LIGHT = Theme(
    dark=False,
    window="#f3f4f6",
    surface="#ffffff",
    line="#d3d8de",
    text="#1b2027",
    muted="#5a6470",
    accent="#1d5fa6",
    on_accent="#ffffff",
    good="#2b7d3a",
    doubtful="#a86400",
    bad="#c02626",
    on_bad="#ffffff",
    channels=("#2b6fc2", "#c96a00", "#16825d"),
)
DARK = Theme(
    dark=True,
    window="#15181c",
    surface="#1d2228",
    line="#39414b",
    text="#e7eaee",
    muted="#a0aab5",
    accent="#6fb0f5",
    on_accent="#10151b",
    good="#5fc26e",
    doubtful="#e3a634",
    bad="#f0625a",
    on_bad="#1a0705",
    channels=("#6fb0f5", "#f0a040", "#4fc99a"),
)


def theme_of(widget: QWidget) -> Theme:
    """Return the theme in which a widget is shown."""
    return DARK if widget.palette().color(QPalette.ColorRole.Window).lightness() < 128 else LIGHT


def system_theme() -> Theme:
    """Return the theme that the desktop asks for."""
    return DARK if QGuiApplication.styleHints().colorScheme() == Qt.ColorScheme.Dark else LIGHT


def apply_theme(application: QApplication, theme: Theme) -> None:
    """Show the whole application in a theme."""
    application.setStyle("Fusion")
    application.setPalette(_palette(theme))
    names = ("window", "surface", "line", "text", "muted", "accent", "on_accent", "good", "bad", "on_bad")
    colours = {name: getattr(theme, name) for name in names}
    application.setStyleSheet(_STYLE.substitute(colours, hover=_mixed(theme.accent, theme.surface, 0.12)))


def _palette(theme: Theme) -> QPalette:
    roles = QPalette.ColorRole
    palette = QPalette()
    for role, colour in (
        (roles.Window, theme.window),
        (roles.WindowText, theme.text),
        (roles.Base, theme.surface),
        (roles.AlternateBase, theme.window),
        (roles.Text, theme.text),
        (roles.Button, theme.surface),
        (roles.ButtonText, theme.text),
        (roles.ToolTipBase, theme.surface),
        (roles.ToolTipText, theme.text),
        (roles.PlaceholderText, theme.muted),
        (roles.Highlight, theme.accent),
        (roles.HighlightedText, theme.on_accent),
        (roles.Link, theme.accent),
        (roles.Mid, theme.line),
        (roles.Light, theme.surface),
        (roles.Dark, theme.line),
    ):
        palette.setColor(role, QColor(colour))
    disabled = QColor(_mixed(theme.muted, theme.surface, 0.6))
    for role in (roles.WindowText, roles.Text, roles.ButtonText):
        palette.setColor(QPalette.ColorGroup.Disabled, role, disabled)
    return palette


def _mixed(colour: str, other: str, share: float) -> str:
    """Return so much of one colour with the rest of another."""
    a, b = QColor(colour), QColor(other)
    return QColor.fromRgbF(
        share * a.redF() + (1 - share) * b.redF(),
        share * a.greenF() + (1 - share) * b.greenF(),
        share * a.blueF() + (1 - share) * b.blueF(),
    ).name()


# Lengths are device-independent: the desktop's scaling enlarges them with the fonts.
_STYLE = Template("""
QToolTip { background: $surface; color: $text; border: 1px solid $line; padding: 4px; }
QLabel[role="title"] { font-size: 17pt; font-weight: 600; }
QLabel[role="heading"] { font-size: 11pt; font-weight: 600; }
QLabel[role="muted"] { color: $muted; }
QLabel[role="figure"] { font-size: 13pt; font-weight: 600; }
QLabel[role="bad"] { color: $bad; }
QLabel[role="good"] { color: $good; }
QFrame[role="card"] { background: $surface; border: 1px solid $line; border-radius: 8px; }
QFrame[role="bar"] { background: $surface; border: none; border-bottom: 1px solid $line; }
QScrollArea { border: none; background: transparent; }
QScrollArea > QWidget > QWidget[role="page"] { background: transparent; }
QListWidget[role="navigation"] { background: transparent; border: none; outline: none;
  font-size: 11pt; padding: 8px 6px; }
QListWidget[role="navigation"]::item { padding: 9px 12px; border-radius: 6px; margin: 2px 0; color: $text; }
QListWidget[role="navigation"]::item:hover { background: $hover; }
QListWidget[role="navigation"]::item:selected { background: $accent; color: $on_accent; }
QListWidget[role="choices"] { padding: 6px; outline: none; }
QListWidget[role="choices"]::item { padding: 6px 10px; border-radius: 6px; margin: 1px 0; color: $text; }
QListWidget[role="choices"]::item:hover { background: $hover; }
QListWidget[role="choices"]::item:selected { background: $accent; color: $on_accent; }
QPushButton { background: $surface; border: 1px solid $line; border-radius: 6px; padding: 6px 14px; min-height: 18px; }
QPushButton:hover { background: $hover; }
QPushButton:focus { border: 1px solid $accent; }
QPushButton:disabled { background: $window; }
QPushButton[role="primary"] { background: $accent; color: $on_accent; border: 1px solid $accent; font-weight: 600; }
QPushButton[role="primary"]:disabled { background: $line; color: $muted; border-color: $line; }
QPushButton[role="stop"] { background: $bad; color: $on_bad; border: 2px solid $bad; border-radius: 8px;
  font-size: 13pt; font-weight: 700; padding: 8px 22px; }
QPushButton[role="stop"]:focus { border: 2px solid $text; }
QPushButton[role="stop"]:disabled { background: $line; color: $muted; border-color: $line; }
QPushButton[role="flat"] { border: none; background: transparent; color: $accent; padding: 4px 8px; }
QPushButton[role="flat"]:hover { background: $hover; }
QPushButton[role="flat"]:disabled { color: $muted; }
QPushButton[role="flat"]:focus { border: 1px solid $accent; }
QLineEdit, QPlainTextEdit { background: $surface; border: 1px solid $line; border-radius: 5px; padding: 4px 6px;
  min-height: 18px; }
QLineEdit:focus, QPlainTextEdit:focus { border: 1px solid $accent; }
QSpinBox, QDoubleSpinBox, QComboBox { min-height: 24px; }
QAbstractSpinBox QLineEdit { border: none; padding: 0; min-height: 0; background: transparent; }
QWidget[role="side"] { border-right: 1px solid $line; }
QTableView, QTreeView, QListView { background: $surface; border: 1px solid $line; border-radius: 6px; }
QTableView { gridline-color: $line; }
QHeaderView::section { background: $window; color: $muted; border: none; border-bottom: 1px solid $line;
  padding: 5px 8px; font-weight: 600; }
QProgressBar { border: 1px solid $line; border-radius: 5px; background: $window; text-align: center; min-height: 16px; }
QProgressBar::chunk { background: $accent; border-radius: 4px; }
QListView::item { padding: 4px; }
QCheckBox::indicator, QListView::indicator { width: 13px; height: 13px; border: 1px solid $muted; border-radius: 3px;
  background: $surface; }
QCheckBox::indicator:checked, QListView::indicator:checked { background: $accent; border: 1px solid $accent; }
QCheckBox::indicator:disabled { border: 1px solid $line; }
QSplitter::handle { background: $line; }
""")
