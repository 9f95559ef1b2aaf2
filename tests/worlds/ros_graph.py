"""A small ROS 1 graph without ROS: a master, subscribers and a publisher, on loopback, speaking the real protocols."""

from __future__ import annotations

import socket
import struct
import threading
import time
import xmlrpc.client
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from socketserver import ThreadingMixIn
from typing import Any, TypeVar
from xmlrpc.server import SimpleXMLRPCServer

from chauffeur.concept import Parameters
from chauffeur.worlds.ros import VehicleInterface

HOST = "127.0.0.1"
FOLLOWER = "/config/waypoint_follower"
REPLANNER = "/config/waypoint_replanner"
ENGAGE = "/vehicle/engage"
TYPES = {
    FOLLOWER: "autoware_config_msgs/ConfigWaypointFollower",
    REPLANNER: "autoware_config_msgs/ConfigWaypointReplanner",
    ENGAGE: "std_msgs/Bool",
}
MD5 = {
    FOLLOWER: "a96d66ec56e0a5b1d46eff2062a223b3",
    REPLANNER: "377fcfc666c7fdd690ae1373651c353b",
    ENGAGE: "8b94c1b53db61fb6aed406028ad6332a",
}
"""Checksums of the public builds, written down here so that our own computation is compared with something."""

TWIST_MD5 = "98d34b0043a2093cf9d9345ab6eef12e"

Car = TypeVar("Car", bound=VehicleInterface)


def eventually(true: Callable[[], Any], within_s: float = 5.0) -> Any:
    """What `true` gives once it is true; fails when it never is."""
    end = time.monotonic() + within_s
    while time.monotonic() < end:
        if value := true():
            return value
        time.sleep(0.005)
    raise AssertionError(f"not within {within_s} s: {true}")


class _Server(ThreadingMixIn, SimpleXMLRPCServer):
    daemon_threads = True
    block_on_close = False
    allow_reuse_address = True


class Rpc:
    """An XML-RPC server on a thread."""

    def __init__(self, port: int = 0) -> None:
        self.server = _Server((HOST, port), logRequests=False, allow_none=True)
        self.port = self.server.server_address[1]
        self.uri = f"http://{HOST}:{self.port}/"
        self._thread = threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        self.server.shutdown()
        self.server.server_close()
        self._thread.join()


class Master(Rpc):
    """What a node needs of a ROS master."""

    def __init__(self, port: int = 0) -> None:
        super().__init__(port)
        self.nodes: dict[str, str] = {}
        self.publishers: dict[str, dict[str, str]] = {}
        self.subscribers: dict[str, dict[str, str]] = {}
        self.calls: list[str] = []
        self.delay_s = 0.0
        for name in (
            "registerPublisher",
            "unregisterPublisher",
            "registerSubscriber",
            "unregisterSubscriber",
            "lookupNode",
            "getSystemState",
        ):
            self.server.register_function(self._counted(name), name)
        self.start()

    def _counted(self, name: str) -> Callable[..., Any]:
        def answer(*arguments: Any) -> Any:
            self.calls.append(name)
            time.sleep(self.delay_s)
            return getattr(self, name)(*arguments)

        return answer

    def registerPublisher(self, node: str, topic: str, kind: str, uri: str) -> list[Any]:
        self._node(node, uri)
        self.publishers.setdefault(topic, {})[node] = uri
        self._tell(topic)
        return [1, "", list(self.subscribers.get(topic, {}).values())]

    def unregisterPublisher(self, node: str, topic: str, uri: str) -> list[Any]:
        gone = self.publishers.get(topic, {}).pop(node, None)
        self._tell(topic)
        return [1, "", int(gone is not None)]

    def registerSubscriber(self, node: str, topic: str, kind: str, uri: str) -> list[Any]:
        self._node(node, uri)
        self.subscribers.setdefault(topic, {})[node] = uri
        return [1, "", list(self.publishers.get(topic, {}).values())]

    def unregisterSubscriber(self, node: str, topic: str, uri: str) -> list[Any]:
        return [1, "", int(self.subscribers.get(topic, {}).pop(node, None) is not None)]

    def lookupNode(self, caller: str, node: str) -> list[Any]:
        return [1, "", self.nodes[node]] if node in self.nodes else [-1, f"unknown node [{node}]", 0]

    def getSystemState(self, caller: str) -> list[Any]:
        return [
            1,
            "",
            [[[t, list(n)] for t, n in table.items() if n] for table in (self.publishers, self.subscribers)] + [[]],
        ]

    def _node(self, node: str, uri: str) -> None:
        old = self.nodes.get(node)
        self.nodes[node] = uri
        if old and old != uri:  # as a ROS master does
            with suppress(OSError, xmlrpc.client.Error):
                xmlrpc.client.ServerProxy(old).shutdown(
                    "/master", f"[{node}] Reason: new node registered with same name"
                )

    def _tell(self, topic: str) -> None:
        publishers = list(self.publishers.get(topic, {}).values())
        for uri in list(self.subscribers.get(topic, {}).values()):
            with suppress(OSError):
                xmlrpc.client.ServerProxy(uri).publisherUpdate("/master", topic, publishers)


