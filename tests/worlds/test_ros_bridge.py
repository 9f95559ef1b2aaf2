"""A vehicle behind rosbridge. The server is a small real one that speaks the v2 JSON protocol; `roslibpy`, which is
somebody else's client of that protocol, listens at its other end."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import pytest

pytest.importorskip("websockets", reason="websockets is not installed: pip install 'chauffeur[ros]'")

from rosbridge_server import FOLLOWER, HOST, REPLANNER, Bridge, counts, eventually, free_port, opening, wish

from chauffeur.concept import Parameters
from chauffeur.worlds.ros import VehicleError, VehicleInterface, VehicleLimits, VehicleRefusalError, rosbridge
from chauffeur.worlds.ros.autoware import CANDIDATE_TOPIC, CLEAR_TOPIC, MODE_TOPIC, VELOCITY_TOPIC, Autoware
from chauffeur.worlds.ros.autoware_ai import FOLLOWER_TYPE, REPLANNER_TYPE, AutowareAi, Replanner
from chauffeur.worlds.ros.rosbridge import RosbridgeSettings, RosbridgeVehicle

pytestmark = pytest.mark.server

AI = AutowareAi(VehicleLimits(15.0, (4.0, 20.0)), Replanner(planned_max_mps=12.0))
UNIVERSE = Autoware(VehicleLimits(15.0))

KINDS = {"bool": bool, "int32": int, "float32": float, "string": str, "Header": dict}
DEFINITIONS = {
    FOLLOWER_TYPE: """
Header header
int32 param_flag
float32 velocity
float32 lookahead_distance
float32 lookahead_ratio
float32 minimum_lookahead_distance
float32 displacement_threshold
float32 relative_angle_threshold
""",
    REPLANNER_TYPE: """
string multi_lane_csv
bool replanning_mode
bool use_decision_maker
float32 velocity_max
float32 velocity_min
float32 accel_limit
float32 decel_limit
float32 radius_thresh
float32 radius_min
bool resample_mode
float32 resample_interval
int32 velocity_offset
int32 end_point_offset
int32 braking_distance
bool replan_curve_mode
bool replan_endpoint_mode
bool overwrite_vmax_mode
bool realtime_tuning_mode
""",
}
"""`autoware_config_msgs` as Autoware.AI 1.12 to 1.14 builds it (md5 a96d66ec... and 377fcfc6...)."""


def fits(message: dict[str, Any], type_name: str) -> bool:
    """Whether a message has every field of its type and no other, each of its kind."""
    fields = dict(reversed(line.split()) for line in DEFINITIONS[type_name].strip().splitlines())
    return {name: type(value) for name, value in message.items()} == {n: KINDS[kind] for n, kind in fields.items()}


ROSLIBPY = """
import json, sys, time
import roslibpy
client = roslibpy.Ros(host="127.0.0.1", port=int(sys.argv[1]))
client.run(timeout=10)
def heard(topic):
    return lambda message: print(json.dumps({"topic": topic, "msg": message, "came": time.time()}), flush=True)
for topic, kind in zip(sys.argv[2::2], sys.argv[3::2]):
    roslibpy.Topic(client, topic, kind, queue_length=0).subscribe(heard(topic))
print(json.dumps({"ready": True}), flush=True)
while True:
    time.sleep(1)
