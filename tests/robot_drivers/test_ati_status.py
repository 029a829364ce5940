import numpy as np
import pytest

from robot_drivers.ati.transducer.status import AXIA, NET_FT, status_map


@pytest.mark.parametrize(
    ("product", "expected"),
    [("Net F/T", NET_FT), ("", NET_FT), ("Ethernet Axia", AXIA), ("ATI ETHERNET AXIA80", AXIA)],
)
def test_the_map_is_chosen_by_the_product(product, expected):
    assert status_map(product) is expected


def test_a_healthy_word_leaves_the_sample_usable():
    assert NET_FT.usable(np.zeros(3, np.int64)).tolist() == [True] * 3


def test_a_latched_monitor_condition_is_a_warning_only():
    assert NET_FT.usable(np.array([0x80010000])).all()


@pytest.mark.parametrize("bit", [bit for bit in range(32) if bit != 16])
def test_every_other_bit_of_a_net_ft_forbids_the_sample(bit):
    words = np.array([0, 1 << bit, 0x80000000 | 1 << bit, 0x80010000 | 1 << bit])
    # the summary bit is part of a mere latch; alone it contradicts itself and forbids the sample
    assert NET_FT.usable(words).tolist() == [True, False, False, bit == 31]


def test_a_latch_without_the_summary_bit_contradicts_itself():
    assert not NET_FT.usable(np.array([0x00010000])).any()


def test_the_same_word_means_different_things_on_an_axia_and_on_a_net_ft():
    saturation, busy = 0x80020000, 0x8
    assert (
        NET_FT.describe(saturation)[1] == "bit 17: transducer saturated or A/D error: the data are not usable"
    )
    assert AXIA.describe(busy)[0].startswith("bit 3: busy")
    assert NET_FT.describe(busy) == ("bit 3: reference voltage or power monitor error",)
    assert not NET_FT.usable(np.array([busy, saturation])).any()


def test_words_for_an_operator_name_every_bit_that_is_set():
    assert NET_FT.describe(0) == ()
    assert [line.split(":")[0] for line in NET_FT.describe(0xFFFFFFFF)] == [
        f"bit {n}" for n in range(31, -1, -1)
    ]
    assert NET_FT.describe(0x1) == ("bit 0: not documented",)


# 9610-05-Ethernet Axia-09, table 4.9: bit patterns, and what they are called
@pytest.mark.parametrize(
    ("word", "named", "usable"),
    [
        (0x80000001, "temperature", False),
        (0x80000002, "supply voltage", False),
        (0x80000004, "broken gage", False),
        (0x80000008, "busy", False),
        (0x80000020, "another error", False),
        (0x00010000, "monitor condition latched", True),
        (0x88000000, "gage out of range", False),
        (0x10000000, "simulated error", False),
        (0xA0000000, "calibration checksum", False),
        (0xC0000000, "force or torque out of range", False),
        (0x80000000, "some error bit", False),
        (0x00000000, "", True),
    ],
)
def test_the_patterns_of_the_axias_manual_are_understood(word, named, usable):
    assert named in " ".join(AXIA.describe(word))
    assert AXIA.usable(np.array([word])).all() == usable


def test_bits_that_the_axias_manual_calls_reserved_forbid_the_sample():
    reserved = [4, 6, *range(8, 16), *range(17, 27)]
    assert not AXIA.usable(np.array([1 << bit for bit in reserved])).any()
