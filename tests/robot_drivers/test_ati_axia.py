"""The Ethernet Axia: its emulator over plain sockets, and the driver in the face of its settings and faults."""

import socket
import struct
from contextlib import contextmanager
from urllib.request import urlopen

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rdt_sensors import axia
from sensor_blocks import first_block, gathered, read_for

from robot_drivers.ati.axia.configuration import read_configuration
from robot_drivers.ati.emulator import AxiaEmulator, AxiaEmulatorSettings, Faults
from robot_drivers.ati.rdt.configuration import set_rdt_rate
from robot_drivers.ati.rdt.web import WebPages
from robot_drivers.errors import ConfigurationError, DeviceProtocolError, DeviceTimeoutError

LOAD = np.array([10.0, -20.0, 30.0, 0.1, -0.2, 0.3])
M20 = (500.0, 500.0, 900.0, 20.0, 20.0, 20.0)


@contextmanager
def connected(source=lambda _: LOAD, emulated=None, **settings):
    with axia(source, emulated, **settings) as (emulator, sensor):
        sensor.connect()
        yield emulator, sensor


@contextmanager
def streaming(source=lambda _: LOAD, emulated=None, **settings):
    with connected(source, emulated, **settings) as (emulator, sensor):
        sensor.start()
        yield emulator, sensor


# ---- the emulator, met over plain sockets


@contextmanager
def client(source=lambda _: LOAD, **settings):
    with (
        AxiaEmulator(source, AxiaEmulatorSettings(**settings)) as emulator,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plain,
    ):
        plain.settimeout(30.0)
        plain.connect(("127.0.0.1", emulator.rdt_port))
        yield emulator, plain


def records_of(plain, count):
    found = []
    while len(found) < count:
        found += struct.iter_unpack(">III6i", plain.recv(2000))
    return found


@pytest.mark.parametrize(("code", "size"), [(1, 36), (2, 36), (3, 360)])
def test_each_start_of_the_manuals_table_streams_from_1(code, size):
    with client() as (_, plain):
        plain.send(struct.pack(">HHI", 0x1234, code, 0))
        datagram = plain.recv(2000)
    assert len(datagram) == size
    assert struct.unpack_from(">I", datagram) == (1,)


@pytest.mark.parametrize("request_", [struct.pack(">HHI", 0x1234, 0x41, 0), b"\x124\x80\x02" + bytes(10)])
def test_commands_of_a_net_ft_box_that_the_axia_lacks_do_nothing(request_):
    with client() as (emulator, plain):
        emulator.latch_monitor_condition()
        plain.send(request_)
        plain.send(struct.pack(">HHI", 0x1234, 2, 1))
        (record,) = records_of(plain, 1)
    assert record[2] == 0x0001_0000


def test_a_data_rate_beyond_the_sample_rate_repeats_samples():
    with client(sample_rate_hz=488, rate_hz=4000) as (_, plain):
        plain.send(struct.pack(">HHI", 0x1234, 2, 100))
        found = records_of(plain, 100)
    sequence = [record[1] for record in found]
    assert [record[0] for record in found] == list(range(1, 101))
    assert 10 <= len(set(sequence)) <= 15
    assert sequence == sorted(sequence)


# The examples of 9610-05-Ethernet Axia-09, table 4.8, and 9620-05-C-Ethernet Axia-02, table 5.8
@pytest.mark.parametrize(
    ("rated", "load", "out"),
    [
        (M20, (87.5, -151.6, -500.0, 1.0, 2.0, -17.5), True),
        ((1000, 1000, 2000, 50, 50, 50), (170.5, -300.6, -1400.0, 1.0, 2.0, -45.5), True),
        (M20, (87.5, -151.6, -500.0, 1.0, 2.0, -13.9), False),
        (M20, (0, 0, 944.0, 0, 0, 0), False),
        (M20, (0, 0, 946.0, 0, 0, 0), True),
    ],
)
def test_the_range_ends_where_the_manuals_examples_say(rated, load, out):
    with client(lambda _: np.array(load), rated_wrench=rated) as (_, plain):
        plain.send(struct.pack(">HHI", 0x1234, 2, 1))
        (record,) = records_of(plain, 1)
    assert record[2] == (0xC000_0000 if out else 0)


