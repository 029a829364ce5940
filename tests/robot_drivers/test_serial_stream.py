"""Counters and times of a stream that has neither, and the emulated line it comes over."""

import threading
import time
from collections import deque
from contextlib import closing

import numpy as np
import pytest
import serial
from new_threads import new_threads
from sensor_blocks import ANSWER_TIMEOUT_S

from robot_drivers.ati.digital_ft import DigitalFT, DigitalFTSettings
from robot_drivers.ati.digital_ft.protocol import SampleDecoder
from robot_drivers.ati.emulator.serial.digital_ft import DigitalFTEmulator
from robot_drivers.ati.serial.stream import SampleStream
from robot_drivers.clock import host_time_ns
from robot_drivers.serial_line.emulator.line import FaultyWire, LineFaults, PseudoTerminal, TcpPort
from robot_drivers.serial_line.receiver import Chunk

SAMPLE = bytes.fromhex("0001 0003 0005 0002 FFFC FFFA 7F")
GUARD = 4
RATE_HZ = 7000.0


class Arrivals:
    """Takes the place of a receiver: chunks of whole samples at given times, one for each call."""

    def __init__(self, *chunks):
        self._chunks = deque(Chunk(n * SAMPLE, round(at_s * 1e9)) for at_s, n in chunks)

    def take(self, timeout_s):
        return [self._chunks.popleft()] if self._chunks else []


def counters_of(*chunks):
    """Counters and stamps (s) of all samples of a stream that arrived like this, and its statistics."""
    stream = SampleStream(Arrivals(*chunks), SampleDecoder(), RATE_HZ)
    read = [stream.read(0.0) for _ in range(len(chunks) + 1)]
    counter = np.concatenate([samples.counter for samples in read])
    stamps = np.concatenate([samples.host_time_ns for samples in read]) * 1e-9
    return counter, stamps, stream.statistics


def steady(begin_s, end_s):
    """Chunks of a stream that is on time."""
    return [(at_s, 28) for at_s in np.arange(begin_s, end_s, 0.004)]


def test_samples_are_stamped_with_the_arrival_of_their_last_byte():
    counter, stamps, _ = counters_of((1.000, 28), (1.004, 28), (1.008, 28))
    np.testing.assert_array_equal(counter, np.arange(84 - GUARD))
    np.testing.assert_array_equal(stamps, np.repeat([1.000, 1.004, 1.008], 28)[:-GUARD])


def test_a_sample_that_is_split_is_stamped_with_its_second_part():
    arrivals = Arrivals()
    data = 20 * SAMPLE
    arrivals._chunks.extend([Chunk(data[:30], 10**9), Chunk(data[30:], 2 * 10**9)])
    stream = SampleStream(arrivals, SampleDecoder(), RATE_HZ)
    stamps = np.concatenate([stream.read(0.0).host_time_ns for _ in range(3)])
    np.testing.assert_array_equal(stamps[:4], [10**9, 10**9, 2 * 10**9, 2 * 10**9])


