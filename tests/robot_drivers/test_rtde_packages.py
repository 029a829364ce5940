"""RTDE on the wire: packages as the guide has them, however they are cut, and what is refused."""

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_drivers.errors import (
    DeviceProtocolError,
)
from robot_drivers.universal_robots.rtde.packages import (
    Kind,
    Package,
    Recipe,
    accepted,
    controller_version,
    take_package,
    text_of,
)
from robot_drivers.universal_robots.rtde.stream import SampleClock

ANGLES = st.tuples(*[st.floats(-3.0, 3.0)] * 6)


def test_packages_are_the_bytes_of_the_guide():
    assert Package(Kind.PROTOCOL, b"\x00\x02").encode() == b"\x00\x05V\x00\x02"
    assert Package(Kind.START).encode() == b"\x00\x03S"
    request = struct.pack(">d", 125.0) + b"timestamp,actual_q"
    assert (
        Package(Kind.OUTPUTS, request).encode()
        == b"\x00\x1dO\x40\x5f\x40\x00\x00\x00\x00\x00timestamp,actual_q"
    )
    recipe = Recipe.of_answer(Package(Kind.INPUTS, b"\x02INT32,DOUBLE"), ("a", "b"))
    assert recipe.encode((-2, 1.5)) == b"\x02\xff\xff\xff\xfe\x3f\xf8\x00\x00\x00\x00\x00\x00"


@given(
    st.lists(st.tuples(st.sampled_from(list(Kind)), st.binary(max_size=60)), max_size=6), st.integers(1, 9)
)
def test_packages_are_told_apart_however_they_are_cut(packages, size):
    sent = [Package(kind, content) for kind, content in packages]
    stream = b"".join(package.encode() for package in sent)
    received, found = bytearray(), []
    for place in range(0, len(stream), size):
        received += stream[place : place + size]
        while (package := take_package(received)) is not None:
            found.append(package)
    assert found == sent
    assert not received


@pytest.mark.parametrize("received", [b"\x00\x02V", b"\x00\x09x", b"HTTP/1.1"])
def test_what_begins_no_package_is_refused(received):
    with pytest.raises(DeviceProtocolError, match="30004"):
        take_package(bytearray(received))


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (b"\x01DOUBLE,NOT_FOUND", "actual_q is not known"),
        (b"\x01IN_USE,VECTOR6D", "timestamp is written by another client"),
        (b"\x01DOUBLE,QUATERNION", "unknown type 'QUATERNION'"),
        (b"\x01DOUBLE", "1 types for 2 variables"),
        (b"", "empty answer"),
    ],
)
def test_an_answer_that_makes_no_recipe_says_which_variable_it_is(answer, words):
    with pytest.raises(DeviceProtocolError, match=words):
        Recipe.of_answer(Package(Kind.OUTPUTS, answer), ("timestamp", "actual_q"))


@given(st.floats(-1e12, 1e12), ANGLES, st.integers(-(2**31), 2**31 - 1))
def test_values_come_back_as_they_were_sent(time_s, joints, mode):
    recipe = Recipe.of_answer(Package(Kind.OUTPUTS, b"\x07DOUBLE,VECTOR6D,INT32"), ("t", "q", "m"))
    assert recipe.decode(recipe.encode((time_s, joints, mode))) == {"t": time_s, "q": joints, "m": mode}


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf, 1e300])
def test_what_nothing_can_measure_is_refused(number):
    recipe = Recipe.of_answer(Package(Kind.OUTPUTS, b"\x07DOUBLE"), ("t",))
    with pytest.raises(DeviceProtocolError, match="no controller measures"):
        recipe.decode(recipe.encode((number,)))


@pytest.mark.parametrize(
    ("parse", "content"),
    [
        (accepted, b""),
        (accepted, b"\x02"),
        (controller_version, b"\x00" * 15),
        (text_of, b"\x09short\x00\x01"),
        (text_of, b""),
    ],
)
def test_answers_of_another_length_than_they_should_have_are_refused(parse, content):
    with pytest.raises(DeviceProtocolError):
        parse(Package(Kind.TEXT, content))


@given(st.lists(st.integers(1, 40), min_size=1, max_size=40))
def test_cycles_that_were_not_told_are_counted(steps):
    clock, counters, time_s = SampleClock(500.0), [], 3.0
    for step in [1, *steps]:
        time_s += step * 0.002
        counters.append(clock.count(time_s))
    assert np.diff(counters).tolist() == steps
    assert clock.lost == sum(steps) - len(steps)
    assert clock.count(time_s) is None
    assert clock.duplicated == 1
    assert clock.count(0.1) == counters[-1] + 1
    assert clock.restarts == 1
