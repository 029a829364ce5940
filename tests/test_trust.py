"""What docs/threat-model.md says of code, pages and sockets."""

import ast
import os
import re
import socket
import subprocess
import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

import pytest
from listening import Ear, ears

from daq.bad_input.samples import benchmarks, uniaxial
from daq.cli import main
from estimator.report.page import figure, page
from robot_drivers.abb.egm.guidance import EGMGuidanceSettings, EGMGuidedRobot
from robot_drivers.abb.egm.position_stream import EGMSettings, PositionStream
from robot_drivers.ati.rdt.receiver import DatagramReceiver
from robot_drivers.errors import ConfigurationError
from robot_drivers.interfaces import address_towards, is_loopback

ROOT = Path(__file__).resolve().parents[1]
MODULES = [
    path
    for room in ("robot_drivers", "estimator", "daq", "gui")
    for path in sorted((ROOT / room).rglob("*.py"))
]
RAPID = ROOT / "robot_drivers" / "abb" / "rapid"

linux_only = pytest.mark.skipif(sys.platform != "linux", reason="asks the kernel by /proc")


# ---- what is never done with a file


@cache
def calls() -> list[tuple[str, str, list[ast.keyword]]]:
    """Every call in the rooms: its module, what is called, and with which keywords."""
    return [
        (path.relative_to(ROOT).as_posix(), ast.unparse(node.func), node.keywords)
        for path in MODULES
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call)
    ]


def modules_that_call(*names: str) -> set[str]:
    return {module for module, name, _ in calls() if name in names}


def test_nothing_in_a_file_is_ever_evaluated() -> None:
    assert (
        modules_that_call(
            "eval", "exec", "os.system", "os.popen", "yaml.load", "marshal.loads", "shelve.open"
        )
        == set()
    )
    shells = [module for module, _, keywords in calls() for word in keywords if word.arg == "shell"]
    assert shells == []


def test_the_only_program_that_is_run_from_a_file_is_a_function_of_a_trajectory() -> None:
    found = {
        module for module, name, _ in calls() if name.endswith("exec_module") or name == "runpy.run_path"
    }
    assert found == {"daq/trajectories/own.py"}


def test_pickles_are_read_from_pipes_of_the_own_program_alone() -> None:
    readers = modules_that_call(
        "pickle.load", "pickle.loads", "pickle.Unpickler", "joblib.load", "pandas.read_pickle"
    )
    assert readers == {"daq/acquisition/client.py", "daq/acquisition/process.py"}
    allowed = [word for _, _, keywords in calls() for word in keywords if word.arg == "allow_pickle"]
    assert all(isinstance(word.value, ast.Constant) and word.value.value is False for word in allowed)


def test_xml_is_parsed_where_document_types_are_refused() -> None:
    parsers = {
        module for module, name, _ in calls() if re.search(r"ElementTree\.|minidom|sax\.parse|lxml", name)
    }
    assert parsers == {"estimator/surfaces/formats/vtk_arrays.py"}


# ---- pages


