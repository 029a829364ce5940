"""The live view for programs of the Foxglove protocol, looked at by a client of another library."""

import asyncio
import json
import struct
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import InvalidStatus

from daq.acquisition.messages import StreamCounts, Telemetry
from daq.acquisition.viewing.channels import Analysis
from daq.acquisition.viewing.protocol import (
    Subscribe,
    UnknownRequestError,
    Unsubscribe,
    understood,
)
from daq.acquisition.viewing.server import LiveServer
from daq.errors import SessionError
from daq.viewers import Viewers
from robot_drivers.clock import host_time_ns

TOKEN = "correct-horse-battery"
WRENCH = np.array([1.0, 2.0, 3.0, 0.1, 0.2, 0.3])
IMAGE = np.arange(24 * 32, dtype=np.uint8).reshape(24, 32) // 4


def telemetry(**changes: Any) -> Telemetry:
    now_s = host_time_ns() * 1e-9
    told: dict[str, Any] = {
        "time_ns": host_time_ns(),
        "state": "pulling",
        "step": 2,
        "steps": 5,
        "session": Path("sessions/P07_pull"),
        "held": "",
        "counts": {"force": StreamCounts(10, 1, 10, 0, 0.0, 0.0)},
        "force": np.array([[now_s, *WRENCH], [now_s + 0.005, *(2 * WRENCH)]]),
        "pose": np.array([[now_s, 0.4, 0.1, 0.2, 0.5, 0.5, -0.5, 0.5]]),
        "images": {"left": IMAGE},
        "zero": None,
        "problems": ("one thing",),
    }
    return Telemetry(**{**told, **changes})


@pytest.fixture
def server() -> Iterator[LiveServer]:
    with LiveServer(Viewers(port=0), ("left", "right")) as one:
        yield one


def looking(
    server: LiveServer, act: Callable[[ClientConnection], Awaitable[Any]], path: str = "/", **options: Any
) -> Any:
    """What a viewer comes to know that connects and acts."""

    async def look() -> Any:
        address = f"ws://127.0.0.1:{server.port}{path}"
        names = options.pop("subprotocols", ["foxglove.sdk.v1"])
        async with connect(address, subprotocols=names, **options) as connection:
            return await asyncio.wait_for(act(connection), 10)

    return asyncio.run(look())


async def advertised(connection: ClientConnection) -> dict[str, dict]:
    info, told = json.loads(await connection.recv()), json.loads(await connection.recv())
    assert (info["op"], info["capabilities"]) == ("serverInfo", [])
    assert told["op"] == "advertise"
    return {channel["topic"]: channel for channel in told["channels"]}


async def subscribed(connection: ClientConnection, *topics: str) -> dict[int, dict]:
    channels = await advertised(connection)
    wanted = dict(enumerate((channels[topic] for topic in topics), start=100))
    asked = [{"id": number, "channelId": channel["id"]} for number, channel in wanted.items()]
    await connection.send(json.dumps({"op": "subscribe", "subscriptions": asked}))
    # an answer to something unknown tells that what came before it was heard
    await connection.send("{}")
    assert json.loads(await connection.recv())["op"] == "status"
    return wanted


def decoded(channel: dict, data: bytes) -> Any:
    """A message by the definition that the channel advertises, as a reader that knows nothing else."""
    if channel["encoding"] == "json":
        return json.loads(data)
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(channel["schema"], channel["schemaName"]))
    return store.deserialize_cdr(data, channel["schemaName"])


async def messages(
    connection: ClientConnection, wanted: dict[int, dict], count: int
) -> list[tuple[str, int, Any]]:
    found = []
    for _ in range(count):
        frame = await connection.recv()
        opcode, subscription, time_ns = struct.unpack_from("<BIQ", frame)
        assert opcode == 1
        channel = wanted[subscription]
        found.append((channel["topic"], time_ns, decoded(channel, frame[13:])))
    return found


