"""The emulated Net F/T box, met over plain sockets and read with a decoder of this file's own."""

import socket
import struct
import threading
import time
from contextlib import closing, contextmanager

import numpy as np
import pytest
from new_threads import new_threads

from robot_drivers.ati.emulator import BoxConfiguration, EmulatorSettings, Faults, NetFTEmulator
from robot_drivers.clock import host_time_ns

LOAD = np.array([1.0, -2.0, 3.5, 0.0001, -0.0002, -0.000001])
QUIET = (0.0,) * 6
PATIENCE_S = 30.0
START_BUFFERED = "12340003"
START, STOP, BIAS, LATCH = "12340002", "12340000", "12340042", "12340041"


def request(code, sample_count=0):
    return bytes.fromhex(code) + struct.pack(">I", sample_count)


class Client:
    """A client written from the tables of the manual."""

    def __init__(self, emulator):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(PATIENCE_S)
        self.socket.connect(("127.0.0.1", emulator.rdt_port))

    def close(self):
        self.socket.close()

    def send(self, code, sample_count=0):
        self.socket.send(request(code, sample_count))

    def datagram(self):
        return self.socket.recv(2000)

    def records(self, n):
        """Read n records as (rdt_sequence, ft_sequence, status, six counts)."""
        found = []
        while len(found) < n:
            content = self.datagram()
            for start in range(0, len(content), 36):
                rdt, ft, status, *counts = struct.unpack(">IIIiiiiii", content[start : start + 36])
                found.append((rdt, ft, status, counts))
        return found[:n]

    def read_on(self, seconds):
        """Take what comes in that time."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.socket.recv(2000)

    def falls_silent(self, within_s=PATIENCE_S):
        """Read on; tell whether nothing comes for a fifth of a second, before the time is over."""
        end = time.monotonic() + within_s
        self.socket.settimeout(0.2)
        try:
            while time.monotonic() < end:
                self.socket.recv(2000)
        except TimeoutError:
            return True
        finally:
            self.socket.settimeout(PATIENCE_S)
        return False

    def first_record_of_new_stream(self):
        """Read on to the record with number 1."""
        while (record := self.records(1)[0])[0] != 1:
            pass
        return record


@contextmanager
def box(source=lambda _: LOAD, **settings):
    with (
        NetFTEmulator(source, EmulatorSettings(**({"noise_std": QUIET} | settings))) as emulator,
        closing(Client(emulator)) as client,
    ):
        yield emulator, client


def test_a_record_has_the_bytes_of_the_manual():
    with box() as (_, client):
        client.send(START)
        datagram = client.datagram()
    assert datagram[:4] == bytes.fromhex("00000001")
    assert datagram[8:] == bytes.fromhex("00000000 000F4240 FFE17B80 003567E0 00000064 FFFFFF38 FFFFFFFF")


@pytest.mark.parametrize(("rate_hz", "ticks"), [(7000, {1}), (1000, {7}), (3500, {2}), (900, {7, 8})])
def test_the_internal_counter_runs_at_7_khz_whatever_the_output_rate(rate_hz, ticks):
    with box(rate_hz=rate_hz) as (_, client):
        client.send(START)
        records = client.records(50)
    assert [rdt for rdt, *_ in records] == list(range(1, 51))
    assert set(np.diff([ft for _, ft, *_ in records])) == ticks


@pytest.mark.parametrize("rate_hz", [500, 7000])
def test_the_average_rate_holds_on_the_host_clock(rate_hz):
    with box(rate_hz=rate_hz) as (emulator, client):
        begin = time.monotonic()
        client.send(START)
        share = 0.0
        # a busy machine starts late and sends late, but in the end it has sent all
        while share < 0.95:
            client.read_on(0.2)
            records, elapsed = emulator.counts.records, time.monotonic() - begin
            share = records / (elapsed * rate_hz)
            assert records <= elapsed * rate_hz + 1
            assert elapsed < PATIENCE_S


def test_a_backlog_is_caught_up():
    gate = threading.Event()
    gate.set()

    def source(_):
        gate.wait()
        return LOAD

    with box(source, rate_hz=7000) as (emulator, client):
        client.send(START)
        client.records(10)
        gate.clear()
        time.sleep(0.2)
        before = emulator.counts.records
        gate.set()
        begin = time.monotonic()
        missed = round(0.2 * 7000)
        while emulator.counts.records - before < (time.monotonic() - begin) * 7000 + missed - 100:
            assert time.monotonic() - begin < PATIENCE_S
            time.sleep(0.001)


def test_a_buffered_stream_packs_records_back_to_back():
    with box(buffer_size=40) as (_, client):
        client.send(START_BUFFERED)
        assert len(client.datagram()) == 40 * 36
        assert [rdt for rdt, *_ in client.records(40)] == list(range(41, 81))


@pytest.mark.parametrize(("command", "sizes"), [("12340002", [1] * 7), ("12340003", [3, 3, 1])])
def test_a_limited_stream_ends_by_itself(command, sizes):
    with box(buffer_size=3) as (_, client):
        client.send(command, 7)
        assert [len(client.datagram()) // 36 for _ in sizes] == sizes
        assert client.falls_silent()


def test_a_stream_runs_until_it_is_stopped_and_starts_again_at_1():
    with box() as (_, client):
        client.send(START)
        client.records(5)
        client.send(STOP)
        assert client.falls_silent()
        client.send(START)
        assert client.records(1)[0][0] == 1


def test_one_client_at_a_time_the_latest():
    with box() as (emulator, first), closing(Client(emulator)) as second:
        first.send(START)
        first.records(5)
        second.send(START)
        assert second.records(2)[0][0] == 1
        assert first.falls_silent()


@pytest.mark.parametrize(
    "request_hex", ["", "1234", "43210002 00000000", "12340002 000000", "1234FFFF 00000000"]
)
def test_a_request_that_is_none_is_ignored(request_hex):
    with box() as (_, client):
        client.socket.send(bytes.fromhex(request_hex))
        assert client.falls_silent()


@pytest.mark.parametrize("stops", [True, False])
def test_a_bias_takes_the_present_load_away_and_ends_the_stream_or_not(stops):
    with box(bias_stops_stream=stops) as (_, client):
        client.send(START)
        client.records(3)
        client.send(BIAS)
        assert client.falls_silent(within_s=0.4) == stops
        client.send(START)
        assert client.first_record_of_new_stream()[3] == [0] * 6


def test_a_latch_is_a_status_until_it_is_reset():
    with box() as (emulator, client):
        emulator.latch_monitor_condition()
        client.send(START)
        assert client.records(1)[0][2] == 0x80010000
        client.send(LATCH)
        client.send(START)
        assert client.first_record_of_new_stream()[2] == 0


def test_counts_follow_the_units_of_the_active_configuration():
    pounds = BoxConfiguration(
        newtons=4.4482216152605, newton_metres=1e-3, counts_per_force=1000, counts_per_torque=999.999
    )
    with box(lambda _: np.array([4.4482216152605, 0, 0, 0, 0, 2.0]), configurations=(pounds,)) as (_, client):
        client.send(START)
        assert client.records(1)[0][3] == [1000, 0, 0, 0, 0, 1999998]


def test_the_noise_is_white_of_the_given_size_and_repeats_with_its_seed():
    runs = []
    for _ in range(2):
        noise = {"noise_std": (0.006,) * 3 + (3e-4,) * 3, "seed": 5}
        with box(rate_hz=7000, buffer_size=40, **noise) as (_, client):
            client.send(START_BUFFERED, 2000)  # as few datagrams as a socket holds while nobody reads
            runs.append(np.array([counts for *_, counts in client.records(2000)]) - 1e6 * LOAD)
    np.testing.assert_allclose(runs[0].std(axis=0), [6000] * 3 + [300] * 3, rtol=0.1)
    assert abs(np.corrcoef(runs[0][1:, 0], runs[0][:-1, 0])[0, 1]) < 0.1
    np.testing.assert_array_equal(runs[0], runs[1])


def test_the_source_is_asked_for_device_time_never_ahead_and_interpolated_between():
    asked, asked_at_ns = [], []

    def ramp(time_s):
        asked.append(time_s)
        asked_at_ns.append(host_time_ns())
        return np.array([time_s, 0, 0, 0, 0, 0])

    with box(ramp, rate_hz=7000, burst_s=0.01, buffer_size=40) as (emulator, client):
        client.send(START_BUFFERED, 2000)
        records = client.records(2000)
    assert (asked <= (np.array(asked_at_ns) - emulator.epoch_ns) * 1e-9).all()
    seconds = np.array([ft for _, ft, *_ in records]) / 7000
    np.testing.assert_allclose([counts[0] * 1e-6 for *_, counts in records], seconds, atol=1e-6)
    assert len(asked) < 150
    assert asked == sorted(asked)


def test_a_load_that_no_gage_can_follow_saturates():
    with box(lambda _: np.array([0, 0, 900.0, 0, 0, 0])) as (_, client):
        client.send(START)
        (_, _, status, counts) = client.records(1)[0]
    assert status == 0x80020000
    assert 700e6 < counts[2] < 800e6  # 400 N take 17 546 of 32 767 gage counts


def test_a_fault_of_the_gages_is_in_the_status():
    with box() as (emulator, client):
        emulator.inject(Faults(saturated=True, status=0x200))
        client.send(START)
        assert client.records(1)[0][2] == 0x80020200


def test_a_drift_grows_with_time():
    with box() as (emulator, client):
        emulator.inject(Faults(drift_per_s=(10.0, 0, 0, 0, 0, 0)))
        client.send(START)
        records = client.records(200)
    force, seconds = np.array([(counts[0] * 1e-6, ft / 7000) for _, ft, _, counts in records]).T
    assert np.polyfit(seconds, force, 1)[0] == pytest.approx(10, rel=1e-3)


def test_a_slow_start_and_a_delay_hold_the_first_record_back():
    for faults in (Faults(slow_start_s=0.15), Faults(delay_s=0.15)):
        with box() as (emulator, client):
            emulator.inject(faults)
            begin = time.monotonic()
            client.send(START)
            assert client.records(1)[0][0] == 1
            assert time.monotonic() - begin > 0.15


def test_an_unplugged_box_goes_on_and_its_records_are_lost():
    with box() as (emulator, client):
        client.send(START)
        client.records(5)
        emulator.inject(Faults(unplug_at_s=0.0, unplug_for_s=0.2))
        numbers = [5]
        while numbers[-1] <= 300:
            numbers += [rdt for rdt, *_ in client.records(1)]
    missing = sorted(set(range(numbers[0], numbers[-1])) - set(numbers))
    assert missing == list(range(missing[0], missing[-1] + 1))
    assert len(missing) == emulator.counts.dropped > 0


def test_a_box_that_loses_power_starts_its_clock_again_and_streams_only_on_request():
    with box() as (emulator, client):
        time.sleep(0.5)
        client.send(BIAS)
        client.send(START)
        first_ft = client.records(1)[0][1]
        emulator.inject(Faults(restart_at_s=0.0, restart_for_s=0.1))
        assert client.falls_silent()
        time.sleep(0.1)
        client.send(START)
        _, ft, _, counts = client.first_record_of_new_stream()
        assert ft < first_ft
        assert counts == [1_000_000, -2_000_000, 3_500_000, 100, -200, -1]


def test_no_thread_is_left_when_the_box_is_closed():
    new = new_threads()
    with box() as (_, client):
        client.send(START)
        client.records(1)
        assert new() == 3
    assert new() == 0


@pytest.mark.parametrize("name", ["rdt_port", "http_port", "command_port"])
def test_a_port_in_use_leaves_nothing_behind(name):
    new = new_threads()
    with box() as (emulator, _), pytest.raises(OSError, match="in use"):
        NetFTEmulator(lambda _: LOAD, EmulatorSettings(**{name: getattr(emulator, name)}))
    assert new() == 0
