"""Which emulated laboratory is started for which devices, and what it has to say."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from daq.rig import Rig, write_rig
from daq.virtual_rig.layout import Addresses, rig_description
from gui.rig.laboratory import CALIBRATIONS_FOLDER, Laboratory, Wanted, roles

ADDRESSES = Addresses(1, 2, 3, 4, 5, 6, ("tcp://127.0.0.1:7", "tcp://127.0.0.1:8"))
CLOCK = Path("clock")


@dataclass
class Emulators:
    """Stands for the processes of a laboratory, and notes how it was asked for."""

    folder: Path
    asked: list[Wanted] = field(default_factory=list)
    told: list[str] = field(default_factory=list)

    @property
    def rig_path(self) -> Path:
        return self.folder / "rig.toml"

    @property
    def operator(self) -> "Emulators":
        return self

    def show_board(self, number: int) -> bool:
        return False

    def touch_point(self, number: int) -> bool:
        return False

    def notices(self) -> list[str]:
        told, self.told = self.told, []
        return told

    @contextmanager
    def run(self, wanted: Wanted) -> Iterator["Emulators"]:
        self.asked.append(wanted)
        addresses = replace(ADDRESSES, camera_urls=ADDRESSES.camera_urls[: wanted.cameras])
        rig = rig_description(addresses, self.folder / "calibration.toml")
        clock = None if wanted.beside_real_devices else self.folder / CLOCK
        write_rig(replace(rig, laboratory_clock=clock), self.rig_path)
        yield self


@pytest.fixture
def emulators(tmp_path: Path) -> Emulators:
    return Emulators(tmp_path)


@pytest.fixture
def own(tmp_path: Path) -> Rig:
    """A rig of real devices."""
    return replace(rig_description(ADDRESSES, tmp_path / "stereo.toml"), name="ours")


def prepared(qtbot: QtBot, laboratory: Laboratory, emulated: frozenset[str]) -> Rig:
    with qtbot.waitSignal(laboratory.prepared, timeout=30_000) as signal:
        laboratory.prepare(emulated)
    (rig,) = signal.args
    assert isinstance(rig, Rig)
    return rig


@contextmanager
def opened(own: Rig | None, emulators: Emulators) -> Iterator[Laboratory]:
    laboratory = Laboratory(own, emulators.run, emulators.folder / CALIBRATIONS_FOLDER)
    yield laboratory
    laboratory.end()


def test_a_laboratory_of_emulated_devices_alone_has_a_time_of_its_own(
    qtbot: QtBot, emulators: Emulators, tmp_path: Path
) -> None:
    with opened(None, emulators) as laboratory:
        rig = prepared(qtbot, laboratory, frozenset())
    assert emulators.asked == [Wanted()]
    assert rig.laboratory_clock == tmp_path / CLOCK


@pytest.mark.parametrize("count", [1, 2, 3])
def test_beside_real_devices_it_is_another_one_that_lives_in_real_time(
    qtbot: QtBot, emulators: Emulators, own: Rig, count: int
) -> None:
    every = roles(own)
    with opened(own, emulators) as laboratory:
        assert prepared(qtbot, laboratory, frozenset(every)).laboratory_clock is not None
        assert prepared(qtbot, laboratory, frozenset(every[:count])).laboratory_clock is None
        assert prepared(qtbot, laboratory, frozenset(every[:count])).laboratory_clock is None
        assert prepared(qtbot, laboratory, frozenset()).laboratory_clock is None
    assert emulators.asked == [Wanted(), Wanted(beside_real_devices=True)]


@pytest.mark.parametrize(("cameras", "measuring"), [(1, 1), (2, 2), (3, 2)])
def test_it_has_as_many_cameras_as_the_rig_measures_with(
    qtbot: QtBot, emulators: Emulators, own: Rig, cameras: int, measuring: int
) -> None:
    third = replace(own.cameras[0], name="third")
    mine = replace(own, cameras=(*own.cameras, third)[:cameras])
    with opened(mine, emulators) as laboratory:
        rig = prepared(qtbot, laboratory, frozenset(roles(mine)))
    assert emulators.asked[0].cameras == measuring
    assert [camera.name for camera in rig.cameras] == [camera.name for camera in mine.cameras[:2]]
    assert (rig.planar_view is None) == (cameras > 1)


def test_what_goes_wrong_in_it_is_told(qtbot: QtBot, emulators: Emulators) -> None:
    with opened(None, emulators) as laboratory:
        prepared(qtbot, laboratory, frozenset())
        with qtbot.waitSignal(laboratory.warned, timeout=30_000) as signal:
            emulators.told.append("the virtual phantom is behind")
    assert signal.args == ["the virtual phantom is behind"]
