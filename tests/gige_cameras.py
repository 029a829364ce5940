"""Emulated GigE Vision cameras for tests: each at an address of its own, since all listen at one port."""

import ctypes
import itertools
import os
import sys

import numpy as np
import pytest

from robot_drivers.genicam.emulator import GigECameraEmulator, GigECameraSettings, GigEDepthSettings

_numbers = itertools.count(1)


def need_aravis():
    """Skip where there is no Aravis, or the computer has no more than one loopback address."""
    if sys.platform != "linux":
        pytest.skip("only Linux has a network of loopback addresses")
    try:
        ctypes.CDLL("libaravis-0.8.so.0")
    except OSError:
        pytest.skip("needs Aravis: apt install libaravis-0.8-0")


def address():
    """A loopback address that no other test uses."""
    pid = os.getpid()
    return f"127.{pid >> 8 & 0xFF}.{pid & 0xFF}.{next(_numbers) % 250 + 2}"


def scene(time_s):
    return np.full((120, 160), round(time_s * 50) % 256, np.uint8)


def depth_scene(time_s):
    return np.full((120, 160), 1000 + round(time_s * 50), np.uint16)


def gige_camera(source=scene, seed=0, **settings):
    return GigECameraEmulator(source, GigECameraSettings(host=address(), **settings), seed)


def depth_camera(source=scene, depth_source=depth_scene, depth=None, **settings):
    of_camera = GigECameraSettings(host=address(), depth=depth or GigEDepthSettings(), **settings)
    return GigECameraEmulator(source, of_camera, depth_source=depth_source)