@pytest.mark.parametrize("subprotocol", ["foxglove.sdk.v1", "foxglove.websocket.v1"])
def test_a_viewer_sees_force_pose_images_and_state_at_their_times(
    server: LiveServer, subprotocol: str
) -> None:
    told = telemetry()

    async def act(connection: ClientConnection) -> list[tuple[str, int, Any]]:
        assert connection.subprotocol == subprotocol
        wanted = await subscribed(connection, "/force/wrench", "/robot/pose", "/camera/left/image", "/state")
        server.tell(told)
        return await messages(connection, wanted, 5)

    before = time.time_ns()
    found = looking(server, act, subprotocols=[subprotocol])
    wrenches = [(time_ns, one) for topic, time_ns, one in found if topic == "/force/wrench"]
    assert [one.wrench.force.z for _, one in wrenches] == [3.0, 6.0]
    assert [one.wrench.torque.y for _, one in wrenches] == [0.2, 0.4]
    for time_ns, one in wrenches:
        assert one.header.stamp.sec * 10**9 + one.header.stamp.nanosec == time_ns
        assert abs(time_ns - before) < 5 * 10**9  # unix time
    (pose,) = [one.pose for topic, _, one in found if topic == "/robot/pose"]
    assert (pose.position.x, pose.orientation.w, pose.orientation.y) == (0.4, 0.5, -0.5)
    (image,) = [one for topic, _, one in found if topic == "/camera/left/image"]
    pixels = cv2.imdecode(np.asarray(image.data), cv2.IMREAD_UNCHANGED)
    assert image.format == "jpeg"
    np.testing.assert_allclose(pixels.astype(float), IMAGE, atol=12)
    (state,) = [one for topic, _, one in found if topic == "/state"]
    assert (state["state"], state["step"], state["session"], state["lost"]) == (
        "pulling",
        2,
        "P07_pull",
        {"force": 1},
    )


def test_a_viewer_sees_what_was_made_of_the_measurements(server: LiveServer) -> None:
    beads = np.array([[0.001, 0.002, 0.003], [np.nan, np.nan, np.nan], [0.004, 0.005, 0.006]])
    measured_ns = host_time_ns()
    analysis = Analysis(measured_ns, 3, beads, {"youngs_modulus": (12e3, 11e3, 13e3)})

    async def act(connection: ClientConnection) -> list[tuple[str, int, Any]]:
        wanted = await subscribed(connection, "/tissue/beads", "/estimate")
        server.tell(analysis)
        return await messages(connection, wanted, 2)

    (_, time_ns, seen), (_, _, estimate) = looking(server, act)
    assert abs(time_ns - time.time_ns()) < 5 * 10**9
    assert seen.header.frame_id == "tissue"
    places = [[one.position.x, one.position.y, one.position.z] for one in seen.poses]
    np.testing.assert_array_equal(places, beads)
    assert [one.orientation.w for one in seen.poses] == [1.0] * 3
    assert estimate == {
        "step": 3,
        "parameters": {"youngs_modulus": {"value": 12e3, "low": 11e3, "high": 13e3}},
    }


def test_a_viewer_gets_what_it_subscribes_to_and_nothing_else(server: LiveServer) -> None:
    async def act(connection: ClientConnection) -> tuple[str, str]:
        wanted = await subscribed(connection, "/state")
        server.tell(telemetry())
        ((first, _, _),) = await messages(connection, wanted, 1)
        await connection.send(json.dumps({"op": "unsubscribe", "subscriptionIds": list(wanted)}))
        await connection.send("{}")
        assert json.loads(await connection.recv())["op"] == "status"
        server.tell(telemetry())
        await connection.send("{}")
        return first, json.loads(await connection.recv())["op"]

    assert looking(server, act) == ("/state", "status")


@pytest.mark.parametrize(
    "request_of_a_viewer",
    [
        b"\x01\x00\x00\x00\x00anything",
        json.dumps({"op": "advertise", "channels": [{"id": 1, "topic": "/cmd", "encoding": "json"}]}),
        json.dumps({"op": "setParameters", "parameters": []}),
        json.dumps({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 99}]}),
        json.dumps({"op": "subscribe", "subscriptions": "all"}),
        json.dumps({"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]}),
        "[" * 20000,
        "no JSON",
    ],
)
def test_whatever_else_a_viewer_sends_changes_nothing_and_is_told_so(
    server: LiveServer, request_of_a_viewer: str | bytes
) -> None:
    async def act(connection: ClientConnection) -> dict:
        await advertised(connection)
        await connection.send(request_of_a_viewer)
        return json.loads(await connection.recv())

    answer = looking(server, act)
    assert (answer["op"], answer["level"]) == ("status", 1)


