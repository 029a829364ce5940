"""What every force sensor does, whatever its box, through the protocol alone: each on its emulator, and a real one.

A further sensor joins by a context manager like :func:`netft_bench` in ``BENCHES``. With ``--hardware RIGFILE`` the
force sensor of the rig file is tried as well; it must be at rest, its load is not known.
"""

import time
from collections.abc import Callable
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pytest
import sensor_blocks
from numpy.typing import NDArray
from rdt_sensors import axia, netft

from robot_drivers.ati.controller_ft import ControllerFT, ControllerFTSettings
from robot_drivers.ati.digital_ft import DigitalFT, DigitalFTSettings
from robot_drivers.ati.emulator import AxiaEmulatorSettings, EmulatorSettings
from robot_drivers.ati.emulator.can.netbox_can import NetBoxCanEmulator, NetBoxCanEmulatorSettings
from robot_drivers.ati.emulator.can.netcanoem import BoardSettings, NetCANOEMEmulator
from robot_drivers.ati.emulator.serial.controller_ft import ControllerFTEmulator, ControllerFTEmulatorSettings
from robot_drivers.ati.emulator.serial.digital_ft import DigitalFTEmulator
from robot_drivers.ati.netbox_can import NetBoxCan, NetBoxCanSettings
from robot_drivers.ati.netcanoem import NetCANOEM, NetCANOEMSettings
from robot_drivers.bota import BotaSerial, BotaSettings
from robot_drivers.bota.emulator import BotaEmulator
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import ForceSensor, WrenchBlock
from robot_drivers.serial_line.emulator.line import LineFaults
from robot_drivers.universal_robots import URWrench, URWrenchSettings
from robot_drivers.universal_robots.emulator import URControllerEmulator, URFaults

CLOCK_COMPARISON_NS = 10_000  # stamps of the kernel's clock are carried to the host clock batch by batch
PATIENCE_S = 2.0  # with an emulated device on a busy machine
LOAD = np.array([10.0, -20.0, 30.0, 0.1, -0.2, 0.3])


@dataclass
class Bench:
    """A sensor that feels ``load`` and streams at ``rate_hz`` once started.

    ``period_tolerance`` is how far its usual period may be off: not at all with a clock of its own. A real sensor's
    load is not known, and only a person can switch it off.
    """

    sensor: ForceSensor
    rate_hz: float
    period_tolerance: float
    switch_off: Callable[[], None] | None
    load: NDArray[np.float64] | None = field(default_factory=LOAD.copy)


@contextmanager
def netft_bench(mode):
    box = EmulatorSettings(rate_hz=1000, buffer_size=5)
    with netft(lambda _: LOAD, box, mode=mode) as (emulator, sensor):
        yield Bench(sensor, 1000, 1e-9, emulator.close)


@contextmanager
def axia_bench(mode):
    # every fourth sample is sent, so that all records are as far apart
    emulated = AxiaEmulatorSettings(sample_rate_hz=3904, rate_hz=976, buffer_size=5)
    with axia(lambda _: LOAD, emulated, mode=mode, sample_rate_hz=3904.0) as (emulator, sensor):
        yield Bench(sensor, 976, 1e-9, emulator.close)


@contextmanager
def netcanoem_bench():
    with NetCANOEMEmulator(lambda _: LOAD, BoardSettings(channel="force sensor protocol")) as emulator:
        channel = emulator.settings.channel
        sensor = NetCANOEM(
            NetCANOEMSettings(channel=channel, interface="virtual", rate_hz=100, answer_timeout_s=PATIENCE_S)
        )
        try:
            yield Bench(sensor, 100, 0.5, emulator.close)
        finally:
            sensor.close()


@contextmanager
def netbox_can_bench():
    settings = NetBoxCanEmulatorSettings(channel="force sensor protocol, Net Box")
    with NetBoxCanEmulator(lambda _: LOAD, settings) as emulator:
        sensor = NetBoxCan(
            NetBoxCanSettings(
                channel=settings.channel,
                interface="virtual",
                bitrate=1_000_000,
                base=settings.base,
                counts_per_force=1e6,
                counts_per_torque=1e6,
                rate_hz=100,
                answer_timeout_s=PATIENCE_S,
            )
        )
        try:
            yield Bench(sensor, 100, 0.5, emulator.close)
        finally:
            sensor.close()


@contextmanager
def serial_bench(emulator, make_sensor, rate_hz):
    """A sensor on a serial line; the line stays when the emulated device is switched off."""
    with emulator:
        sensor = make_sensor(emulator.port)
        try:
            power_cut = LineFaults(restart_at_s=0.0, restart_for_s=60.0)
            yield Bench(sensor, rate_hz, 1e-9, lambda: emulator.inject(power_cut))
        finally:
            sensor.close()


