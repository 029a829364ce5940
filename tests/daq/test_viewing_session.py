"""A session that is looked at from elsewhere while it is recorded: nothing of it depends on who looks."""

import asyncio
import json
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from websockets.asyncio.client import connect

from daq.acquisition.client import Acquisition
from daq.progress import silent
from daq.recording.folder import verify_checksums
from daq.recording.reader import Recording
from daq.rig import Rig, read_rig, write_rig
from daq.session.session import Label
from daq.trajectories import PULL, Dwell
from daq.viewers import Viewers
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.virtual_rig.processes import VirtualRigSettings

SHORT = replace(
    PULL, steps=1, step_length=0.002, return_steps=1, dwell=Dwell(rest_s=0.3, settle_s=0.1, measure_s=0.3)
)
TOKEN = "a-token-that-is-long-enough"


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    settings = VirtualRigSettings(SpringPhantom(GRASP_CENTRE, placed_beads(1)), seed=1, frames_per_s=4.0)
    with virtual_rig(tmp_path_factory.mktemp("laboratory"), settings) as running:
        yield replace(read_rig(running.rig_path), viewers=Viewers(port=0, token=TOKEN))


def test_a_session_is_seen_and_recorded_whole_while_one_viewer_reads_and_one_does_not(
    rig: Rig, tmp_path: Path
) -> None:
    seen: dict[int, int] = {}
    ended = threading.Event()

    async def look(port: int) -> None:
        address = f"ws://127.0.0.1:{port}/?token={TOKEN}"
        # who has not read what waits for it would read it all before it parts, or wait for ten seconds
        asking = partial(connect, address, subprotocols=["foxglove.sdk.v1"], close_timeout=0.1)
        async with asking() as viewer, asking(max_queue=1) as sleeper:
            for one in (viewer, sleeper):
                await one.recv()
                channels = json.loads(await one.recv())["channels"]
                asked = [{"id": channel["id"], "channelId": channel["id"]} for channel in channels]
                await one.send(json.dumps({"op": "subscribe", "subscriptions": asked}))
            while not ended.is_set():
                try:
                    frame = await asyncio.wait_for(viewer.recv(), 0.5)
                except TimeoutError:
                    continue
                number = int.from_bytes(frame[1:5], "little")
                seen[number] = seen.get(number, 0) + 1

    with Acquisition(rig) as acquisition:
        assert acquisition.viewers is not None
        looking = threading.Thread(target=lambda port=acquisition.viewers.port: asyncio.run(look(port)))
        looking.start()
        deadline = time.monotonic() + 20
        while not seen and time.monotonic() < deadline:
            acquisition.poll(0.05)
        info = acquisition.record(SHORT.trajectory(), tmp_path / "s", Label("pull"), silent)
        ended.set()
        looking.join()
    assert info.state == "sealed"
    assert not any("not written" in problem for problem in info.problems)
    assert verify_checksums(tmp_path / "s") == []
    assert len(Recording(tmp_path / "s").force) == info.samples["/force/wrench"] > 500
    assert seen[1] > 50  # force
    assert {2, 4, 5, 6} <= seen.keys()  # pose, both cameras, state
    assert TOKEN not in (tmp_path / "s" / "rig.toml").read_text(encoding="utf-8")
    assert read_rig(tmp_path / "s" / "rig.toml", to_connect=False).viewers is None


def test_a_rig_file_says_who_may_look_on(rig: Rig, tmp_path: Path) -> None:
    write_rig(rig, tmp_path / "rig.toml")
    assert read_rig(tmp_path / "rig.toml").viewers == Viewers(port=0, token=TOKEN)
