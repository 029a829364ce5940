"""Reading a streaming force sensor for a while, or until something has come about."""

import time

import numpy as np

ANSWER_TIMEOUT_S = 2.0
"""For emulated devices: a busy machine lets them answer late."""


def read_for(sensor, seconds, limit_s=60.0):
    """The blocks of some time that were not empty, one at the least: a busy computer may be late."""
    began, blocks = time.monotonic(), []
    while time.monotonic() < began + (seconds if blocks else limit_s):
        block = sensor.read(0.05)
        if len(block):
            blocks.append(block)
    return blocks


def first_block(sensor, condition=lambda _: True, limit_s=60.0):
    """The first block from now on that has samples and satisfies a condition."""
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        block = sensor.read(0.05)
        if len(block) and condition(block):
            return block
    raise AssertionError("no such block came")


def gathered(blocks, name):
    return np.concatenate([getattr(block, name) for block in blocks])


def read_until(sensor, condition, limit_s=60.0):
    end, blocks = time.monotonic() + limit_s, []
    while not condition():
        assert time.monotonic() < end, "it did not come about"
        blocks.append(sensor.read(0.05))
    return blocks