def digital_ft_bench():
    return serial_bench(
        DigitalFTEmulator(lambda _: LOAD),
        lambda port: DigitalFT(DigitalFTSettings(port=port, answer_timeout_s=PATIENCE_S)),
        7000,
    )


def controller_ft_bench():
    line = {"bit_rate": 115200, "counts_per_newton": 1000.0, "counts_per_newton_metre": 10000.0}
    rate_hz = 115200 / 450  # records of 45 bytes, all that the line can carry
    return serial_bench(
        ControllerFTEmulator(lambda _: LOAD, ControllerFTEmulatorSettings(**line)),
        lambda port: ControllerFT(
            ControllerFTSettings(
                port=port, record_bits=16, record_rate_hz=rate_hz, answer_timeout_s=PATIENCE_S, **line
            )
        ),
        rate_hz,
    )


@contextmanager
def bota_bench():
    with BotaEmulator(lambda _: LOAD) as emulator:
        settings = BotaSettings(port=emulator.port, start_timeout_s=10 * PATIENCE_S)
        with closing(BotaSerial(settings)) as sensor:
            power_cut = LineFaults(restart_at_s=0.0, restart_for_s=60.0)
            yield Bench(sensor, 800, 1e-9, lambda: emulator.inject(power_cut))


@contextmanager
def ur_wrench_bench():
    with URControllerEmulator(wrench=lambda _: tuple(LOAD)) as emulator:
        settings = URWrenchSettings("127.0.0.1", emulator.port, silence_limit_s=10 * PATIENCE_S)
        with closing(URWrench(settings)) as sensor:
            yield Bench(sensor, 500, 1e-9, lambda: emulator.inject(URFaults(mute=True)))


BENCHES = {
    "flange of a UR": ur_wrench_bench,
    "Net F/T, real-time": lambda: netft_bench("real-time"),
    "Net F/T, buffered": lambda: netft_bench("buffered"),
    "Ethernet Axia, real-time": lambda: axia_bench("real-time"),
    "Ethernet Axia, buffered": lambda: axia_bench("buffered"),
    "Digital F/T": digital_ft_bench,
    "F/T Controller": controller_ft_bench,
    "Bota": bota_bench,
    "NETCANOEM": netcanoem_bench,
    "Net Box on CAN": netbox_can_bench,
}


@contextmanager
def real_bench(make_devices):
    """A real sensor, at the rate that another driver of it has just found."""
    with closing(make_devices().force_sensor) as sensor:
        sensor.connect()
        sensor.start()
        block = read_for(sensor, 1.0)
    rate_hz = 1 / float(np.median(np.diff(block.device_time_s)))
    with closing(make_devices().force_sensor) as sensor:
        yield Bench(sensor, rate_hz, 0.5, switch_off=None, load=None)


@pytest.fixture(params=[*BENCHES, pytest.param("real", marks=pytest.mark.hardware)])
def bench(request):
    make = BENCHES.get(request.param) or partial(real_bench, request.getfixturevalue("hardware"))
    with make() as bench:
        yield bench


@pytest.fixture
def streaming(bench):
    bench.sensor.connect()
    bench.sensor.start()
    return bench


def read_for(sensor, seconds):
    return joined(sensor_blocks.read_for(sensor, seconds))


def joined(blocks):
    names = ("counter", "device_time_s", "host_time_ns", "status", "usable", "wrench")
    return WrenchBlock(*(np.concatenate([getattr(block, name) for block in blocks]) for name in names))


def test_connecting_neither_streams_nor_biases(bench):
    bench.sensor.connect()
    bench.sensor.start()
    block = read_for(bench.sensor, 0.1)
    if bench.load is not None:
        np.testing.assert_allclose(block.wrench.mean(axis=0), bench.load, atol=0.02)
    bench.sensor.close()
    bench.sensor.connect()
    bench.sensor.start()
    again = read_for(bench.sensor, 0.1)
    np.testing.assert_allclose(again.wrench.mean(axis=0), block.wrench.mean(axis=0), atol=0.1)


def test_the_identity_says_who_the_sensor_is(bench):
    bench.sensor.connect()
    identity = bench.sensor.identity
    assert identity.model
    assert identity.serial
    assert identity.address
    assert identity == bench.sensor.identity


def test_use_before_connection_is_an_error_with_a_remedy(bench):
    with pytest.raises(DeviceError, match="connect"):
        _ = bench.sensor.identity
    with pytest.raises(DeviceError, match="connect"):
        bench.sensor.start()
    with pytest.raises(DeviceError, match="start"):
        bench.sensor.read(0.0)


def test_a_block_is_made_of_arrays_of_one_length_and_the_stated_types(streaming):
    block = streaming.sensor.read(1.0)
    n = len(block)
    assert n > 0
    assert block.wrench.shape == (n, 6)
    for name, kind in [
        ("counter", np.int64),
        ("device_time_s", np.float64),
        ("host_time_ns", np.int64),
        ("status", np.int64),
        ("usable", np.bool_),
        ("wrench", np.float64),
    ]:
        array = getattr(block, name)
        assert len(array) == n
        assert array.dtype == kind


