"""The RAPID source files: they cannot run here, but their form and their numbers can be checked."""

import re
from enum import IntEnum
from pathlib import Path

import pytest

import robot_drivers.abb
from robot_drivers.abb.rapid_socket import frames
from robot_drivers.abb.rapid_socket.codes import Code, Command, ReplyKind, Status

FOLDER = Path(robot_drivers.abb.__file__).parent / "rapid"
MODULES = sorted([*FOLDER.glob("*.mod"), *FOLDER.glob("*.sys")])
BLOCKS = ["MODULE", "PROC", "FUNC", "TRAP", "IF", "WHILE", "FOR", "TEST"]


def code_of(path):
    """The text without comments and without what stands in strings."""
    lines = (line.split("!")[0] for line in path.read_text(encoding="ascii").splitlines())
    return re.sub(r'"[^"\n]*"', '""', "\n".join(lines))


COMMON = code_of(FOLDER / "RetractCommon.sys")
CONSTANTS = {name: float(value) for name, value in re.findall(r"CONST num (\w+):=([-\d.]+);", COMMON)}


@pytest.fixture(params=MODULES, ids=lambda path: path.name)
def module(request):
    return request.param


def test_the_readme_tells_of_every_module():
    readme = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `(\w+\.\w+)` \|", readme, flags=re.MULTILINE)) == {
        path.name for path in MODULES
    }


def test_every_block_is_closed(module):
    code = code_of(module)
    for block in BLOCKS:
        if block == "IF":  # the compact form without THEN has no ENDIF
            opened = len(re.findall(r"(?<!ELSE)\bIF\b[^;]*?\bTHEN\b", code))
        else:
            opened = len(re.findall(rf"\b{block}\b", code))
        assert opened == len(re.findall(rf"\bEND{block}\b", code)), block


def test_names_and_strings_fit_the_controller(module):
    text = module.read_text(encoding="ascii")
    assert all(len(name) <= 32 for name in re.findall(r"\w+", code_of(module)))
    assert all(len(string) <= 80 for string in re.findall(r'"([^"\n]*)"', text))


def test_every_shared_name_is_declared(module):
    declared = set(re.findall(r"\b(?:CONST|PERS|FUNC|PROC)\s+(?:\w+\s+)?(\w+)", COMMON))
    used = set(
        re.findall(
            r"\b(?:rt[A-Z]\w*|RT_\w+|CMD_\w+|REPLY_\w+|CODE_\w+|STATUS_\w+|STATE_FRAME)\b", code_of(module)
        )
    )
    assert used <= declared


@pytest.mark.parametrize(
    ("prefix", "values"), [("CMD_", Command), ("REPLY_", ReplyKind), ("CODE_", Code), ("STATUS_", Status)]
)
def test_the_numbers_on_the_wire_are_those_of_the_driver(prefix, values: type[IntEnum]):
    in_rapid = {
        name.removeprefix(prefix): value for name, value in CONSTANTS.items() if name.startswith(prefix)
    }
    assert in_rapid == {value.name: float(value) for value in values}


def test_the_sizes_are_those_of_the_driver():
    assert CONSTANTS["RT_PROTOCOL_VERSION"] == frames.PROTOCOL_VERSION
    assert CONSTANTS["RT_REQUEST_BYTES"] == len(frames.encode_request(1, Command.MOVE_L))
    assert CONSTANTS["RT_REPLY_BYTES"] == frames.REPLY_BYTES
    assert CONSTANTS["RT_STATE_BYTES"] == frames.STATE_BYTES
    assert CONSTANTS["RT_TEXT_BYTES"] == frames.TEXT_BYTES
    assert CONSTANTS["RT_MOVE_SEQUENCES"] == frames.LARGEST_MOVE_SEQUENCE


def test_the_world_zone_is_larger_than_the_box():
    corners = {
        name: [float(number) for number in value.split(",")]
        for name, value in re.findall(r"CONST pos (\w+):=\[([^\]]*)\];", COMMON)
    }
    assert all(zone < box for zone, box in zip(corners["RT_ZONE_LOW"], corners["RT_BOX_LOW"], strict=True))
    assert all(zone > box for zone, box in zip(corners["RT_ZONE_HIGH"], corners["RT_BOX_HIGH"], strict=True))


def test_no_motion_is_ever_retried(module):
    assert not re.search(r"\bRETRY\b", code_of(module))


def test_one_instruction_moves_the_arm_and_another_lets_the_pc_guide_it():
    moving = {
        path.name: names
        for path in MODULES
        if (names := re.findall(r"\b(Move[ACJLE]\w*|EGMRun\w+|EGMMove\w+)\b", code_of(path)))
    }
    assert moving == {"RetractMotion.mod": ["MoveL"], "RetractGuidance.mod": ["EGMRunPose"]}