@given(st.one_of(st.binary(max_size=60), st.text(max_size=60), st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
        st.sampled_from(["op", "subscriptions", "subscriptionIds", "id", "channelId"]), inner, max_size=4
    ),
    max_leaves=12,
).map(json.dumps)))  # fmt: skip
def test_any_request_is_understood_or_refused(request_of_a_viewer: str | bytes) -> None:
    try:
        assert isinstance(understood(request_of_a_viewer), Subscribe | Unsubscribe)
    except UnknownRequestError as error:
        assert str(error)


def test_a_viewer_that_does_not_read_keeps_nobody(server: LiveServer) -> None:
    """Ten seconds of tellings go by in an instant; the viewer that slept sees the newest."""
    large = {"left": np.random.default_rng(0).integers(0, 255, (240, 320), np.uint8)}

    async def act(connection: ClientConnection) -> float:
        await subscribed(connection, "/camera/left/image", "/force/wrench")
        begin = time.perf_counter()
        for _ in range(300):
            server.tell(telemetry(images=large))
        spent = time.perf_counter() - begin
        await asyncio.sleep(0.3)
        return spent

    assert looking(server, act, max_queue=1) < 1.0


def test_nothing_is_made_for_nobody(server: LiveServer, monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> Iterator[object]:
        raise AssertionError("nobody looks on")

    monkeypatch.setattr("daq.acquisition.viewing.server.shown", never)
    server.tell(telemetry())


def status_of(server: LiveServer, path: str = "/", **options: Any) -> int:
    """With what a viewer is let in or refused."""

    async def act(connection: ClientConnection) -> int:
        await advertised(connection)
        return 101

    try:
        return looking(server, act, path, **options)
    except InvalidStatus as refused:
        return refused.response.status_code


def test_with_a_token_only_who_knows_it_is_let_in() -> None:
    with LiveServer(Viewers(port=0, token=TOKEN), ()) as server:
        assert status_of(server) == 401
        assert status_of(server, f"/?token={TOKEN[:-1]}") == 401
        assert status_of(server, "/?token=%ff") == 401
        assert status_of(server, additional_headers={"Authorization": "Bearer wrong"}) == 401
        assert status_of(server, f"/?token={TOKEN}") == 101
        assert status_of(server, additional_headers={"Authorization": f"Bearer {TOKEN}"}) == 101


def test_a_web_page_of_another_site_is_not_let_in(server: LiveServer) -> None:
    assert status_of(server, origin="https://example.org") == 403
    assert status_of(server, origin="http://localhost:8080") == 403
    assert status_of(server, origin="https://app.foxglove.dev") == 101
    assert status_of(server) == 101


def test_so_many_may_look_on_and_no_more(server: LiveServer) -> None:
    async def act(first: ClientConnection) -> list[int]:
        await advertised(first)
        others = [
            await connect(f"ws://127.0.0.1:{server.port}", subprotocols=["foxglove.sdk.v1"]) for _ in range(7)
        ]
        for one in others:
            await one.recv()
        try:
            await connect(f"ws://127.0.0.1:{server.port}", subprotocols=["foxglove.sdk.v1"])
        except InvalidStatus as refused:
            return [refused.response.status_code]
        finally:
            for one in others:
                await one.close()
        return []

    assert looking(server, act) == [503]


def test_a_port_that_is_taken_is_told(server: LiveServer) -> None:
    with pytest.raises(SessionError, match=r"nobody can listen on 127\.0\.0\.1 port \d+ .*name another port"):
        LiveServer(Viewers(port=server.port), ())


def test_once_closed_nobody_listens() -> None:
    server = LiveServer(Viewers(port=0), ())
    server.close()
    server.tell(telemetry())
    with pytest.raises(OSError, match="onnect"):
        status_of(server)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"bind_address": "0.0.0.0"}, "token is missing"),
        ({"bind_address": "::"}, "token is missing"),
        ({"bind_address": "192.168.1.4"}, "token is missing"),
        ({"bind_address": "lab.example"}, "must be an address"),
        ({"token": "short"}, "16 letters"),
        ({"port": 70000}, "0 to 65535"),
    ],
)
def test_a_rig_file_cannot_open_the_view_to_others_without_a_token(
    settings: dict[str, Any], told: str
) -> None:
    with pytest.raises(ValueError, match=told):
        Viewers(**settings)


@pytest.mark.parametrize("address", ["127.0.0.1", "127.9.9.9", "::1"])
def test_this_computer_alone_needs_no_token(address: str) -> None:
    assert Viewers(bind_address=address).token == ""
