"""Reading a Net F/T box's web pages: the active configuration, and pages that want to do harm."""

import threading
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, HTTPServer

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_drivers.ati.emulator import BoxConfiguration, EmulatorSettings, NetFTEmulator
from robot_drivers.ati.netft.configuration import read_configuration
from robot_drivers.ati.rdt.configuration import set_rdt_rate
from robot_drivers.ati.rdt.web import MAX_PAGE_BYTES, WebPages, parse_tags
from robot_drivers.ati.transducer.scaling import Scaling
from robot_drivers.errors import ConfigurationError, DeviceProtocolError, DeviceUnreachableError

NEWTON_MILLIMETRES = BoxConfiguration(
    name="fine",
    force_unit="lbf",
    torque_unit="N-mm",
    newtons=4.4482216152605,
    newton_metres=1e-3,
    force_code=1,
    torque_code=4,
    counts_per_force=4448221.615,
    counts_per_torque=999.999,
)


def pages(port, pause_s=0.0):
    return WebPages("127.0.0.1", port, timeout_s=2.0, pause_s=pause_s)


def page(**tags):
    complete = {"setcfgsel": 0, "cfgcpf": 1000000, "cfgcpt": 1000000, "scfgfu": "N", "scfgtu": "N-m"} | tags
    body = "".join(f"<{tag}>{value}</{tag}>" for tag, value in complete.items() if value is not None)
    return f"<?xml version='1.0'?><netft>{body}</netft>".encode()


