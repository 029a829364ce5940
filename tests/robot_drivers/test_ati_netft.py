"""The Net F/T driver in the face of faults, restarts and odd settings, on the emulated box."""

import socket
import time
from contextlib import contextmanager

import numpy as np
import pytest
from rdt_sensors import netft
from sensor_blocks import first_block, gathered, read_for, read_until

from robot_drivers.ati.benchmark import run as run_benchmark
from robot_drivers.ati.emulator import BoxConfiguration, EmulatorSettings, Faults
from robot_drivers.ati.netft import NetFT, NetFTSettings
from robot_drivers.errors import ConfigurationError, DeviceTimeoutError, DeviceUnreachableError
from robot_drivers.protocols import StreamStatistics

LOAD = np.array([10.0, -20.0, 30.0, 0.1, -0.2, 0.3])


@contextmanager
def connected(source=lambda _: LOAD, box=None, **settings):
    """An emulated box with a sensor connected to it, not yet streaming."""
    with netft(source, box or EmulatorSettings(rate_hz=2000), **settings) as (emulator, sensor):
        sensor.connect()
        yield emulator, sensor


@contextmanager
def streaming(source=lambda _: LOAD, box=None, **settings):
    with connected(source, box, **settings) as (emulator, sensor):
        sensor.start()
        yield emulator, sensor


def finish(emulator, sensor):
    """End the faults, read on until both sides agree, and return what each counted in the end."""
    emulator.inject(Faults())
    end = time.monotonic() + 60.0
    while True:
        sensor.read(0.05)
        found, counts = sensor.statistics(), emulator.counts
        expected = StreamStatistics(
            received=counts.records - counts.dropped,
            lost=counts.dropped,
            duplicated=counts.duplicated,
            late=counts.reordered,
            malformed=counts.truncated_datagrams + counts.rubbish_datagrams,
        )
        if found == expected or time.monotonic() > end:
            return found, expected


@pytest.mark.parametrize("mode", ["real-time", "buffered"])
@pytest.mark.parametrize(
    "faults",
    [
        Faults(loss=0.1),
        Faults(duplication=0.1),
        Faults(reordering=0.1),
        Faults(truncation=0.1),
        Faults(rubbish=0.1),
        Faults(loss=0.05, duplication=0.05, reordering=0.05, truncation=0.05, rubbish=0.05),
        Faults(loss=0.5, duplication=0.3, reordering=0.3),
    ],
    ids=lambda faults: "mixed" if faults.loss and faults.reordering else "",
)
def test_what_the_link_does_is_counted_exactly(faults, mode):
    with streaming(mode=mode, box=EmulatorSettings(rate_hz=7000, buffer_size=4)) as (emulator, sensor):
        emulator.inject(faults)
        read_for(sensor, 0.1)
        found, expected = finish(emulator, sensor)
    assert found == expected
    assert found.lost + found.duplicated + found.late + found.malformed > 0


def test_faults_of_the_link_alter_no_value_and_double_no_sample():
    with streaming() as (emulator, sensor):
        emulator.inject(Faults(loss=0.1, duplication=0.1, reordering=0.1, truncation=0.1, rubbish=0.3))
        blocks = read_for(sensor, 0.4)
    assert np.abs(gathered(blocks, "wrench") - LOAD).max() < 0.1
    counters = gathered(blocks, "counter")
    assert len(set(counters)) == len(counters)


def test_a_delay_shows_in_the_host_stamps_and_not_in_the_device_time():
    with streaming() as (emulator, sensor):
        before = read_for(sensor, 0.1)
        emulator.inject(Faults(delay_s=0.5))
        after = read_for(sensor, 1.0)
        assert sensor.statistics().lost == 0
    assert np.diff(gathered(before + after, "device_time_s")).max() < 0.002
    quickest = [
        min((block.host_time_ns * 1e-9 - block.device_time_s).min() for block in blocks)
        for blocks in (before, after[-5:])
    ]
    assert 0.25 < quickest[1] - quickest[0] < 5.0


def test_datagrams_of_a_stranger_are_rejected_and_counted():
    with streaming() as (_, sensor), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for _ in range(5):
            stranger.sendto(bytes(36), ("127.0.0.1", sensor.link_statistics().local_port))
        blocks = read_for(sensor, 0.1)
        assert sensor.link_statistics().foreign_datagrams == 5
        assert sensor.statistics().malformed == 0
    assert np.abs(gathered(blocks, "wrench") - LOAD).max() < 0.1


