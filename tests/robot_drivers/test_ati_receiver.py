"""Bulk reception: order, stamps, batches, and what is rejected."""

import socket
import time
from contextlib import closing, contextmanager

import numpy as np
import pytest

from robot_drivers.ati.rdt.receiver import DatagramReceiver
from robot_drivers.clock import host_time_ns, wall_to_monotonic_offset_ns
from robot_drivers.kernel_stamps import KERNEL_STAMPS, request_stamps, wall_time_ns

SIZES = frozenset({4, 8})


@contextmanager
def linked(batch_s=0.0, kernel_stamps=KERNEL_STAMPS):
    """A receiver and a function by which its peer sends."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        peer.bind(("127.0.0.1", 0))
        peer.settimeout(1.0)
        receiver = DatagramReceiver(peer.getsockname(), SIZES, batch_s, kernel_stamps)
        with closing(receiver):
            receiver.send(b"hello")
            _, address = peer.recvfrom(10)
            yield receiver, lambda data: peer.sendto(data, address), address


@pytest.fixture(params=[True, False], ids=["kernel stamps", "user stamps"])
def kernel_stamps(request):
    if request.param and not KERNEL_STAMPS:
        pytest.skip("this system does not stamp datagrams")
    return request.param


def test_datagrams_arrive_in_order_laid_end_to_end(kernel_stamps):
    with linked(kernel_stamps=kernel_stamps) as (receiver, send, _):
        for data in (b"aaaa", b"bbbbbbbb", b"cccc"):
            send(data)
        datagrams = receiver.receive(1.0)
        assert bytes(datagrams.payload) == b"aaaabbbbbbbbcccc"
        assert datagrams.sizes.tolist() == [4, 8, 4]


def test_stamps_lie_between_sending_and_reading(kernel_stamps):
    with linked(kernel_stamps=kernel_stamps) as (receiver, send, _):
        stamps, limits = [], []
        for _ in range(20):
            before = host_time_ns()
            send(b"aaaa")
            stamps += receiver.receive(1.0).host_time_ns.tolist()
            limits.append((before, host_time_ns()))
    for stamp, (before, after) in zip(stamps, limits, strict=True):
        assert before - 100_000 < stamp < after + 100_000  # two clocks compared: a tenth of a millisecond


@pytest.mark.skipif(not KERNEL_STAMPS, reason="this system does not stamp datagrams")
def test_reading_late_does_not_make_kernel_stamps_late():
    with linked() as (receiver, send, _):
        sent = []
        for _ in range(3):
            sent.append(host_time_ns())
            send(b"aaaa")
            time.sleep(0.02)
        np.testing.assert_allclose(receiver.receive(1.0).host_time_ns - sent, 0, atol=5_000_000)


@pytest.mark.skipif(not KERNEL_STAMPS, reason="this system does not stamp datagrams")
def test_a_socket_waits_until_the_kernel_stamps_on_arrival(monkeypatch):
    stamped = []

    def at_first_when_read(ancillary):
        stamped.append(time.time_ns() if len(stamped) < 3 else wall_time_ns(ancillary))
        return stamped[-1]

    monkeypatch.setattr("robot_drivers.kernel_stamps.wall_time_ns", at_first_when_read)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        request_stamps(receiver)
    assert len(stamped) >= 4


def test_a_wall_clock_that_is_set_meanwhile_does_not_move_the_stamps(monkeypatch):
    offset = [0]
    monkeypatch.setattr("robot_drivers.ati.rdt.receiver.wall_to_monotonic_offset_ns", lambda: offset[0])
    with linked(kernel_stamps=True) as (receiver, send, _):
        offset[0] = 3_600_000_000_000
        send(b"aaaa")
        before = host_time_ns()
        (stamp,) = receiver.receive(1.0).host_time_ns
        assert before <= stamp <= host_time_ns()


@pytest.mark.skipif(not KERNEL_STAMPS, reason="this system does not stamp datagrams")
def test_stamps_never_go_back_when_the_wall_clock_is_slewed(monkeypatch):
    offset = [wall_to_monotonic_offset_ns()]
    monkeypatch.setattr("robot_drivers.ati.rdt.receiver.wall_to_monotonic_offset_ns", lambda: offset[0])
    with linked(kernel_stamps=True) as (receiver, send, _):
        stamps = []
        for _ in range(20):
            send(b"aaaa")
            stamps += receiver.receive(1.0).host_time_ns.tolist()
            offset[0] -= 900_000
    assert stamps == sorted(stamps)


def test_other_lengths_and_other_senders_are_rejected_and_counted(kernel_stamps):
    with (
        linked(kernel_stamps=kernel_stamps) as (receiver, send, address),
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):
        for data in (b"", b"aaa", b"aaaaa", b"a" * 5000):
            send(data)
        stranger.sendto(b"xxxx", address)
        send(b"good")
        assert bytes(receiver.receive(1.0).payload) == b"good"
        assert receiver.malformed == 4
        assert receiver.foreign == 1


def test_only_rejected_datagrams_are_like_none():
    with linked() as (receiver, send, _):
        send(b"bad")
        begin = time.monotonic()
        assert len(receiver.receive(0.1).sizes) == 0
        assert time.monotonic() - begin >= 0.1


def test_batches_keep_their_distance_without_exceeding_a_timeout():
    with linked(batch_s=0.1, kernel_stamps=True) as (receiver, send, _):
        receiver.receive(0.0)
        send(b"aaaa")
        begin = time.monotonic()
        assert len(receiver.receive(0.01).sizes) == 1
        assert time.monotonic() - begin < 0.05
        send(b"aaaa")
        assert len(receiver.receive(1.0).sizes) == 1
        assert time.monotonic() - begin >= 0.1


def test_thousands_of_waiting_datagrams_are_read_in_order():
    with linked() as (receiver, send, _):
        for number in range(2000):
            send(number.to_bytes(4, "big"))
        received = b""
        while len(received) < 8000 and len((datagrams := receiver.receive(0.2)).sizes):
            received += bytes(datagrams.payload)
    numbers = np.frombuffer(received, ">u4")
    assert (np.diff(numbers.astype(int)) > 0).all()
    assert numbers[0] == 0