def test_samples_are_the_load_in_newtons_and_newton_metres(streaming):
    block = read_for(streaming.sensor, 0.2)
    assert block.usable.all()
    assert np.isfinite(block.wrench).all()
    if streaming.load is not None:
        assert not block.status.any()
        error = np.abs(block.wrench.mean(axis=0) - streaming.load)
        assert (error < [0.01] * 3 + [0.001] * 3).all()


def test_no_sample_is_lost_or_doubled_on_a_sound_link(streaming):
    block = read_for(streaming.sensor, 0.3)
    assert (np.diff(block.counter) == 1).all()
    statistics = streaming.sensor.statistics()
    assert statistics.received == len(block)
    assert statistics.lost == statistics.duplicated == statistics.late == 0
    assert statistics.restarts == statistics.malformed == 0


def test_the_device_time_advances_by_the_period(streaming):
    block = read_for(streaming.sensor, 0.2)
    steps = np.diff(block.device_time_s)
    assert steps.min() > 0
    assert np.median(steps) == pytest.approx(1 / streaming.rate_hz, rel=streaming.period_tolerance)


def undisturbed():
    """Attempts, of which one has to succeed: a busy machine now and then holds an emulated device up."""
    yield from range(20)
    pytest.fail("no attempt of twenty succeeded")


def test_host_stamps_are_times_of_arrival(streaming):
    for _ in undisturbed():
        streaming.sensor.read(1.0)
        before_ns = host_time_ns()
        time.sleep(0.1)
        block = joined([streaming.sensor.read(1.0) for _ in range(5)])
        after_ns = host_time_ns()
        assert (np.diff(block.host_time_ns) > -CLOCK_COMPARISON_NS).all()
        assert block.host_time_ns[-1] <= after_ns
        # a reader that came late does not make the stamps late: those of its first block spread over its absence
        if block.host_time_ns[0] < before_ns + 80_000_000:
            break


def test_host_and_device_clock_agree_on_durations(streaming):
    for _ in undisturbed():
        block = read_for(streaming.sensor, 0.4)
        delay_s = block.host_time_ns * 1e-9 - block.device_time_s
        quickest = [part.min() for part in np.array_split(delay_s, 2)]
        if quickest[1] - quickest[0] == pytest.approx(0, abs=0.02):
            break


def test_a_reader_that_paused_gets_all_that_came_meanwhile_at_once(streaming):
    streaming.sensor.read(1.0)
    for _ in undisturbed():
        time.sleep(0.2)
        if len(streaming.sensor.read(0.0)) >= 0.1 * streaming.rate_hz:
            break


def test_a_block_is_the_readers_own(streaming):
    first = streaming.sensor.read(1.0)
    kept = first.wrench.copy(), first.counter.copy()
    read_for(streaming.sensor, 0.1)
    np.testing.assert_array_equal(first.wrench, kept[0])
    np.testing.assert_array_equal(first.counter, kept[1])


def test_silence_gives_empty_blocks_in_the_time_allowed(streaming):
    streaming.sensor.read(1.0)
    if streaming.switch_off is None:
        pytest.skip("nobody is there to switch the sensor off")
    streaming.switch_off()
    while len(streaming.sensor.read(0.05)):
        pass
    begin = time.monotonic()
    block = streaming.sensor.read(0.15)
    assert len(block) == 0
    assert block.wrench.shape == (0, 6)
    assert time.monotonic() - begin > 0.1


def test_after_stop_what_arrived_can_be_read_and_nothing_more_comes(streaming):
    for _ in undisturbed():
        time.sleep(0.2)
        streaming.sensor.stop()
        if len(streaming.sensor.read(0.0)) >= 0.1 * streaming.rate_hz:
            break
        streaming.sensor.start()
    while len(streaming.sensor.read(0.1)):
        pass
    assert len(streaming.sensor.read(0.1)) == 0


def test_a_stream_can_be_started_again_and_begins_its_counts_anew(streaming):
    read_for(streaming.sensor, 0.1)
    streaming.sensor.stop()
    streaming.sensor.start()
    block = streaming.sensor.read(1.0)
    statistics = streaming.sensor.statistics()
    assert statistics.received == len(block)
    assert statistics.lost == statistics.restarts == 0


def test_closing_twice_and_closing_what_never_started_is_harmless(bench):
    bench.sensor.close()
    bench.sensor.connect()
    bench.sensor.start()
    bench.sensor.close()
    bench.sensor.close()


def test_a_closed_sensor_can_be_used_again(streaming):
    streaming.sensor.close()
    streaming.sensor.connect()
    streaming.sensor.start()
    assert len(streaming.sensor.read(1.0)) > 0