def framed(fields: dict[str, str]) -> bytes:
    parts = [f"{name}={value}".encode() for name, value in fields.items()]
    body = b"".join(struct.pack("<I", len(part)) + part for part in parts)
    return struct.pack("<I", len(body)) + body


def exactly(sock: socket.socket, length: int) -> bytes:
    data = b""
    while len(data) < length:
        got = sock.recv(length - len(data))
        if not got:
            raise ConnectionError("ended")
        data += got
    return data


def one(sock: socket.socket) -> bytes:
    return exactly(sock, struct.unpack("<I", exactly(sock, 4))[0])


def fields_of(header: bytes) -> dict[str, str]:
    fields, at = {}, 0
    while at < len(header):
        (length,) = struct.unpack_from("<I", header, at)
        name, _, value = header[at + 4 : at + 4 + length].decode().partition("=")
        fields[name], at = value, at + 4 + length
    return fields


def topic_address(uri: str, topic: str) -> tuple[str, int]:
    """Where a node serves a topic."""
    code, words, protocol = xmlrpc.client.ServerProxy(uri).requestTopic("/test", topic, [["TCPROS"]])
    assert code == 1, words
    assert protocol[0] == "TCPROS"
    return protocol[1], protocol[2]


def connect(uri: str, topic: str, /, **changed: str) -> socket.socket:
    """A subscriber's connection with its header sent."""
    sock = socket.create_connection(topic_address(uri, topic), timeout=5.0)
    fields = {"callerid": "/test", "topic": topic, "md5sum": MD5[topic], "type": TYPES[topic]} | changed
    sock.sendall(framed(fields))
    return sock


class Subscriber(Rpc):
    """A node that subscribes to one topic and keeps what it gets as (bytes, time it came)."""

    def __init__(self, master: Master, topic: str, name: str = "") -> None:
        super().__init__()
        name = name or {FOLLOWER: "/pure_pursuit", REPLANNER: "/waypoint_replanner"}[topic]
        self.master, self.topic, self.name = master, topic, name
        self.got: list[tuple[bytes, float]] = []
        self.headers: list[dict[str, str]] = []
        self._known: dict[str, socket.socket] = {}
        self._lock = threading.Lock()
        self.server.register_function(self._update, "publisherUpdate")
        self.start()
        code, _, publishers = xmlrpc.client.ServerProxy(master.uri).registerSubscriber(
            name, topic, TYPES[topic], self.uri
        )
        assert code == 1
        self._update("/master", topic, publishers)

    def _update(self, caller: str, topic: str, publishers: list[str]) -> list[Any]:
        for uri in publishers:
            threading.Thread(target=self._read, args=(uri,), daemon=True).start()
        return [1, "", 0]

    def _read(self, uri: str) -> None:
        with self._lock:
            if uri in self._known:
                return
            try:
                sock = self._known[uri] = connect(uri, self.topic, callerid=self.name)
            except OSError:
                return
        sock.settimeout(None)
        try:
            self.headers.append(fields_of(one(sock)))
            while True:
                data = one(sock)
                self.got.append((data, time.perf_counter()))
        except (OSError, ConnectionError):
            with self._lock:
                self._known.pop(uri, None)

    def close(self) -> None:
        xmlrpc.client.ServerProxy(self.master.uri).unregisterSubscriber(self.name, self.topic, self.uri)
        super().close()
        self.vanish()

    def vanish(self) -> None:
        """Without a word to the master."""
        with self._lock:
            for sock in self._known.values():
                with suppress(OSError):
                    sock.shutdown(socket.SHUT_RDWR)
                sock.close()


