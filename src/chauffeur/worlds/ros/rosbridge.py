"""A vehicle behind a rosbridge server: the plain JSON protocol (rosbridge v2) over a websocket, ROS 1 or ROS 2.

Why not `roslibpy`: it runs Twisted's one global reactor, which can be started once in a process; it queues what is
published while the server is away and sends all of it afterwards, oldest first; and it waits up to an hour between
attempts. Of a wish only the newest counts, and a lost vehicle is looked for every second.

Protocol: ROSBRIDGE_PROTOCOL.md of github.com/RobotWebTools/rosbridge_suite. It does not tell who listens behind.
"""

from __future__ import annotations

import contextlib
import json
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlsplit

from chauffeur.concept import MissingExtraError
from chauffeur.worlds.ros import autoware, autoware_ai
from chauffeur.worlds.ros.autoware import Autoware
from chauffeur.worlds.ros.autoware_ai import AutowareAi
from chauffeur.worlds.ros.base import Fields, Link, RosVehicleState, TopicMessage, VehicleError
from chauffeur.worlds.ros.threaded import ThreadedVehicle

if TYPE_CHECKING:
    from websockets.sync.client import ClientConnection

RETRY_S: Final = 1.0
"""Pause before the server is tried again."""

OPENING_S: Final = 3.0
"""Longest that a connection may take to open."""

SILENCE_S: Final = 5.0
"""A server that does not answer a ping for so long is gone."""

LARGEST: Final = 64 * 1024
"""Bytes of a message from the server."""


@dataclass(frozen=True, slots=True)
class RosbridgeSettings:
    """Address of the rosbridge server.

    Attributes:
        url: `ws://host:port` or `wss://host:port`. rosbridge asks for no password: whoever reaches it commands the
            vehicle, so it belongs on a network of its own.
    """

    url: str = "ws://127.0.0.1:9090"


