"""TCPROS publishing: one thread serves every subscriber of every topic; whoever publishes never waits for one.

Each subscriber has room for one message that waits: a newer one takes its place (newest wins), because of a wish only
the last one counts. The newest message is kept and given to every subscriber that comes later (a latched topic).
"""

from __future__ import annotations

import contextlib
import selectors
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from chauffeur.worlds.ros.notes import Notes
from chauffeur.worlds.ros.wire import LARGEST_HEADER, LENGTH, WireError, frame, header_bytes, header_fields

MOST_SUBSCRIBERS: Final = 64
"""Connections served at once; more are closed as they come."""

PATIENCE_S: Final = 5.0
"""A peer that takes this long for its header, or for a message, is dropped."""

_KEEP_ALIVE: Final = (("TCP_KEEPIDLE", 5), ("TCP_KEEPINTVL", 2), ("TCP_KEEPCNT", 3), ("TCP_USER_TIMEOUT", 5000))
"""A peer that vanished without a word (cable, crash) is noticed after some 10 s. Where the system has these."""


@dataclass(frozen=True, slots=True)
class Publication:
    """A topic that is published.

    Attributes:
        topic: Its name.
        type: Its type.
        md5: Checksum of the type.
        definition: Text of the type.
    """

    topic: str
    type: str
    md5: str
    definition: str


@dataclass(slots=True, eq=False)
class _Peer:
    """One subscriber's connection. `pending` and `topic` are guarded by the outlet's lock, the rest is the loop's."""

    sock: socket.socket
    address: str
    deadline_s: float
    heard: bytearray = field(default_factory=bytearray)
    going: memoryview = field(default_factory=lambda: memoryview(b""))
    pending: bytes | None = None
    topic: str = ""
    name: str = ""
    looks_on: bool = False
    greeting: bool = False
    last: bool = False