@contextmanager
def web_server(answers):
    """Serve literal (status, body) pairs by path."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            status, body = answers.get(self.path, (404, b""))
            self.send_response(status)
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_):
            pass

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        try:
            yield server.server_port
        finally:
            server.shutdown()
            thread.join()


class CannedPages:
    """Pages without a network."""

    def __init__(self, bodies):
        self._bodies = bodies

    def page(self, path):
        return self._bodies[path]


def read(first_page, index=None, **more):
    return read_configuration(CannedPages({"/netftapi2.xml?index=0": first_page} | more), index)


def test_the_factors_of_the_active_configuration_are_used_not_those_of_the_first_or_of_the_calibration():
    box = EmulatorSettings(
        configurations=(BoxConfiguration(), NEWTON_MILLIMETRES),
        active_configuration=1,
        calibration_counts=(123.0, 456.0),
    )
    with NetFTEmulator(lambda _: np.zeros(6), box) as emulator:
        configuration = read_configuration(pages(emulator.http_port))
    assert configuration.index == 1
    assert configuration.name == "fine"
    assert configuration.scaling == Scaling("lbf", "N-mm", 4448221.615, 999.999)
    np.testing.assert_allclose(configuration.scaling.si_per_count, [1e-6] * 3 + [1.000001e-6] * 3, rtol=1e-9)
    assert configuration.serial == "FT33206"
    assert configuration.rdt_enabled
    assert configuration.rdt_rate_hz == 1000
    assert configuration.rdt_buffer_size == 10


def test_the_rate_is_set_and_read_back():
    with NetFTEmulator(lambda _: np.zeros(6)) as emulator:
        set_rdt_rate(pages(emulator.http_port), 500, fastest_hz=7000)
        assert read_configuration(pages(emulator.http_port)).rdt_rate_hz == 500


def test_a_rate_that_the_box_did_not_keep_is_an_error():
    answers = {"/comm.cgi?comrdtrate=900": (302, b""), "/netftapi2.xml": (200, page(comrdtrate=875))}
    with web_server(answers) as port, pytest.raises(ConfigurationError, match=r"900 Hz .* kept 875"):
        set_rdt_rate(pages(port), 900, fastest_hz=7000)


def test_a_refused_setting_is_an_error():
    with web_server({}) as port, pytest.raises(DeviceProtocolError, match="404"):
        set_rdt_rate(pages(port), 900, fastest_hz=7000)


@pytest.mark.parametrize("rate", [0, 7001])
def test_a_rate_out_of_range_is_not_even_sent(rate):
    with pytest.raises(ConfigurationError, match=r"1\.\.7000"):
        set_rdt_rate(pages(port=9), rate, fastest_hz=7000)


def test_requests_keep_the_distance_that_the_box_needs():
    box = EmulatorSettings(
        active_configuration=1, configurations=(BoxConfiguration(),) * 2, min_request_interval_s=0.1
    )
    with NetFTEmulator(lambda _: np.zeros(6), box) as emulator:
        assert read_configuration(pages(emulator.http_port, pause_s=0.15)).index == 1
        with pytest.raises(DeviceProtocolError):
            read_configuration(pages(emulator.http_port))


def test_a_box_that_does_not_tell_its_active_configuration_needs_the_index_from_the_user():
    with pytest.raises(ConfigurationError, match="configuration_index"):
        read(page(setcfgsel=None))
    assert read(page(setcfgsel=None), index=0).index == 0


def test_an_index_that_contradicts_the_box_is_an_error():
    with pytest.raises(ConfigurationError, match="uses 0"):
        read(page(), index=2)


def test_a_configuration_that_changes_while_it_is_read_is_noticed():
    with pytest.raises(DeviceProtocolError, match="changed"):
        read(page(setcfgsel=1), **{"/netftapi2.xml?index=1": page(setcfgsel=2)})


@pytest.mark.parametrize(
    "value", ["0", "-1", "NaN", "inf", "1e999", "", "1,000", "1_000", "0x10", "abc", "1 2"]
)
@pytest.mark.parametrize("tag", ["cfgcpf", "cfgcpt"])
def test_counts_that_are_no_positive_number_are_refused(tag, value):
    with pytest.raises(DeviceProtocolError):
        read(page(**{tag: value}))


@pytest.mark.parametrize("tag", ["cfgcpf", "cfgcpt", "scfgfu", "scfgtu"])
def test_a_missing_factor_or_unit_is_refused(tag):
    with pytest.raises(DeviceProtocolError, match=tag):
        read(page(**{tag: None}))


@pytest.mark.parametrize(
    ("force", "newtons"),
    [
        ("lbf", 4.4482216152605),
        ("N", 1),
        ("klbf", 4448.2216152605),
        ("kN", 1000),
        ("kgf", 9.80665),
        ("gf", 9.80665e-3),
        ("g", 9.80665e-3),
    ],
)
def test_every_force_unit_is_carried_to_newtons(force, newtons):
    factors = read(page(scfgfu=force, cfgcpf=100)).scaling.si_per_count
    np.testing.assert_allclose(factors[:3], newtons / 100, rtol=1e-12)


@pytest.mark.parametrize(
    ("torque", "newton_metres"),
    [
        ("lbf-in", 0.1129848290276167),
        ("lbf-ft", 1.3558179483314004),
        ("N-m", 1),
        ("Nm", 1),
        ("N-mm", 1e-3),
        ("Nmm", 1e-3),
        ("kgf-cm", 0.0980665),
        ("kg-cm", 0.0980665),
        ("kN-m", 1000),
    ],
)
def test_every_torque_unit_is_carried_to_newton_metres(torque, newton_metres):
    factors = read(page(scfgtu=torque, cfgcpt=100)).scaling.si_per_count
    np.testing.assert_allclose(factors[3:], newton_metres / 100, rtol=1e-12)


@pytest.mark.parametrize("tags", [{"scfgfu": "dyn"}, {"scfgtu": "N"}, {"scfgfu": ""}])
def test_an_unknown_unit_is_refused(tags):
    with pytest.raises(DeviceProtocolError, match="unit"):
        read(page(**tags))


BILLION_LAUGHS = (
    b'<!DOCTYPE netft [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
    b"<netft><cfgcpf>&b;</cfgcpf></netft>"
)
EXTERNAL = b'<!DOCTYPE netft [<!ENTITY x SYSTEM "file:///etc/passwd">]><netft><cfgnam>&x;</cfgnam></netft>'


@pytest.mark.parametrize("harmful", [BILLION_LAUGHS, EXTERNAL, EXTERNAL.decode().encode("utf-16")])
def test_a_page_with_a_document_type_is_refused(harmful):
    with pytest.raises(DeviceProtocolError, match="document type"):
        read(harmful)


def test_a_page_that_is_too_large_is_refused():
    answers = {"/netftapi2.xml?index=0": (200, page(cfgnam="x" * MAX_PAGE_BYTES))}
    with web_server(answers) as port, pytest.raises(DeviceProtocolError, match="larger"):
        read_configuration(pages(port))


@pytest.mark.parametrize(
    "broken",
    [
        b"",
        b"<html><body>ATI</body></html>",
        b"<netft><cfgcpf>1</netft>",
        page()[:-9],
        b"<netft><cfgcpf>1</cfgcpf><cfgcpf>2</cfgcpf></netft>",
        b"<?xml version='1.0' encoding='martian'?><netft/>",
    ],
)
def test_a_page_that_is_not_the_sensors_is_refused(broken):
    with pytest.raises(DeviceProtocolError):
        read(broken)


def test_a_page_that_is_missing_is_told_with_its_address():
    with web_server({}) as port, pytest.raises(DeviceProtocolError, match=f":{port}/netftapi2.xml"):
        read_configuration(pages(port))


def test_a_closed_port_is_unreachable():
    with web_server({}) as port:
        pass
    with pytest.raises(DeviceUnreachableError, match=str(port)):
        read_configuration(pages(port))


def test_older_firmware_with_another_root_is_understood():
    old = page().replace(b"<netft>", b"<netFTApi>").replace(b"</netft>", b"</netFTApi>")
    assert read(old).scaling == Scaling()


@given(st.binary(max_size=300))
def test_any_bytes_are_tags_or_a_protocol_error(content):
    with suppress(DeviceProtocolError):
        assert all(parse_tags(content, ("netft",)))


@given(
    st.text(st.characters(codec="utf-8", exclude_characters="<&\r", exclude_categories=["Cc"]), max_size=50)
)
def test_the_text_of_a_tag_is_read_as_written(text):
    content = f"<netft><group><cfgnam>{text}</cfgnam></group><empty/></netft>".encode()
    try:
        tags = parse_tags(content, ("netft",))
    except DeviceProtocolError:  # some characters are not allowed in XML
        return
    assert tags == {"cfgnam": text.strip(), "empty": ""}


@given(st.floats().map(str) | st.text("0123456789.eE+-_ ", max_size=12))
def test_counts_are_the_number_that_the_page_shows_or_refused(text):
    try:
        counts = read(page(cfgcpf=text)).scaling.counts_per_force
    except DeviceProtocolError:
        return
    assert counts == float(text)
    assert 0 < counts < np.inf