def test_an_overload_is_told_for_32_samples_after_it():
    bump = np.array([600.0, 0, 0, 0, 0, 0])
    with client(
        lambda time_s: bump if 0.3 < time_s < 0.5 else 0 * bump,
        sample_rate_hz=976,
        rate_hz=976,
        burst_s=1e-3,
        noise_std=(0.0,) * 6,
    ) as (_, plain):
        plain.send(struct.pack(">HHI", 0x1234, 2, 976))
        found = records_of(plain, 976)
    told = [record[1] for record in found if record[2]]
    beyond = [record[1] for record in found if record[3] > 525e6]
    assert (told[0], told[-1]) == (beyond[0], beyond[-1] + 32)


def test_its_pages_tell_counts_range_and_rates():
    with client() as (emulator, _):
        url = f"http://127.0.0.1:{emulator.http_port}"
        page = urlopen(f"{url}/netftapi2.xml").read().decode()
        calibration = urlopen(f"{url}/netftcalapi.xml?index=0").read().decode()
    assert "<cfgcpf>1000000</cfgcpf>" in page
    assert "<setrate>3906</setrate>" in page
    assert "<calmr>500;500;900;20;20;20</calmr>" in calibration


# ---- the driver


def test_the_sensor_tells_its_range_its_calibration_and_its_clock():
    with connected() as (_, sensor):
        identity = sensor.identity
    assert (identity.model, identity.serial) == ("Ethernet Axia", "FT00001")
    assert identity.details["calibration"] == "0: SI-500-20"
    assert identity.details["rated wrench"] == "500, 500, 900, 20, 20, 20"
    assert identity.details["sample rate"] == "3906 Hz"


@pytest.mark.parametrize("mode", ["real-time", "buffered"])
@pytest.mark.parametrize(("sample_rate_hz", "rate_hz"), [(488, 488), (976, 500), (3906, 1000), (7812, 7000)])
def test_the_clock_is_the_rate_of_sampling(sample_rate_hz, rate_hz, mode):
    emulated = AxiaEmulatorSettings(sample_rate_hz=sample_rate_hz, rate_hz=rate_hz, buffer_size=4)
    with streaming(emulated=emulated, mode=mode) as (_, sensor):
        blocks = read_for(sensor, 0.3)
        assert sensor.statistics().lost == 0
    times = gathered(blocks, "device_time_s")
    assert (times[-1] - times[0]) / (len(times) - 1) == pytest.approx(1 / rate_hz, rel=0.02)
    np.testing.assert_allclose(gathered(blocks, "wrench").mean(axis=0), LOAD, atol=0.01)


def test_a_stated_rate_of_sampling_takes_the_place_of_the_told_one():
    with streaming(sample_rate_hz=1953.0) as (_, sensor):
        assert sensor.identity.details["sample rate"] == "1953 Hz"
        times = gathered(read_for(sensor, 0.2), "device_time_s")
    assert np.median(np.diff(times)) == pytest.approx(4 / 1953)


def test_records_that_would_come_twice_are_refused():
    emulated = AxiaEmulatorSettings(sample_rate_hz=488, rate_hz=1000)
    with pytest.raises(ConfigurationError, match="samples 488 times and sends 1000 records"):
        connected(emulated=emulated).__enter__()
    with streaming(emulated=emulated, rate_hz=400) as (_, sensor):
        assert sensor.identity.details["RDT rate"] == "400 Hz"
        assert (np.diff(gathered(read_for(sensor, 0.2), "device_time_s")) > 0).all()