class VelocityPublisher(Rpc):
    """A node that publishes `/current_velocity`, one connection at a time."""

    def __init__(self, master: Master, md5: str = TWIST_MD5) -> None:
        super().__init__()
        self._listener = socket.create_server((HOST, 0))
        self._md5 = md5
        self.speed_mps: float | bytes = 0.0
        self.connected = 0
        self.server.register_function(
            lambda caller, topic, protocols: [1, "", ["TCPROS", HOST, self._listener.getsockname()[1]]], "requestTopic"
        )
        self.start()
        threading.Thread(target=self._serve, daemon=True).start()
        proxy = xmlrpc.client.ServerProxy(master.uri)
        proxy.registerPublisher("/can_status", "/current_velocity", "geometry_msgs/TwistStamped", self.uri)

    def _serve(self) -> None:
        while True:
            try:
                sock, _ = self._listener.accept()
            except OSError:
                return
            self.connected += 1
            try:
                asked = fields_of(one(sock))
                if asked["md5sum"] not in ("*", self._md5):
                    sock.sendall(framed({"error": "md5sums do not match"}))
                    continue
                sock.sendall(
                    framed({"md5sum": self._md5, "type": "geometry_msgs/TwistStamped", "callerid": "/can_status"})
                )
                while True:
                    sock.sendall(self._message())
                    time.sleep(0.02)
            except (OSError, ConnectionError):
                continue

    def _message(self) -> bytes:
        if isinstance(self.speed_mps, bytes):
            return self.speed_mps
        body = (
            struct.pack("<3I", 1, 0, 0)
            + struct.pack("<I", 4)
            + b"base"
            + struct.pack("<6d", self.speed_mps, 0, 0, 0, 0, 0)
        )
        return struct.pack("<I", len(body)) + body

    def close(self) -> None:
        self._listener.close()
        super().close()


def follower_of(data: bytes) -> dict[str, Any]:
    """A `ConfigWaypointFollower`, read by hand."""
    seq, sec, nanosec, length = struct.unpack_from("<4I", data)
    frame_id = data[16 : 16 + length].decode()
    flag, *floats = struct.unpack_from("<i6f", data, 16 + length)
    assert len(data) == 16 + length + 28
    names = (
        "velocity",
        "lookahead_distance",
        "lookahead_ratio",
        "minimum_lookahead_distance",
        "displacement_threshold",
    )
    values = dict(zip((*names, "relative_angle_threshold"), floats, strict=True))
    return {"seq": seq, "stamp_s": sec + nanosec / 1e9, "frame_id": frame_id, "param_flag": flag, **values}


def replanner_of(data: bytes) -> dict[str, Any]:
    """A `ConfigWaypointReplanner`, read by hand."""
    (length,) = struct.unpack_from("<I", data)
    names = [
        *("replanning_mode", "use_decision_maker", "velocity_max", "velocity_min", "accel_limit", "decel_limit"),
        *("radius_thresh", "radius_min", "resample_mode", "resample_interval", "velocity_offset", "end_point_offset"),
        *("braking_distance", "replan_curve_mode", "replan_endpoint_mode", "overwrite_vmax_mode"),
        "realtime_tuning_mode",
    ]
    form = struct.Struct("<2?6f?f3i4?")
    assert len(data) == 4 + length + form.size
    return {"multi_lane_csv": data[4 : 4 + length].decode()} | dict(
        zip(names, form.unpack_from(data, 4 + length), strict=True)
    )


def free_port() -> int:
    with socket.create_server((HOST, 0)) as sock:
        return sock.getsockname()[1]


def open_files() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


@contextmanager
def closing_all(*things: Any) -> Iterator[None]:
    try:
        yield
    finally:
        for thing in things:
            thing.close()


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


def listening() -> set[str]:
    """Addresses this process listens on, TCP over IPv4."""
    own = {str(link.readlink()) for link in Path("/proc/self/fd").iterdir() if link.is_symlink()}
    lines = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    found = {words[1].partition(":")[0] for words in lines if words[3] == "0A" and f"socket:[{words[9]}]" in own}
    return {socket.inet_ntoa(struct.pack("<I", int(address, 16))) for address in found}
