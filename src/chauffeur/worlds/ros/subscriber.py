"""TCPROS reading: the newest message of one topic, from whoever publishes it, with its age."""

from __future__ import annotations

import socket
import threading
import time
from typing import Any, Final

from chauffeur.worlds.ros.base import VehicleError
from chauffeur.worlds.ros.master import call
from chauffeur.worlds.ros.notes import Notes
from chauffeur.worlds.ros.publisher import Publication
from chauffeur.worlds.ros.types import Types
from chauffeur.worlds.ros.wire import LARGEST_HEADER, LENGTH, WireError, header_bytes, header_fields

LARGEST_MESSAGE: Final = 64 * 1024
"""Bytes of a message; a velocity takes some 70."""

MOST_PUBLISHERS: Final = 4
"""Publishers of one topic that are read at once."""

MOST_THREADS: Final = 3 * MOST_PUBLISHERS
"""Publishers read or being given up; whoever names ever new ones cannot make us start ever more threads."""

RETRY_S: Final = 1.0
"""Pause before a lost publisher is tried again."""

SILENCE_S: Final = 5.0
"""A publisher that says nothing for so long is connected to anew."""


class Subscriber:
    """The reading side of a ROS 1 node, for one topic."""

    def __init__(self, node: str, wanted: Publication, types: Types, notes: Notes) -> None:
        """Read nothing yet: `publishers` says where.

        Args:
            node: Name of our node.
            wanted: Topic, type and checksum.
            types: Reads the bytes.
            notes: Where to say what happened.
        """
        self._node, self.wanted, self._types, self._notes = node, wanted, types, notes
        self._lock = threading.Lock()
        self._uris: tuple[str, ...] = ()
        self._reading: set[str] = set()
        self._newest: tuple[Any, float] | None = None
        self._ended = threading.Event()

    def publishers(self, uris: list[str]) -> None:
        """Who publishes now, as the master says. Never waits."""
        with self._lock:
            self._uris = tuple(dict.fromkeys(uris))[:MOST_PUBLISHERS]
            fresh = [uri for uri in self._uris if uri not in self._reading][: MOST_THREADS - len(self._reading)]
            self._reading.update(fresh)
        for uri in fresh:
            threading.Thread(target=self._follow, args=(uri,), name="ros1-inlet", daemon=True).start()

    def following(self) -> tuple[str, ...]:
        """Whom we read, or try to."""
        with self._lock:
            return self._uris

    def newest(self, within_s: float) -> Any | None:
        """The newest message, if it came within the last `within_s` seconds."""
        with self._lock:
            newest = self._newest
        if newest is None or time.monotonic() - newest[1] > within_s:
            return None
        return newest[0]

    def close(self) -> None:
        """Stop reading."""
        self._ended.set()

    def _wanted_still(self, uri: str) -> bool:
        with self._lock:
            wanted = uri in self._uris and not self._ended.is_set()
            if not wanted:
                self._reading.discard(uri)
            return wanted

    def _follow(self, uri: str) -> None:
        """Read one publisher for as long as the master names it."""
        while self._wanted_still(uri):
            try:
                self._read(uri)
            except VehicleError as error:
                self._notes.say(f"{self.wanted.topic}: {error.message}")
            except (OSError, ValueError) as error:  # a wrong frame, or a host that is no name
                self._notes.say(f"{self.wanted.topic} from {uri}: {error}.")
            self._ended.wait(RETRY_S)

    def _read(self, uri: str) -> None:
        reply = call(
            uri, f"publisher of {self.wanted.topic}", "requestTopic", self._node, self.wanted.topic, [["TCPROS"]]
        )
        offered = isinstance(reply, list) and len(reply) >= 3 and reply[0] == "TCPROS" and type(reply[2]) is int
        if not (offered and 0 < reply[2] < 65536):
            raise VehicleError(f"{uri} does not offer TCPROS.")
        with socket.create_connection((str(reply[1]), reply[2]), timeout=2.0) as sock:
            sock.settimeout(SILENCE_S)
            sock.sendall(
                header_bytes(
                    {
                        "callerid": self._node,
                        "md5sum": self.wanted.md5,
                        "message_definition": self.wanted.definition,
                        "tcp_nodelay": "1",
                        "topic": self.wanted.topic,
                        "type": self.wanted.type,
                    }
                )
            )
            header = header_fields(_one(sock, LARGEST_HEADER))
            if "error" in header:
                raise VehicleError(f"{uri} refuses to send: {header['error'][:200]}")
            if header.get("md5sum") not in ("*", self.wanted.md5):
                raise VehicleError(f"{uri} sends another {self.wanted.type} (md5 {header.get('md5sum', 'none')[:40]}).")
            while self._wanted_still(uri):
                message = self._types.decode(self.wanted.type, _one(sock, LARGEST_MESSAGE))
                with self._lock:
                    self._newest = (message, time.monotonic())
                self._notes.count("heard")


def _one(sock: socket.socket, most: int) -> bytes:
    (length,) = LENGTH.unpack(_exactly(sock, LENGTH.size))
    if length > most:
        raise WireError(f"a message of {length} bytes")
    return _exactly(sock, length)


def _exactly(sock: socket.socket, length: int) -> bytes:
    data = bytearray()
    while len(data) < length:
        got = sock.recv(length - len(data))
        if not got:
            raise WireError("the connection ended")
        data += got
    return bytes(data)