def test_rdt_that_is_off_is_told():
    with pytest.raises(ConfigurationError, match="RDT is off"):
        connected(emulated=AxiaEmulatorSettings(rdt_enabled=False)).__enter__()


def test_a_sensor_that_sends_nothing_is_told():
    with connected(start_timeout_s=0.3) as (emulator, sensor):
        emulator.inject(Faults(unplug_at_s=0.0, unplug_for_s=60.0))
        with pytest.raises(DeviceTimeoutError, match="no RDT record"):
            sensor.start()


def test_a_load_beyond_the_range_and_gages_at_their_end_are_not_usable():
    with streaming(lambda _: np.array([0, 0, 990.0, 0, 0, 0])) as (_, sensor):
        assert not sensor.read(5.0).usable.any()
    with streaming() as (emulator, sensor):
        emulator.inject(Faults(saturated=True))
        block = first_block(sensor, lambda block: block.status.all())
        assert not block.usable.any()
        words = " ".join(sensor.describe_status(int(block.status[-1])))
        assert "broken gage" in words
        assert "out of range" in words


def test_a_stated_range_takes_the_place_of_the_told_one():
    with streaming(rated_wrench=(15.0, 15.0, 100.0, 1.0, 1.0, 1.0)) as (_, sensor):
        assert not sensor.read(5.0).usable.any()


@pytest.mark.parametrize(("status", "usable"), [(0x8, False), (0x1_0000, True), (0x8800_0000, False)])
def test_a_status_forbids_the_sample_or_does_not(status, usable):
    with streaming() as (emulator, sensor):
        emulator.inject(Faults(status=status))
        assert first_block(sensor, lambda block: block.status.all()).usable.all() == usable


def test_a_bias_is_explicit_and_the_stream_goes_on():
    with streaming() as (_, sensor):
        before = first_block(sensor).wrench.mean(axis=0)
        sensor.set_bias()
        first_block(sensor, lambda block: np.abs(block.wrench).max() < 1.0)
        assert sensor.statistics().restarts == 1
    np.testing.assert_allclose(before, LOAD, atol=0.1)


def test_what_the_link_does_is_counted_exactly():
    with streaming() as (emulator, sensor):
        emulator.inject(Faults(loss=0.1, duplication=0.1, rubbish=0.1, truncation=0.05))
        blocks = read_for(sensor, 0.5)
        emulator.inject(Faults())
        first_block(
            sensor,
            lambda _: sensor.statistics().received == emulator.counts.records - emulator.counts.dropped,
        )
        found = sensor.statistics()
        assert found.lost == emulator.counts.dropped > 0
    assert np.abs(gathered(blocks, "wrench") - LOAD).max() < 0.2


def test_a_sensor_that_lost_power_is_asked_to_stream_again():
    with streaming(silence_s=0.1) as (emulator, sensor):
        first_block(sensor)
        emulator.inject(Faults(restart_at_s=0.0, restart_for_s=0.3))
        first_block(sensor, lambda _: sensor.statistics().restarts == 1)


# ---- its pages


def page(**tags):
    complete = {
        "setrate": 976,
        "cfgcalsel": 0,
        "cfgcpf": 1000000,
        "cfgcpt": 1000000,
        "scfgfu": "N",
        "scfgtu": "Nm",
        "comrdtrate": 500,
    }
    return xml("netft", complete | tags)


def calibration(**tags):
    complete = {"calsn": "FT1", "calpn": "SI-75-4", "scalfu": "N", "scaltu": "Nm", "calmr": "75;75;235;4;4;4"}
    return xml("netftCalibration", complete | tags)


def xml(root, tags):
    body = "".join(f"<{tag}>{value}</{tag}>" for tag, value in tags.items() if value is not None)
    return f"<{root}>{body}</{root}>".encode()


class CannedPages(WebPages):
    """Pages without a network, which remember what was asked for."""

    def __init__(self, configuration, of_calibration=None):
        self.configuration, self.of_calibration, self.asked = (
            configuration,
            of_calibration or calibration(),
            [],
        )

    def page(self, path):
        self.asked.append(path)
        return self.configuration if path.startswith("/netftapi2") else self.of_calibration

    def submit(self, path):
        self.asked.append(path)