def test_a_cable_that_comes_back_costs_only_the_samples_meanwhile():
    with streaming() as (emulator, sensor):
        blocks = [first_block(sensor)]
        emulator.inject(Faults(unplug_at_s=0.0, unplug_for_s=0.2))
        blocks += read_until(sensor, lambda: sensor.statistics().lost)
        statistics, dropped = sensor.statistics(), emulator.counts.dropped
    # Where a busy computer makes the box late the first record asks for another that confirms it, and is not used.
    assert statistics.lost - dropped in (0, 1)
    assert statistics == StreamStatistics(received=statistics.received, lost=statistics.lost)
    assert np.diff(gathered(blocks, "device_time_s")).max() > 0.15


def test_a_box_that_lost_power_is_asked_to_stream_again():
    with streaming(silence_s=0.2) as (emulator, sensor):
        blocks = read_for(sensor, 0.5)
        emulator.inject(Faults(restart_at_s=0.0, restart_for_s=0.05))
        blocks += read_for(sensor, 0.2)
        blocks.append(first_block(sensor, lambda _: sensor.statistics().restarts))
        statistics = sensor.statistics()
        assert sensor.link_statistics().repeated_starts >= 1
    assert statistics.restarts == 1
    assert statistics.lost == 0
    device_s = gathered(blocks, "device_time_s")
    assert (np.diff(device_s) < 0).sum() == 1  # the device's clock fell back, once
    counters = gathered(blocks, "counter")
    assert (np.diff(counters) == 1).all()  # the counter did not


def test_requests_into_silence_become_rarer():
    with streaming(silence_s=0.05) as (emulator, sensor):
        emulator.close()
        began = time.monotonic()
        while sensor.link_statistics().repeated_starts < 4:  # after 0.05, 0.15, 0.35, 0.75 s at the earliest
            sensor.read(0.05)
        assert time.monotonic() - began > 0.6


def test_starting_never_biases_and_a_bias_is_explicit():
    with streaming() as (_, sensor):
        np.testing.assert_allclose(gathered(read_for(sensor, 0.05), "wrench").mean(axis=0), LOAD, atol=0.01)
        sensor.stop()
        sensor.start()
        np.testing.assert_allclose(gathered(read_for(sensor, 0.05), "wrench").mean(axis=0), LOAD, atol=0.01)
        sensor.set_bias()
        first_block(sensor, lambda _: sensor.statistics().restarts)
        np.testing.assert_allclose(gathered(read_for(sensor, 0.05), "wrench").mean(axis=0), 0, atol=0.01)


@pytest.mark.parametrize("stops", [True, False])
def test_the_stream_goes_on_after_a_bias_whether_or_not_that_ends_it(stops):
    with streaming(box=EmulatorSettings(rate_hz=2000, bias_stops_stream=stops)) as (_, sensor):
        blocks = read_for(sensor, 0.05)
        sensor.set_bias()
        blocks += read_for(sensor, 0.05)
        blocks.append(first_block(sensor, lambda _: sensor.statistics().restarts))
        statistics = sensor.statistics()
        assert sensor.link_statistics().repeated_starts == 0
    assert np.abs(blocks[-1].wrench[-1]).max() < 0.1
    assert statistics == StreamStatistics(received=statistics.received, restarts=1)
    assert (np.diff(gathered(blocks, "counter")) == 1).all()


def test_a_bias_can_be_set_before_streaming():
    with connected() as (_, sensor):
        sensor.set_bias()
        sensor.start()
        np.testing.assert_allclose(gathered(read_for(sensor, 0.1), "wrench").mean(axis=0), 0, atol=0.01)


def test_a_latched_monitor_condition_warns_until_it_is_reset():
    with streaming() as (emulator, sensor):
        emulator.latch_monitor_condition()
        warned = first_block(sensor, lambda block: block.status.any())
        sensor.reset_latch()
        first_block(sensor, lambda block: not block.status[-1])
        assert sensor.describe_status(int(warned.status[-1]))[-1].startswith("bit 16: monitor condition")
    assert warned.usable.all()


@pytest.mark.parametrize(
    "faults", [Faults(saturated=True), Faults(status=0x80020000), Faults(status=0x80000200)]
)
def test_samples_of_a_saturated_or_faulty_sensor_are_delivered_but_not_usable(faults):
    with streaming() as (emulator, sensor):
        emulator.inject(faults)
        block = first_block(sensor, lambda block: block.status.any())
    assert (block.usable == (block.status == 0)).all()


