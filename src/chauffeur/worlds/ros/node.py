"""A ROS 1 node of our own: XML-RPC to the master, TCPROS to other nodes, no ROS install.

Threads: who publishes hands bytes over and never waits; the outlet serves subscribers; the slave answers the master;
the keeper registers, looks every second whether the registration stands, and registers again when the master is new.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from chauffeur.worlds.ros.base import Link, VehicleError
from chauffeur.worlds.ros.master import TIMEOUT_S, MasterError, MasterRefusedError, call, check_uri
from chauffeur.worlds.ros.node_server import NodeServer
from chauffeur.worlds.ros.notes import Notes
from chauffeur.worlds.ros.publisher import Publication, Publisher
from chauffeur.worlds.ros.subscriber import Subscriber
from chauffeur.worlds.ros.types import Types

CHECK_S: Final = 1.0
"""Period of looking after the registration."""

GOODBYE_S: Final = 3.0
"""Longest that `close` waits for the master to take our leave."""

_LOOK_AROUND: Final = 5
"""Checks from one look at the whole graph to the next, as long as everybody is connected."""


@dataclass(frozen=True, slots=True)
class Ros1Settings:
    """Where a ROS 1 vehicle is.

    Attributes:
        master: URI of the ROS master.
        host: Our own address: the only one listened on, and the one told to the vehicle's nodes.
        node: Name of our node; empty for one of its own for every start. A second node of the same name ends the first.
    """

    master: str = "http://127.0.0.1:11311"
    host: str = "127.0.0.1"
    node: str = ""


class RosNode:
    """Publishes some topics, reads at most one, and keeps itself registered."""

    def __init__(
        self,
        settings: Ros1Settings,
        types: Types,
        published: Mapping[str, str],
        read: tuple[str, str] | None = None,
        *,
        known_md5: Mapping[str, str] | None = None,
        expected: Mapping[str, str] | None = None,
        check_s: float = CHECK_S,
    ) -> None:
        """Start to look for the master; does not wait for it.

        Args:
            settings: Where.
            types: Knows every type named below.
            published: Type by topic.
            read: Topic and type to read.
            known_md5: What builds with other checksums are called.
            expected: Name of the node that should listen, by topic.
            check_s: Period of looking after the registration.

        Raises:
            VehicleError: The master's URI or our own address cannot be used.
        """
        self._master, self._host, self._check_s = check_uri(settings.master), settings.host, check_s
        self.name: Final = settings.node or f"/chauffeur_{os.getpid()}_{time.monotonic_ns() % 1_000_000}"
        self.notes: Final = Notes()
        self._known_md5, self._expected = known_md5 or {}, expected or {}
        self._publications = tuple(_publication(types, topic, kind) for topic, kind in published.items())
        self.inlet: Final = Subscriber(self.name, _publication(types, *read), types, self.notes) if read else None
        self._lock = threading.Lock()
        self._fault = f"The ROS master at {self._master} has not answered yet."
        self._ended = ""
        self._listeners: dict[str, list[str]] = {}
        self._ending = threading.Event()
        try:
            self._outlet = Publisher(self._host, self.name, self._publications, self.notes, self._explain)
            self._slave = NodeServer(
                self._host,
                self._master,
                request_topic=lambda topic: self._outlet.port if topic in published else None,
                publisher_update=self._publisher_update,
                shutdown=self._told_to_end,
                publications=lambda: [[one.topic, one.type] for one in self._publications],
                subscriptions=lambda: [list(read)] if read else [],
                connections=self._bus_info,
            )
        except OSError as error:
            raise VehicleError(
                f"Cannot listen on {self._host}: {error.strerror or error}.",
                hint="`host` is this machine's own address, as the vehicle's nodes reach it.",
            ) from error
        self._keeper = threading.Thread(target=self._keep, name="ros1-keeper", daemon=True)
        self._keeper.start()

    def publish(self, topic: str, data: bytes) -> None:
        """Hand a message to everybody who listens, now or later. Never waits."""
        self._outlet.publish(topic, data)

    @property
    def ended(self) -> str:
        """Why the graph ended this node; empty when it did not."""
        with self._lock:
            return self._ended

    def receivers(self) -> tuple[int, bool]:
        """How many listen to the topic with the fewest listeners, and whether every one was handed the newest."""
        served = [self._outlet.receivers(one.topic) for one in self._publications]
        return min(count for count, _ in served), all(done for _, done in served)

    def link(self) -> tuple[Link, str]:
        """How the way to the vehicle is, and the same in words."""
        with self._lock:
            fault, ended, listeners = self._fault, self._ended, dict(self._listeners)
        if ended:
            return "replaced", ended
        if not self._outlet.alive:
            return "replaced", "The thread that serves subscribers has ended; nothing is published. Open it again."
        if mismatches := self._outlet.mismatches():
            return "refused", " ".join(mismatches.values())
        deaf = [one.topic for one in self._publications if not self._outlet.receivers(one.topic)[0]]
        if not deaf:
            # Subscribers stay connected when a master dies; what is published still reaches them.
            return "up", f"Connected. {fault}".rstrip()
        if fault:
            return "connecting", f"{fault} It is tried again every {self._check_s:g} s."
        return "waiting", " ".join(self._deaf(topic, listeners.get(topic, [])) for topic in deaf)

    def close(self) -> None:
        """Take leave of the master, for at most `GOODBYE_S`, and end every connection."""
        self._ending.set()
        self._keeper.join(timeout=GOODBYE_S)
        if self.inlet is not None:
            self.inlet.close()
        self._outlet.close()
        self._slave.close()

    def _deaf(self, topic: str, listeners: list[str]) -> str:
        if listeners:
            who = ", ".join(listeners)
            return f"{who} listens to {topic} but does not connect to us; can it reach {self._host}?"
        expected = self._expected.get(topic, "")
        return f"Nobody listens to {topic}{f'; is {expected} running?' if expected else '.'}"

    def _explain(self, md5: str, topic: str) -> str:
        ours = next(one.md5 for one in self._publications if one.topic == topic)
        known = self._known_md5.get(md5, "no build known here")
        return f"its md5 is {md5[:40] or 'missing'} ({known}), ours {ours}. It was built with other definitions."

    def _bus_info(self) -> list[list[Any]]:
        connections = self._outlet.connections()
        return [[number, name, "o", "TCPROS", topic, 1] for number, (topic, name) in enumerate(connections)]

    def _publisher_update(self, topic: str, publishers: list[str]) -> None:
        if self.inlet is not None and topic == self.inlet.wanted.topic:
            self.inlet.publishers(publishers)

    def _told_to_end(self, reason: str) -> None:
        words = f"The ROS graph told {self.name} to end: {reason}. Nothing more is published."
        with self._lock:
            self._ended = words
        self.notes.say(words)
        self._ending.set()

    def _keep(self) -> None:
        registered, checks = False, 0
        while not self._ending.is_set():
            try:
                registered = registered and self._stands()
                if not registered:
                    self._register()
                    registered = True
                if checks % _LOOK_AROUND == 0 or not self.receivers()[0]:
                    self._look_around()
                with self._lock:
                    self._fault = ""
                checks += 1
            except MasterError as error:
                with self._lock:
                    self._fault = error.message
                self.notes.say(error.message)
                self.notes.count("master_failures")
            self._ending.wait(self._check_s)
        if registered and not self.ended:
            self._say_goodbye()

    def _call(self, method: str, *arguments: Any, timeout_s: float | None = None) -> Any:
        return call(self._master, "ROS master", method, self.name, *arguments, timeout_s=timeout_s or TIMEOUT_S)

    def _stands(self) -> bool:
        """Whether the master knows us; one that was started anew does not."""
        try:
            known: Any = self._call("lookupNode", self.name)
        except MasterRefusedError:
            known = None
        if known != self._slave.uri:
            self.notes.say("The ROS master does not know us any more; registering again.")
        return known == self._slave.uri

    def _register(self) -> None:
        for one in self._publications:
            self._call("registerPublisher", one.topic, one.type, self._slave.uri)
        if self.inlet is not None:
            publishers = self._call("registerSubscriber", *self._wanted(self.inlet), self._slave.uri)
            named = [str(one) for one in publishers] if isinstance(publishers, list) else []
            # A master started anew does not know its publishers yet; whom we read we go on reading.
            self.inlet.publishers([*self.inlet.following(), *named])
        self.notes.count("registrations")
        self.notes.say(f"Registered with the ROS master at {self._master} as {self.name}.")

    def _look_around(self) -> None:
        """Ask the master who listens, to be able to say who should be connected and is not."""
        graph = self._call("getSystemState")
        try:
            listeners = {str(topic): [str(node) for node in nodes] for topic, nodes in graph[1]}
        except (TypeError, ValueError, IndexError, KeyError) as error:
            raise MasterError(f"The ROS master at {self._master} describes no graph: {error}.") from error
        ours = {one.topic for one in self._publications}
        with self._lock:
            self._listeners = {topic: nodes for topic, nodes in listeners.items() if topic in ours}

    def _say_goodbye(self) -> None:
        brief_s = GOODBYE_S / 4
        try:
            for one in self._publications:
                self._call("unregisterPublisher", one.topic, self._slave.uri, timeout_s=brief_s)
            if self.inlet is not None:
                self._call("unregisterSubscriber", self.inlet.wanted.topic, self._slave.uri, timeout_s=brief_s)
        except MasterError as error:
            self.notes.say(error.message)

    @staticmethod
    def _wanted(inlet: Subscriber) -> tuple[str, str]:
        return inlet.wanted.topic, inlet.wanted.type


def _publication(types: Types, topic: str, kind: str) -> Publication:
    return Publication(topic, kind, types.md5(kind), types.definition(kind))