class RosbridgeVehicle(ThreadedVehicle):
    """Publishes a stack's messages through a rosbridge server."""

    def __init__(
        self,
        stack: AutowareAi | Autoware,
        settings: RosbridgeSettings,
        *,
        clock: Callable[[], float] = time.time,
        retry_s: float = RETRY_S,
    ) -> None:
        """Start to look for the server; does not wait for it.

        Args:
            stack: The messages; Autoware.AI's are ROS 1's, Autoware's ROS 2's.
            settings: Where the server is.
            clock: Time of day in s, for the messages' stamps.
            retry_s: Pause before the server is tried again.

        Raises:
            MissingExtraError: `websockets` is not installed.
            VehicleError: The URL is none.
        """
        needs_websockets()  # said here; the thread that uses it could not raise it
        super().__init__(stack, "rosbridge", close_s=OPENING_S + 1.0)
        self._url, self._clock, self._retry_s = _checked_url(settings.url), clock, retry_s
        self._ros: Final = 1 if isinstance(stack, AutowareAi) else 2
        self._types = _types_of(stack)
        self._pending: dict[str, tuple[int, TopicMessage]] = {}
        self._newest: dict[str, tuple[int, TopicMessage]] = {}
        self._fault = f"The rosbridge server at {self._url} has not answered yet."
        self._refusal = ""
        self._mode = ""
        self._thread.start()

    def state(self) -> RosVehicleState:
        """See `VehicleInterface.state`. `receivers` counts the server; who listens behind it, it does not say."""
        with self._lock:
            fault, refusal, pending, mode = self._fault, self._refusal, bool(self._pending), self._mode
        link: Link = "closed" if self._closed else "connecting" if fault else "refused" if refusal else "up"
        words = {
            "closed": "Closed; the last wish stays in force in the vehicle.",
            "connecting": f"{fault} It is tried again every {self._retry_s:g} s.",
            "refused": f"The rosbridge server refuses: {refusal}",
        }.get(link, f"Connected to the rosbridge server at {self._url}; who listens behind it is not known.")
        return RosVehicleState(
            link=link,
            words=words,
            receivers=int(not fault),
            delivered=not fault and not refusal and not pending and self._setpoints.number > 0,
            speed_mps=self._speed_mps(),
            mode=mode,
            counts=self._notes.counted(),
            notes=self._notes.said(),
        )

    def _send(self, number: int, messages: tuple[TopicMessage, ...]) -> None:
        for message in messages:
            self._text(number, message)  # raises here, before anything is handed on
        self._leave([(each.topic, (number, each)) for each in messages], self._pending, self._newest)

    def _text(self, number: int, message: TopicMessage) -> str:
        now_s = self._clock()
        fields: Fields = dict(message.fields)
        if message.stamped == "header":
            stamp: Fields = {"secs": int(now_s), "nsecs": int(now_s % 1.0 * 1e9)}
            fields = {"header": {"seq": number, "stamp": stamp, "frame_id": ""}, **fields}
        elif message.stamped == "stamp":
            fields = {"stamp": {"sec": int(now_s), "nanosec": int(now_s % 1.0 * 1e9)}, **fields}
        try:
            return json.dumps({"op": "publish", "topic": message.topic, "msg": fields}, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise VehicleError(f"A {message.type} cannot be made of these values: {error}.") from error

    def _run(self) -> None:
        from websockets.exceptions import InvalidHandshake, InvalidMessage, WebSocketException

        while not self._ending.is_set():
            try:
                with bridged(self._url) as connection:
                    self._talk(connection)
            except (InvalidHandshake, InvalidMessage) as error:
                self._lost(f"What answers at {self._url} is no rosbridge server: {error}.")
            except TimeoutError:
                self._lost(f"The rosbridge server at {self._url} does not answer within {OPENING_S:g} s.")
            except ConnectionRefusedError:
                self._lost(f"No rosbridge server at {self._url}: the connection is refused.")
            except (OSError, WebSocketException, ValueError) as error:  # ValueError: a host that is no name
                self._lost(f"The rosbridge server at {self._url} was lost: {error}.")
            self._ending.wait(self._retry_s)

    def _talk(self, connection: ClientConnection) -> None:
        """Say what we publish and want to hear, then publish, until the connection ends or we do."""
        for topic, kind in self._types.published.items():
            advertise = {"op": "advertise", "topic": topic, "type": kind, "latch": True, "queue_size": 1}
            connection.send(json.dumps({"id": f"advertise:{topic}", **advertise}))
        for topic, kind in self._types.read.items():
            subscribe = {"op": "subscribe", "topic": topic, "type": kind, "throttle_rate": 100, "queue_length": 1}
            connection.send(json.dumps({"id": f"subscribe:{topic}", **subscribe}))
        with self._lock:
            self._fault = self._refusal = ""
            # What the server kept for us went with the last connection, and the vehicle may have been started anew.
            self._pending = {**self._newest}
        self._notes.count("connections")
        self._notes.say(f"Connected to the rosbridge server at {self._url}.")
        ended = threading.Event()
        listener = threading.Thread(target=self._listen, args=(connection, ended), name="rosbridge-in", daemon=True)
        listener.start()
        while True:
            last = self._ending.is_set()
            self._flush(connection)
            if last or ended.is_set():
                break
            self._woken.wait(0.5)
            self._woken.clear()
        if not last:
            reason = connection.protocol.close_exc
            self._lost(f"The rosbridge server at {self._url} ended the connection: {reason}.")

    def _flush(self, connection: ClientConnection) -> None:
        while True:
            with self._lock:
                if not self._pending:
                    return
                topic, (number, message) = next(iter(self._pending.items()))
            connection.send(self._text(number, message))
            self._notes.count("sent")
            with self._lock:
                if self._pending.get(topic) == (number, message):
                    del self._pending[topic]

    def _listen(self, connection: ClientConnection, ended: threading.Event) -> None:
        from websockets.exceptions import ConnectionClosed

        with contextlib.suppress(ConnectionClosed):  # why, `_talk` says
            for text in connection:
                self._understand(text)
        ended.set()
        self._woken.set()

    def _understand(self, text: str | bytes) -> None:
        try:
            said: Any = json.loads(text)
            op, topic, message = said.get("op"), said.get("topic"), said.get("msg")
        except (ValueError, AttributeError, RecursionError):
            self._notes.say("The rosbridge server said something that is no message.")
            return
        if op == "status" and said.get("level") in ("error", "warning"):
            words = str(message)[:300]
            self._notes.say(f"The rosbridge server: {words}")
            self._notes.count("complaints")
            if said.get("level") == "error":
                with self._lock:
                    self._refusal = words
        elif op == "publish" and topic in self._types.read:
            self._read(str(topic), message)

    def _read(self, topic: str, message: Any) -> None:
        try:
            if topic == autoware.MODE_TOPIC:
                number = int(message["mode"])
                mode = autoware.MODES.get(number, f"unknown ({number})")
                with self._lock:
                    self._mode = mode + (", in transition" if message["is_in_transition"] is True else "")
                return
            heard = message["twist"]["linear"]["x"] if self._ros == 1 else message["longitudinal_velocity"]
            speed_mps = float(heard)
        except (KeyError, TypeError, ValueError, OverflowError):
            self._notes.say(f"The rosbridge server sent a {topic} that cannot be read.")
            return
        self._hear(speed_mps)

    def _lost(self, words: str) -> None:
        with self._lock:
            self._fault = words
            self._mode = ""
        self._notes.say(words)
        self._notes.count("connection_failures")


@dataclass(frozen=True, slots=True)
class _Topics:
    published: dict[str, str]
    read: dict[str, str]


def _types_of(stack: AutowareAi | Autoware) -> _Topics:
    if isinstance(stack, AutowareAi):
        published = {
            autoware_ai.REPLANNER_TOPIC: autoware_ai.REPLANNER_TYPE,
            autoware_ai.FOLLOWER_TOPIC: autoware_ai.FOLLOWER_TYPE,
        }
        return _Topics(published, {autoware_ai.VELOCITY_TOPIC: autoware_ai.VELOCITY_TYPE})
    published = {
        autoware.CANDIDATE_TOPIC: f"{stack.package}/msg/VelocityLimit",
        autoware.CLEAR_TOPIC: f"{stack.package}/msg/VelocityLimitClearCommand",
    }
    return _Topics(
        published, {autoware.VELOCITY_TOPIC: autoware.VELOCITY_TYPE, autoware.MODE_TOPIC: autoware.MODE_TYPE}
    )


def needs_websockets() -> None:
    """Raise MissingExtraError where `websockets` is not installed."""
    if find_spec("websockets") is None:
        raise MissingExtraError("A rosbridge vehicle needs websockets.", extra="ros")


def bridged(url: str) -> ClientConnection:
    """Connect to a rosbridge server.

    Args:
        url: As `RosbridgeSettings.url`.

    Raises:
        VehicleError: The URL is none.
        OSError, WebSocketException: Nothing answers there, or no rosbridge server does.
    """
    from websockets.sync.client import connect

    return connect(
        _checked_url(url),
        open_timeout=OPENING_S,
        close_timeout=1.0,
        ping_interval=SILENCE_S / 2,
        ping_timeout=SILENCE_S,
        max_size=LARGEST,
        compression=None,
        proxy=None,
    )


def _checked_url(url: str) -> str:
    try:
        parts = urlsplit(url)
        good = parts.scheme in ("ws", "wss") and bool(parts.hostname) and (parts.port is None or parts.port > 0)
    except ValueError:
        good = False
    if not good:
        raise VehicleError(f"{url!r} is no rosbridge server.", hint="Use ws://HOST:PORT, e.g. ws://127.0.0.1:9090.")
    return url