@pytest.mark.parametrize("axis", range(6))
def test_a_sample_beyond_the_rated_range_is_not_usable(axis):
    load = np.zeros(6)
    load[axis] = -1.05 * np.array([130, 130, 400, 10, 10, 10])[axis]
    with streaming(lambda _: load) as (_, sensor):
        block = sensor.read(1.0)
        assert not block.usable.any()
        assert not block.status.any()


def test_the_rated_range_is_a_setting():
    strong = (200.0, 200.0, 600.0, 15.0, 15.0, 15.0)
    with streaming(lambda _: np.array([0, 0, 450.0, 0, 0, 0]), rated_wrench=strong) as (_, sensor):
        assert sensor.read(1.0).usable.all()


def test_a_channel_at_the_end_of_its_32_bits_is_not_usable():
    fine = EmulatorSettings(configurations=(BoxConfiguration(counts_per_force=1e8),))
    with streaming(lambda _: np.array([50.0, 0, 0, 0, 0, 0]), fine) as (_, sensor):
        assert not sensor.read(1.0).usable.any()


@pytest.mark.parametrize(
    ("product", "settings", "name", "usable"),
    [
        ("Net F/T", {}, "Net F/T", False),
        ("Ethernet Axia", {}, "Ethernet Axia", True),
        ("Net F/T", {"status_map": "axia"}, "Ethernet Axia", True),
        ("Ethernet Axia", {"status_map": "net-ft"}, "Net F/T", False),
        ("Net F/T", {"usable_status": (0, 0x1_0000)}, "Net F/T", True),
    ],
)
def test_the_meaning_of_the_status_follows_the_product_or_the_setting(product, settings, name, usable):
    with streaming(box=EmulatorSettings(product=product), **settings) as (emulator, sensor):
        emulator.inject(Faults(status=0x1_0000))
        block = first_block(sensor, lambda block: block.status.all())
        assert block.usable.all() == usable
        assert sensor.identity.details["status map"] == name


def test_units_of_the_active_configuration_are_carried_to_si():
    trap = EmulatorSettings(
        configurations=(
            BoxConfiguration(),
            BoxConfiguration(
                force_unit="lbf",
                torque_unit="N-mm",
                newtons=4.4482216152605,
                newton_metres=1e-3,
                force_code=1,
                torque_code=4,
                counts_per_force=1e5,
                counts_per_torque=1000,
            ),
        ),
        active_configuration=1,
    )
    for source in ("web", "command-interface"):
        with streaming(box=trap, scaling_source=source) as (_, sensor):
            np.testing.assert_allclose(
                gathered(read_for(sensor, 0.1), "wrench").mean(axis=0), LOAD, atol=0.01
            )


def test_the_wanted_rate_is_set_at_connection():
    with streaming(rate_hz=500) as (_, sensor):
        assert sensor.identity.details["RDT rate"] == "500 Hz"
        blocks = read_for(sensor, 0.1)
        assert sensor.statistics().lost == 0
    times = gathered(blocks, "device_time_s")
    np.testing.assert_allclose(np.diff(times), 0.002)


def test_a_slow_box_is_waited_for():
    with connected(silence_s=0.1) as (emulator, sensor):
        emulator.inject(Faults(slow_start_s=0.2))
        sensor.start()
        assert len(sensor.read(0.0)) > 0


def test_a_box_whose_rdt_is_switched_off_says_so():
    with (
        pytest.raises(ConfigurationError, match="enable it on its Communications page"),
        connected(box=EmulatorSettings(rdt_enabled=False)),
    ):
        pass


def test_a_box_that_sends_nothing_is_told_at_the_start():
    with connected(start_timeout_s=0.3) as (emulator, sensor):
        emulator.inject(Faults(unplug_at_s=0.0, unplug_for_s=60.0))
        with pytest.raises(DeviceTimeoutError, match="check UDP port"):
            sensor.start()


def test_a_host_that_is_not_there_is_unreachable():
    with pytest.raises(DeviceUnreachableError, match="power, cable"):
        NetFT(NetFTSettings(host="127.0.0.1", http_port=9, answer_timeout_s=0.5)).connect()


def test_the_benchmark_counts_what_arrives_at_7_khz():
    statistics = run_benchmark(rate_hz=7000, seconds=0.5).statistics
    assert statistics.received > statistics.lost  # a busy machine may lose some
    assert statistics.duplicated == statistics.malformed == 0