"""

Opened = Callable[..., RosbridgeVehicle]


@pytest.fixture
def bridge() -> Iterator[Bridge]:
    server = Bridge()
    yield server
    server.close()


@pytest.fixture
def vehicle() -> Iterator[Opened]:
    def make(url: str, stack: AutowareAi | Autoware = AI) -> RosbridgeVehicle:
        return RosbridgeVehicle(stack, RosbridgeSettings(url), retry_s=0.05)

    with opening(make) as opened:
        yield opened


def test_a_wish_reaches_another_client_with_every_field(bridge: Bridge, vehicle: Opened) -> None:
    pytest.importorskip("roslibpy", reason="roslibpy is not installed: pip install 'chauffeur[ros]'")
    car = vehicle(bridge.url)
    assert isinstance(car, VehicleInterface)
    kinds = [
        word for topic in (FOLLOWER, REPLANNER) for word in (topic, eventually(lambda t=topic: bridge.types.get(t)))
    ]
    command = [sys.executable, "-c", ROSLIBPY, str(bridge.port), *kinds]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True
    )
    said: list[dict[str, Any]] = []
    reader = threading.Thread(
        target=lambda: [said.append(json.loads(line)) for line in process.stdout or ()], daemon=True
    )
    reader.start()
    try:
        eventually(lambda: said and FOLLOWER in bridge.subscribed and REPLANNER in bridge.subscribed, within_s=15.0)
        before_s = time.time()
        published = car.apply(wish(10.0))
        eventually(lambda: len(said) == 3)
        got = {one["topic"]: one["msg"] for one in said[1:]}
        assert got[REPLANNER] == published.messages[0].fields
        header = got[FOLLOWER].pop("header")
        assert got[FOLLOWER] == published.messages[1].fields
        assert header["seq"] == 1
        assert before_s - 1 <= header["stamp"]["secs"] <= time.time()
        for number in range(100):
            car.apply(wish(number / 10))
            time.sleep(0.002)
        eventually(lambda: any(o.get("msg", {}).get("velocity_max") == pytest.approx(35.64) for o in said))
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait(timeout=10)
        reader.join(timeout=5)
    assert car.state().delivered


def test_messages_have_every_field_of_their_types(bridge: Bridge, vehicle: Opened) -> None:
    vehicle(bridge.url).apply(wish(10.0))
    eventually(lambda: len(bridge.published) == 2)
    for topic, message in bridge.published:
        assert fits(message, bridge.types[topic]), message


def test_autoware_of_ros_2_behind_a_bridge(bridge: Bridge, vehicle: Opened) -> None:
    car = vehicle(bridge.url, UNIVERSE)
    eventually(lambda: VELOCITY_TOPIC in bridge.subscribed and MODE_TOPIC in bridge.subscribed)
    assert bridge.types[CANDIDATE_TOPIC] == "autoware_internal_planning_msgs/msg/VelocityLimit"
    car.apply(wish(4.0))
    eventually(lambda: len(bridge.published) == 2)
    (clear, clearing), (candidate, limit) = bridge.published
    assert (clear, clearing["command"]) == (CLEAR_TOPIC, False)
    assert (candidate, limit["max_velocity"], limit["sender"]) == (CANDIDATE_TOPIC, 4.0, "chauffeur")
    assert set(limit["stamp"]) == {"sec", "nanosec"}
    bridge.say(VELOCITY_TOPIC, {"header": {}, "longitudinal_velocity": 2.5})
    bridge.say(MODE_TOPIC, {"mode": 2, "is_in_transition": False})
    eventually(lambda: car.state().speed_mps == 2.5 and car.state().mode == "autonomous")
    for nonsense in (None, [], {"mode": "x"}, {"longitudinal_velocity": None}, {"longitudinal_velocity": "1e999"}):
        bridge.say(VELOCITY_TOPIC, nonsense)
        bridge.say(MODE_TOPIC, nonsense)
    for client in bridge.clients:
        for text in ("no json", "[]", "[" * 50_000, '{"op": 5}', '{"op": "publish"}'):
            client.send(text)
    bridge.say(MODE_TOPIC, {"mode": 9, "is_in_transition": True})
    eventually(lambda: car.state().mode == "unknown (9), in transition")
    assert car.state().link == "up"
    assert car.state().speed_mps == 2.5


def test_a_server_that_comes_late_or_again_gets_the_newest_wish_once(vehicle: Opened) -> None:
    port = free_port()
    car = vehicle(f"ws://{HOST}:{port}")
    eventually(lambda: "the connection is refused" in car.state().words)
    for speed in (3.0, 4.0, 5.0):
        begun = time.perf_counter()
        car.apply(wish(speed))
        assert time.perf_counter() - begun < 0.1
    assert not car.state().delivered
    for round_ in (1, 2):
        server = Bridge(port)
        eventually(lambda server=server: len(server.published) == 2)
        time.sleep(0.05)
        assert [(t, m.get("velocity_max", m.get("velocity"))) for t, m in server.published] == [
            (REPLANNER, 18.0),
            (FOLLOWER, 18.0),
        ]
        eventually(lambda: car.state().delivered)
        assert counts(car)["connections"] == round_
        server.close()
        eventually(lambda: car.state().link == "connecting")


def test_what_the_server_refuses_is_said(vehicle: Opened, bridge: Bridge) -> None:
    bridge.types[FOLLOWER] = "autoware_msgs/ConfigWaypointFollower"
    car = vehicle(bridge.url)
    state = eventually(lambda: (now := car.state()).link == "refused" and now)
    assert "but it is autoware_msgs/ConfigWaypointFollower" in state.words
    car.apply(wish(3.0))
    assert not car.state().delivered


@pytest.mark.parametrize(
    ("reply", "words"),
    [
        (b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n", "no rosbridge server"),
        (b"SSH-2.0-OpenSSH_9.2\r\n\r\n", "no rosbridge server"),
        (b"", "no rosbridge server"),
        (None, "does not answer within"),
    ],
)
def test_what_is_no_server_is_said_and_holds_nobody_up(
    reply: bytes | None, words: str, vehicle: Opened, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rosbridge, "OPENING_S", 0.4)
    with socket.create_server((HOST, 0)) as listener:

        def answer() -> None:
            while reply is not None:
                try:
                    sock, _ = listener.accept()
                except OSError:
                    return
                with sock:
                    sock.recv(4096)
                    sock.sendall(reply)

        threading.Thread(target=answer, daemon=True).start()
        car = vehicle(f"ws://{HOST}:{listener.getsockname()[1]}")
        begun = time.perf_counter()
        car.apply(wish(3.0))
        assert time.perf_counter() - begun < 0.1
        said = eventually(lambda: counts(car).get("connection_failures") and car.state().words)
        assert words in said
        car.close()
        listener.shutdown(socket.SHUT_RDWR)


def test_a_server_that_falls_silent_is_left(bridge: Bridge, vehicle: Opened, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rosbridge, "SILENCE_S", 0.4)
    relay = socket.create_server((HOST, 0))
    stop = threading.Event()

    def pump(source: socket.socket, target: socket.socket) -> None:
        with suppress(OSError):
            while (data := source.recv(65536)) and not stop.is_set():
                target.sendall(data)
        stop.wait()  # nothing passes any more, and nobody is told

    def connect() -> None:
        with suppress(OSError):
            while True:
                ours, _ = relay.accept()
                theirs = socket.create_connection((HOST, bridge.port))
                for pair in ((ours, theirs), (theirs, ours)):
                    threading.Thread(target=pump, args=pair, daemon=True).start()

    threading.Thread(target=connect, daemon=True).start()
    car = vehicle(f"ws://{HOST}:{relay.getsockname()[1]}")
    eventually(lambda: car.state().link == "up")
    stop.set()
    eventually(lambda: "lost" in " ".join(car.state().notes) or "ended the connection" in " ".join(car.state().notes))
    relay.close()


def test_close_and_refusals(bridge: Bridge, vehicle: Opened) -> None:
    car = vehicle(bridge.url)
    for bad in (wish(99.0), Parameters(3.0, 8.0, 2.0, lane=1)):
        with pytest.raises(VehicleRefusalError):
            car.apply(bad)
    car.apply(wish(3.0))
    car.release()
    car.close()
    car.close()
    assert car.state().link == "closed"
    with pytest.raises(VehicleError, match="closed"):
        car.apply(wish(3.0))
    eventually(lambda: (REPLANNER, 43.2) in [(t, m.get("velocity_max")) for t, m in bridge.published])
    for url in ("http://127.0.0.1:9090", "ws://", "ws://h:notaport", "9090"):
        with pytest.raises(VehicleError, match="no rosbridge server"):
            RosbridgeVehicle(AI, RosbridgeSettings(url))