class _References(HTMLParser):
    """Collects what a page would load or run."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.policy = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        told = {name: value or "" for name, value in attrs}
        self.found += [
            told[name] for name in ("src", "href", "xlink:href", "data", "action", "srcset") if name in told
        ]
        self.found += [tag] if tag in ("script", "link", "iframe", "object", "embed", "base") else []
        self.found += [name for name in told if name.startswith("on")]
        if told.get("http-equiv") == "Content-Security-Policy":
            self.policy = told["content"]


def references(text: str) -> tuple[list[str], str]:
    """What a page refers to, but for itself and what is in it, and its policy."""
    reader = _References()
    reader.feed(text)
    urls = re.findall(r"url\(\s*['\"]?([^)'\"]*)", text) + re.findall(r"@import\s+(\S+)", text)
    return [one for one in [*reader.found, *urls] if not one.startswith(("#", "data:"))], reader.policy


def test_the_reader_of_references_sees_what_would_be_loaded() -> None:
    outside = (
        '<img src="http://a/b.png"/><script>x</script><style>a{background:url(//c)}</style><a onclick="f()">'
    )
    assert references(outside)[0] == ["http://a/b.png", "script", "onclick", "//c"]
    assert references('<a href="#here"><img src="data:image/png;base64,AA=="/>')[0] == []


def test_a_browser_is_told_to_load_and_run_nothing() -> None:
    text = page("<script>alert(1)</script>", [figure(lambda sheet: None, (1, 1), '"><img src=http://x>')])
    outside, policy = references(text)
    assert outside == []
    assert "default-src 'none'" in policy
    assert "script-src" not in policy


def test_every_page_is_made_by_the_one_maker_of_pages() -> None:
    makers = {
        path.relative_to(ROOT).as_posix()
        for path in MODULES
        if re.search(r"<html|<head>", path.read_text("utf-8"))
    }
    assert makers - {"daq/bad_input/damage/any_file.py"} == {"estimator/report/page.py"}


def test_pages_of_the_verbs_refer_to_nothing_outside(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    uniaxial.uniaxial(tmp_path)
    record, report = str(tmp_path / "record.csv"), tmp_path / "report"
    assert main(["uniaxial", record, "--law", "neo_hookean", "--output", str(report)]) == 0
    benchmarks.benchmark(tmp_path)
    folders = [str(tmp_path / "answers"), str(tmp_path / "keys")]
    assert main(["benchmark", "score", *folders, "--output", str(report / "score.html")]) == 0
    capsys.readouterr()
    pages = sorted(report.glob("*.html"))
    assert len(pages) == 2
    for one in pages:
        outside, policy = references(one.read_text(encoding="utf-8"))
        assert outside == []
        assert "default-src 'none'" in policy


# ---- sockets


def test_a_stream_without_an_address_is_heard_on_the_loopback() -> None:
    assert EGMSettings().bind_address is None
    assert address_towards("127.0.0.1") == "127.0.0.1"
    assert is_loopback("127.0.0.1")
    assert not is_loopback("0.0.0.0")


@pytest.mark.parametrize("address", ["0.0.0.0", "192.0.2.1"])
def test_a_stream_from_the_network_needs_the_controllers_address(address: str) -> None:
    stream = PositionStream(EGMSettings(port=0, bind_address=address))
    with pytest.raises(ConfigurationError, match="controller_address"):
        stream.open()


@pytest.mark.parametrize("address", ["0.0.0.0", "192.0.2.1"])
def test_a_robot_is_not_guided_from_the_network_by_anybody(address: str) -> None:
    robot = EGMGuidedRobot(EGMGuidanceSettings(egm=EGMSettings(port=0, bind_address=address)))
    with pytest.raises(ConfigurationError, match="controller_address"):
        robot.connect()


@linux_only
def test_sockets_of_the_drivers_are_bound_to_the_interface_of_their_device() -> None:
    program = (
        "import sys\n"
        "from robot_drivers.abb.egm.position_stream import EGMSettings, PositionStream\n"
        "from robot_drivers.ati.rdt.receiver import DatagramReceiver\n"
        "streams = [PositionStream(EGMSettings(port=0)), PositionStream(EGMSettings(0, None, '127.0.0.1'))]\n"
        "[stream.open() for stream in streams]\n"
        "receiver = DatagramReceiver(('127.0.0.1', 49152), frozenset({36}), 0.0)\n"
        "print('open', flush=True)\n"
        "sys.stdin.read()\n"
    )
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=ROOT) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"open\n"
        found = ears(process.pid)
        process.communicate()
    assert {(ear.protocol, ear.address) for ear in found} == {("udp", "127.0.0.1")}
    assert len(found) == 3


@linux_only
def test_the_reader_of_sockets_sees_what_listens_everywhere() -> None:
    with socket.create_server(("", 0)) as server, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as heard:
        heard.bind(("", 0))
        found = ears(os.getpid())
        assert Ear("tcp", "0.0.0.0", server.getsockname()[1]) in found
        assert Ear("udp", "0.0.0.0", heard.getsockname()[1]) in found


def test_a_force_sensor_that_no_network_leads_to_is_not_listened_for() -> None:
    with pytest.raises(OSError):
        DatagramReceiver(("no-such-box.invalid", 49152), frozenset({36}), 0.0)


@pytest.mark.parametrize("module", ["RetractComm.mod", "RetractState.mod"])
def test_the_controller_serves_the_one_client_that_its_installer_named(module: str) -> None:
    text = (RAPID / module).read_text(encoding="utf-8")
    accepting = re.findall(r"SocketAccept listener,client([^;]*);", text)
    assert accepting == [r"\ClientAddress:=clientAddress\Time:=WAIT_MAX"]
    assert re.search(r"IF clientAddress=RT_CLIENT_IP \w+;", text)
    common = (RAPID / "RetractCommon.sys").read_text(encoding="utf-8")
    assert re.search(r'CONST string RT_CLIENT_IP:="[\d.]+";', common)
    assert "SocketBind listener,RT_SERVER_IP,port;" in common