def test_the_page_of_the_calibration_in_force_is_read():
    pages = CannedPages(page(cfgcalsel=1))
    assert read_configuration(pages).rated_wrench == (75, 75, 235, 4, 4, 4)
    assert pages.asked == ["/netftapi2.xml", "/netftcalapi.xml?index=1"]


@pytest.mark.parametrize("separator", [";", ",", " ", "; "])
def test_a_range_comes_in_units_of_its_calibration_and_with_any_separator(separator):
    told = calibration(
        scalfu="lbf", scaltu="lbf-in", calmr=separator.join(["10", "10", "20", "30", "30", "40"])
    )
    rated = read_configuration(CannedPages(page(), told)).rated_wrench
    np.testing.assert_allclose(rated[:3], np.array([10, 10, 20]) * 4.4482216152605, rtol=1e-12)
    np.testing.assert_allclose(rated[3:], np.array([30, 30, 40]) * 0.1129848290276167, rtol=1e-12)


@pytest.mark.parametrize(
    "told", ["75;75;235;4;4", "75;75;0;4;4;4", "75;75;-1;4;4;4", "a;b;c;d;e;f", "", "1;1;1;1;1;inf"]
)
def test_a_range_that_is_none_is_refused(told):
    with pytest.raises(DeviceProtocolError, match="calmr"):
        read_configuration(CannedPages(page(), calibration(calmr=told)))


@pytest.mark.parametrize("missing", ["calmr", "scalfu", "scaltu"])
def test_a_range_is_known_only_with_its_units(missing):
    assert read_configuration(CannedPages(page(), calibration(**{missing: None}))).rated_wrench is None


@pytest.mark.parametrize("told", [None, 0, 3, 7000])
def test_a_rate_of_sampling_that_no_axia_has_is_not_believed(told):
    assert read_configuration(CannedPages(page(setrate=told))).sample_rate_hz is None


def test_what_the_sensor_does_not_tell_is_asked_of_the_rig_file():
    with pytest.raises(ConfigurationError, match="set sample_rate_hz"):
        connected(emulated=AxiaEmulatorSettings(sample_rate_hz=7000)).__enter__()
    silent = AxiaEmulatorSettings(tells_range=False)
    with pytest.raises(ConfigurationError, match="set rated_wrench"):
        connected(emulated=silent).__enter__()
    with streaming(emulated=silent, rated_wrench=M20) as (_, sensor):
        assert sensor.read(5.0).usable.all()


@pytest.mark.parametrize("tag", ["comrdtrate", "commrdtrate"])
def test_both_spellings_of_the_rate_are_understood(tag):
    told = page(**{"comrdtrate": None, tag: 50})
    assert read_configuration(CannedPages(told)).rdt_rate_hz == 50


def test_a_rate_is_set_by_the_cgi_and_has_to_be_kept():
    pages = CannedPages(page(comrdtrate=250))
    set_rdt_rate(pages, 250, fastest_hz=7912)
    assert pages.asked[0] == "/comm.cgi?comrdtrate=250"
    with pytest.raises(ConfigurationError, match="kept 250"):
        set_rdt_rate(pages, 300, fastest_hz=7912)
    with pytest.raises(ConfigurationError, match=r"1\.\.7912"):
        set_rdt_rate(pages, 7913, fastest_hz=7912)


def test_pages_of_two_calibrations_are_not_mixed():
    with pytest.raises(DeviceProtocolError, match="FT2"):
        read_configuration(CannedPages(page(cfgcalsn="FT2")))


@given(st.binary(max_size=300))
def test_any_bytes_are_a_configuration_or_a_protocol_error(content):
    with pytest.raises(DeviceProtocolError):
        read_configuration(CannedPages(content))