def test_a_silence_counts_as_the_samples_that_should_have_come():
    counter, stamps, statistics = counters_of(*steady(1.0, 2.0), *steady(2.2, 3.2))
    assert statistics.lost == pytest.approx(0.2 * RATE_HZ, abs=1)
    jump = np.argmax(np.diff(counter))
    assert 2.2 < stamps[jump] < 2.5  # late bytes had a quarter of a second to come
    lag_s = stamps - counter / RATE_HZ
    assert np.ptp(lag_s[: len(lag_s) // 2]) < 0.005
    assert lag_s[-1] - lag_s[0] == pytest.approx(0, abs=0.005)


def test_bytes_that_were_only_late_are_not_counted_as_lost():
    late = round(0.2 * RATE_HZ)
    in_one = [*steady(1.0, 2.0), (2.2, late), *steady(2.204, 3.0)]
    in_pieces = [*steady(1.0, 2.0), (2.1, 28), (2.2, late - 28), *steady(2.204, 3.0)]
    for chunks in (in_one, in_pieces):
        assert counters_of(*chunks)[-1].lost == 0


def test_repeated_silences_are_all_counted():
    chunks = steady(1.0, 2.0) + steady(2.1, 2.15) + steady(2.25, 3.0) + steady(3.3, 4.0)
    assert counters_of(*chunks)[-1].lost == pytest.approx(0.5 * RATE_HZ, abs=30)


def test_a_wait_for_the_first_sample_is_no_loss():
    assert counters_of(*steady(9.0, 10.0))[-1].lost == 0


def test_a_silence_right_after_the_start_is_counted():
    assert counters_of(*steady(1.0, 1.02), *steady(1.2, 2.0))[-1].lost == pytest.approx(
        0.18 * RATE_HZ, abs=30
    )


def test_a_clock_that_is_a_little_off_is_no_loss():
    slow = [(at_s * 1.01, n) for at_s, n in steady(1.0, 6.0)]
    assert counters_of(*slow)[-1].lost == 0


def test_a_new_start_goes_on_counting_over_the_time_without():
    stream = SampleStream(Arrivals(*steady(1.0, 2.0)), SampleDecoder(), RATE_HZ)
    for _ in range(250):
        stream.read(0.0)
    before = stream.statistics.received
    stream.resume(Arrivals(*steady(3.0, 4.0)), SampleDecoder())
    counter = np.concatenate([stream.read(0.0).counter for _ in range(250)])
    assert counter[0] == before
    assert counter[-1] == pytest.approx(3.0 * RATE_HZ, abs=40)
    assert stream.statistics.restarts == 1
    assert (np.diff(counter) >= 1).all()


def test_a_machine_that_stalls_loses_nothing():
    gate = threading.Event()
    gate.set()

    def source(_):
        gate.wait()
        return np.zeros(6)

    with (
        DigitalFTEmulator(source) as emulator,
        closing(
            DigitalFT(DigitalFTSettings(port=emulator.port, answer_timeout_s=ANSWER_TIMEOUT_S))
        ) as sensor,
    ):
        sensor.connect()
        sensor.start()
        sensor.read(1.0)
        gate.clear()
        time.sleep(0.15)
        gate.set()
        end = time.monotonic() + 0.3
        while time.monotonic() < end:
            sensor.read(0.05)
        statistics = sensor.statistics()
    assert statistics.lost == 0
    assert statistics.received > 0.3 * RATE_HZ


@pytest.mark.parametrize("make_line", [PseudoTerminal, TcpPort])
def test_bytes_pass_a_line_both_ways_unchanged(make_line):
    line = make_line()
    every_byte = bytes(range(256))
    with serial.serial_for_url(line.port, timeout=1.0) as port:
        line.receive(0.1)  # a connection is noticed here
        port.write(every_byte)
        heard = b""
        while len(heard) < 256:
            heard += line.receive(1.0)
        assert heard == every_byte
        line.send(every_byte * 40)
        received = b""
        while len(received) < 40 * 256:
            received += port.read(40 * 256 - len(received))
            line.receive(0.0)
        assert received == every_byte * 40
    line.close()


@pytest.mark.parametrize("make_line", [PseudoTerminal, TcpPort])
def test_a_line_outlives_its_clients(make_line):
    line = make_line()
    for _ in range(2):
        with serial.serial_for_url(line.port, timeout=1.0) as port:
            line.receive(0.1)
            line.send(b"there")
            assert port.read(5) == b"there"
        line.send(b"nobody")
        line.receive(0.0)
    line.close()


def test_what_the_wire_does_is_counted_and_repeats_with_its_seed():
    data = bytes(range(256)) * 40
    faults = LineFaults(loss=0.01, insertion=0.02, corruption=0.03, rubbish=0.5)
    runs = []
    for _ in range(2):
        wire = FaultyWire(seed=5)
        arrived = b"".join(wire.transmit(data, faults) for _ in range(3))
        assert len(arrived) == 3 * len(data) - wire.counts.lost + wire.counts.inserted
        runs.append(arrived)
    assert runs[0] == runs[1]
    n = 3 * len(data)
    assert wire.counts.lost == pytest.approx(0.01 * n, abs=5 * (0.01 * n) ** 0.5)
    assert wire.counts.corrupted == pytest.approx(0.03 * n, abs=5 * (0.03 * n) ** 0.5)
    assert FaultyWire(seed=5).transmit(data, LineFaults()) == data


def test_the_source_is_asked_once_per_burst_and_never_ahead_of_time():
    asked, asked_at_ns = [], []

    def source(time_s):
        asked.append(time_s)
        asked_at_ns.append(host_time_ns())
        return np.array([time_s, 0, 0, 0, 0, 0])

    with (
        DigitalFTEmulator(source) as emulator,
        closing(
            DigitalFT(DigitalFTSettings(port=emulator.port, answer_timeout_s=ANSWER_TIMEOUT_S))
        ) as sensor,
    ):
        sensor.connect()
        sensor.start()
        blocks = [sensor.read(0.1) for _ in range(60)]
    assert asked == sorted(asked)
    assert (np.array(asked) <= (np.array(asked_at_ns) - emulator.epoch_ns) * 1e-9).all()
    assert len(asked) < 0.1 * sum(map(len, blocks))
    # between two bursts the load is interpolated: a ramp stays a ramp
    force = np.concatenate([block.wrench[:, 0] for block in blocks])
    clock = np.concatenate([block.device_time_s for block in blocks])
    np.testing.assert_allclose(force - force[0], clock - clock[0], atol=0.05)


def test_no_thread_and_no_port_is_left_behind():
    new = new_threads()
    with DigitalFTEmulator(lambda _: np.zeros(6)) as emulator:
        sensor = DigitalFT(DigitalFTSettings(port=emulator.port, answer_timeout_s=ANSWER_TIMEOUT_S))
        sensor.connect()
        sensor.start()
        assert new() == 2
        sensor.close()
        assert new() == 1
    assert new() == 0