class Publisher:
    """The publishing side of a ROS 1 node."""

    def __init__(
        self,
        host: str,
        node: str,
        publications: tuple[Publication, ...],
        notes: Notes,
        explain: Callable[[str, str], str],
    ) -> None:
        """Listen on a free port of `host`.

        Args:
            host: Address to bind, and none but it.
            node: Name of our node.
            publications: What is published.
            notes: Where to say what happened.
            explain: Words for (md5 of the subscriber, its topic) that is not ours.

        Raises:
            OSError: The address is not one of this machine.
        """
        self._node, self._notes, self._explain = node, notes, explain
        self._publications = {one.topic: one for one in publications}
        self._listener = socket.create_server((host, 0), backlog=MOST_SUBSCRIBERS)
        self._listener.setblocking(False)
        self.port: Final[int] = self._listener.getsockname()[1]
        self._lock = threading.Lock()
        self._latest: dict[str, bytes] = {}
        self._peers: list[_Peer] = []
        self._mismatch: dict[str, str] = {}
        self._closing = False
        self._woken, self._waker = socket.socketpair()
        self._woken.setblocking(False)
        self._waker.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._woken, selectors.EVENT_READ)
        self._thread = threading.Thread(target=self._serve, name="ros1-outlet", daemon=True)
        self._thread.start()

    def publish(self, topic: str, data: bytes) -> None:
        """Hand a message to every subscriber of the topic, now and later. Never waits."""
        message = frame(data)
        with self._lock:
            self._latest[topic] = message
            for peer in self._peers:
                if peer.topic == topic:
                    self._notes.count("replaced", int(peer.pending is not None))
                    peer.pending = message
        self._wake()

    def receivers(self, topic: str) -> tuple[int, bool]:
        """How many subscribe to the topic, and whether all of them (one at least) were handed the newest message.

        Who takes any type (`rostopic echo`, a recorder) only looks on, and is not counted.
        """
        with self._lock:
            peers = [peer for peer in self._peers if peer.topic == topic and not peer.looks_on]
            return len(peers), bool(peers) and all(peer.pending is None and not peer.going for peer in peers)

    def mismatches(self) -> dict[str, str]:
        """Why a topic's subscribers could not be served, by topic; gone when one with the right type comes."""
        with self._lock:
            return dict(self._mismatch)

    @property
    def alive(self) -> bool:
        """Whether subscribers are still served."""
        return self._thread.is_alive()

    def connections(self) -> list[tuple[str, str]]:
        """(topic, name of the subscriber) of each connection."""
        with self._lock:
            return [(peer.topic, peer.name) for peer in self._peers if peer.topic]

    def close(self) -> None:
        """Stop serving; what a subscriber can take at once is still sent."""
        with self._lock:
            self._closing = True
        self._wake()
        self._thread.join(timeout=2.0)

    def _wake(self) -> None:
        with contextlib.suppress(OSError):  # full: the loop is about to wake anyway; closed: there is none
            self._waker.send(b"!")

    def _serve(self) -> None:
        while True:
            timeout_s = 0.5 if self._peers else None
            for key, events in self._selector.select(timeout_s):
                if key.fileobj is self._listener:
                    self._accept()
                elif key.fileobj is self._woken:
                    with contextlib.suppress(OSError):
                        self._woken.recv(4096)
                elif events & selectors.EVENT_READ:
                    self._hear(key.data)
            with self._lock:
                closing = self._closing
            for peer in list(self._peers):
                self._send(peer)
            if closing:
                break
            now_s = time.monotonic()
            for peer in list(self._peers):
                if now_s > peer.deadline_s:
                    what = "took no message" if peer.topic else "said nothing"
                    self._drop(peer, f"{peer.name or peer.address} {what} for {PATIENCE_S:g} s; connection closed.")
        for peer in list(self._peers):
            self._drop(peer, "")
        for sock in (self._listener, self._woken, self._waker):
            sock.close()
        self._selector.close()

    def _accept(self) -> None:
        try:
            sock, address = self._listener.accept()
        except OSError:
            time.sleep(
                0.01
            )  # gone before it was taken; or no descriptor is free, and it would be offered again at once
            return
        sock.setblocking(False)
        if len(self._peers) >= MOST_SUBSCRIBERS:
            sock.close()
            self._notes.count("turned_away")
            self._notes.say(f"{MOST_SUBSCRIBERS} subscribers are connected; {address[0]} was turned away.")
            return
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in _KEEP_ALIVE:
            if (option := getattr(socket, name, None)) is not None:
                sock.setsockopt(socket.IPPROTO_TCP, option, value)
        peer = _Peer(sock, str(address[0]), time.monotonic() + PATIENCE_S)
        with self._lock:
            self._peers.append(peer)
        self._selector.register(sock, selectors.EVENT_READ, peer)

    def _hear(self, peer: _Peer) -> None:
        try:
            data = peer.sock.recv(65536)
        except BlockingIOError:
            return
        except OSError as error:
            self._drop(peer, f"Lost {peer.name or peer.address}: {error.strerror or error}.")
            return
        if not data:
            self._drop(peer, f"{peer.name} closed its connection." if peer.name else "")
            return
        if peer.topic or peer.last:
            return  # a subscriber has nothing to say after its header
        peer.heard += data
        if len(peer.heard) < LENGTH.size:
            return
        (length,) = LENGTH.unpack_from(peer.heard)
        if length > LARGEST_HEADER:
            self._drop(peer, f"{peer.address} sent no ROS connection header.")
        elif len(peer.heard) >= LENGTH.size + length:
            self._greet(peer, bytes(peer.heard[LENGTH.size : LENGTH.size + length]))

    def _greet(self, peer: _Peer, header: bytes) -> None:
        """Answer a connection header: with ours and the newest message, or with an error in words."""
        try:
            fields = header_fields(header)
        except WireError as error:
            self._drop(peer, f"{peer.address} sent no ROS connection header: {error}.")
            return
        name, topic = fields.get("callerid", peer.address), fields.get("topic", "")
        publication, md5 = self._publications.get(topic), fields.get("md5sum", "")
        fault = ""
        if publication is None:
            fault = f"{name} asked for {topic or 'no topic'}, which is not published here."
        elif md5 not in ("*", publication.md5):
            fault = f"{name} expects another {publication.type}: {self._explain(md5, topic)}"
            with self._lock:
                self._mismatch[topic] = fault
        if publication is None or fault:
            self._notes.say(fault)
            self._notes.count("refused_subscribers")
            peer.going, peer.last = memoryview(header_bytes({"error": fault})), True
            return
        answer = {
            "callerid": self._node,
            "latching": "1",
            "md5sum": publication.md5,
            "message_definition": publication.definition,
            "topic": topic,
            "type": publication.type,
        }
        peer.going, peer.greeting = memoryview(header_bytes(answer)), True
        self._notes.count("subscribers")
        with self._lock:
            peer.name, peer.topic, peer.pending = name, topic, self._latest.get(topic)
            peer.looks_on = md5 == "*"
            if not peer.looks_on:
                self._mismatch.pop(topic, None)

    def _send(self, peer: _Peer) -> None:
        while True:
            if not peer.going:
                with self._lock:
                    peer.going, peer.pending = memoryview(peer.pending or b""), None
                if not peer.going:
                    break
                peer.deadline_s = time.monotonic() + PATIENCE_S
            try:
                sent = peer.sock.send(peer.going)
            except BlockingIOError:
                break
            except OSError as error:
                self._drop(peer, f"Lost {peer.name or peer.address}: {error.strerror or error}.")
                return
            peer.going = peer.going[sent:]
            peer.deadline_s = time.monotonic() + PATIENCE_S
            if not peer.going and peer.topic:
                self._notes.count("sent", 0 if peer.greeting else 1)
                peer.greeting = False
        if peer.last and not peer.going:
            self._drop(peer, "")
            return
        waiting = selectors.EVENT_WRITE if peer.going else 0
        self._selector.modify(peer.sock, selectors.EVENT_READ | waiting, peer)
        if peer.topic and not peer.going:
            peer.deadline_s = float("inf")  # a subscriber without a message on its way owes nothing

    def _drop(self, peer: _Peer, words: str) -> None:
        with self._lock:
            if peer not in self._peers:
                return
            self._peers.remove(peer)
            owed = peer.topic != "" and (peer.pending is not None or bool(peer.going))
        with contextlib.suppress(KeyError, ValueError):
            self._selector.unregister(peer.sock)
        peer.sock.close()
        self._notes.count("undelivered", int(owed))
        if words:
            self._notes.say(words)
