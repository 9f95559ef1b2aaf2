"""A small real rosbridge server that speaks the v2 JSON protocol, and what the tests of vehicle interfaces share."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from typing import Any, TypeVar

from websockets.exceptions import ConnectionClosed
from websockets.sync.server import Server, ServerConnection, serve

from chauffeur.concept import Parameters
from chauffeur.worlds.ros import VehicleInterface

HOST = "127.0.0.1"
FOLLOWER = "/config/waypoint_follower"
REPLANNER = "/config/waypoint_replanner"
ENGAGE = "/vehicle/engage"

Car = TypeVar("Car", bound=VehicleInterface)


def eventually(true: Callable[[], Any], within_s: float = 5.0) -> Any:
    """What `true` gives once it is true; fails when it never is."""
    end = time.monotonic() + within_s
    while time.monotonic() < end:
        if value := true():
            return value
        time.sleep(0.005)
    raise AssertionError(f"not within {within_s} s: {true}")


def free_port() -> int:
    with socket.create_server((HOST, 0)) as sock:
        return sock.getsockname()[1]


@contextmanager
def opening(make: Callable[..., Car]) -> Iterator[Callable[..., Car]]:
    """`make`; whatever it made is closed in the end."""
    with ExitStack() as made:
        yield lambda *given, **settings: made.enter_context(closing(make(*given, **settings)))


def wish(speed_mps: float) -> Parameters:
    """A speed, with a look-ahead that every stack of the tests takes."""
    return Parameters(speed_mps, 8.0, 2.0)


def counts(car: VehicleInterface) -> dict[str, int]:
    """What an interface counted."""
    return dict(car.state().counts)


class Bridge:
    """Topics shared by its clients, as a rosbridge server with nothing behind it."""

    def __init__(self, port: int = 0) -> None:
        self.published: list[tuple[str, dict[str, Any]]] = []
        self.types: dict[str, str] = {}
        self.subscribed: dict[str, list[ServerConnection]] = {}
        self.clients: list[ServerConnection] = []
        self.latched: dict[str, dict[str, Any]] = {}
        self.nodes: dict[str, list[str]] = {}
        """Nodes that listen behind the server, by topic, as `rosapi` names them."""
        self.has_rosapi = True
        self._lock = threading.Lock()
        self._server: Server = serve(self._client, HOST, port, compression=None, close_timeout=0.2)
        self.port: int = self._server.socket.getsockname()[1]
        self.url = f"ws://{HOST}:{self.port}"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def close(self) -> None:
        self._server.shutdown()
        for client in self.clients:
            with suppress(OSError):
                client.socket.shutdown(socket.SHUT_RDWR)

    def say(self, topic: str, message: Any) -> None:
        for client in self.subscribed.get(topic, []):
            with suppress(ConnectionClosed):
                client.send(json.dumps({"op": "publish", "topic": topic, "msg": message}))

    def _client(self, client: ServerConnection) -> None:
        self.clients.append(client)
        with suppress(ConnectionClosed):
            for text in client:
                with self._lock:
                    self._take(client, json.loads(text))

    def _take(self, client: ServerConnection, said: dict[str, Any]) -> None:
        op, topic = said["op"], said.get("topic", "")
        if op == "advertise":
            if self.types.setdefault(topic, said["type"]) != said["type"]:
                self._complain(
                    client, said, f"Tried to register {topic} as {said['type']}, but it is {self.types[topic]}"
                )
        elif op == "subscribe":
            self.subscribed.setdefault(topic, []).append(client)
            if topic in self.latched:
                client.send(json.dumps({"op": "publish", "topic": topic, "msg": self.latched[topic]}))
        elif op == "publish":
            if topic not in self.types:
                self._complain(client, said, f"Cannot infer topic type for topic {topic} as it is not yet advertised")
                return
            self.published.append((topic, said["msg"]))
            self.latched[topic] = said["msg"]
            self.say(topic, said["msg"])

        elif op == "call_service":
            values = (
                {"subscribers": self.nodes.get(said["args"]["topic"], [])} if self.has_rosapi else "no such service"
            )
            answer = {"op": "service_response", "id": said["id"], "values": values, "result": self.has_rosapi}
            client.send(json.dumps(answer))

    def _complain(self, client: ServerConnection, said: dict[str, Any], words: str) -> None:
        client.send(json.dumps({"op": "status", "level": "error", "id": said.get("id"), "msg": words}))
