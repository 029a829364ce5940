"""Every command of the documents: understood by its program, and carried out where that takes seconds."""

import re
import shutil
from pathlib import Path

import pytest
from doc_commands import SYSTEM, Command, CommandError, commands, commands_of, understand
from synthetic_session import SyntheticSession

from daq.cli import main
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from robot_drivers.protocols import Pose

COMMANDS = commands()
WHOLE = sorted({command.text for command in COMMANDS if command.whole})

# What is understood but not carried out here, and why: the first pattern that fits.
ONLY_READ = {
    r"(python3|py) run\.py": "sets the project up, or runs the tests that this is one of",
    r"retract demo|retract gui": "the whole chain, or a window: tests/daq/test_demo_virtual_rig.py, tests/gui",
    r"retract (devices|record|calibrate|investigate) .*\b(virtual|lab\.toml)\b": "needs devices, or the whole virtual "
    "rig, which takes a minute to record with: tests/daq/test_demo_virtual_rig.py, tests/daq/test_calibration.py",
    r"retract emulate \w+ (?!--help)|retract emulate (netft|irb140)$": "until Ctrl-C: tests/daq/test_cli_emulate.py",
    r"retract faults (?!--list)": "sessions for minutes or hours: tests/daq/test_faults.py",
    r"retract (simulate|estimate|budget|diagnose|handover|benchmark|study|mesh|phantom) ": "minutes: tests/estimator",
    r"python -m (benchmarks|estimator\.|robot_drivers\.|daq\.|gui\.)": "measures for minutes or hours",
    r"pytest|ruff|mypy": "what runs this test, and what runs beside it",
    r"du ": "measures what is installed",
    r"retract (import|check) ": "reads files that the pages' blocks of Python make: tests/test_docs_python.py, "
    "tests/estimator/test_importing.py",
    r"retract recover ": "damages nothing to recover here: tests/daq/test_recording_damage.py",
    rf"python -m pip|({'|'.join(sorted(SYSTEM))})\b": "changes the computer, or asks for hardware",
}


def reason(text: str) -> str | None:
    return next((why for pattern, why in ONLY_READ.items() if re.match(pattern, text)), None)


@pytest.fixture(scope="module")
def workplace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the documents' commands name."""
    folder = tmp_path_factory.mktemp("workplace")
    phantom = SpringPhantom(GRASP_CENTRE, placed_beads(0))
    steps = [Pose((GRASP_CENTRE[0] + 0.004 * step, *GRASP_CENTRE[1:])) for step in range(2)]
    session = SyntheticSession(steps, phantom).write(folder / "session")
    named = {w for text in WHOLE if reason(text) is None for w in text.split() if "sessions/" in w}
    for name in named:
        shutil.copytree(session, folder / name)
    return folder


def test_there_are_commands_of_every_kind() -> None:
    assert len(WHOLE) > 20
    assert {command.words[0] for command in COMMANDS} >= {"retract", "python", "python3", "pytest"}


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: f"{command.document}: {command.text}")
def test_its_program_understands_a_command(command: Command) -> None:
    understand(command)


@pytest.mark.parametrize("text", [text for text in WHOLE if reason(text) is None])
def test_a_quick_command_does_what_it_says(
    text: str, workplace: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(workplace)
    program, *arguments = Command("", text, whole=True).words
    assert program == "retract", f"{text}: neither quick nor among those that are only read"
    try:
        status = main(arguments)
    except SystemExit as end:  # of --help
        status = end.code
    said = capsys.readouterr()
    assert (status, said.out != "") == (0, True), said.err


def test_every_reason_not_to_carry_a_command_out_is_still_needed() -> None:
    unneeded = [p for p, why in ONLY_READ.items() if not any(reason(text) == why for text in WHOLE)]
    assert unneeded == []


@pytest.mark.parametrize(
    ("text", "mistake"),
    [
        ("    retract recrod virtual\n", "invalid choice: 'recrod'"),
        ("    retract record virtual --trajektory pull\n", "unrecognized arguments: --trajektory"),
        ("    retract export sessions/a\n", "arguments are required: --output"),
        ("```sh\npython -m daq.nowhere\n```\n", "no such module"),
        ("Type `retract gui --colour red`.\n", "unrecognized arguments: --colour"),
        ("    pytest tests/nowhere\n", "no such test"),
    ],
)
def test_a_wrong_command_would_be_found(text: str, mistake: str) -> None:
    (command,) = commands_of(text, "a document")
    with pytest.raises(CommandError, match=re.escape(mistake)):
        understand(command)


def test_what_is_no_command_is_left_alone() -> None:
    text = "    σ = μ (F Fᵀ − 1)\n\nThe verb `retract record`, and `benchmark make\\|run`.\n"
    assert [(c.text, c.whole) for c in commands_of(text, "a document")] == [("retract record", False)]
