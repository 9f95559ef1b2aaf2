"""The vehicle interface for Autoware over ROS 2 (DDS).

One thread of its own joins the graph, writes and reads; who applies a wish leaves it there and never waits. A newer
wish takes the place of one not yet written. DDS itself finds late and returning readers and hands them the newest.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, Final

from chauffeur.concept import MissingExtraError
from chauffeur.concept.units import kmh
from chauffeur.worlds.ros import autoware
from chauffeur.worlds.ros.autoware import Autoware
from chauffeur.worlds.ros.base import Fields, Link, RosVehicleState, TopicMessage, VehicleError
from chauffeur.worlds.ros.dds import Participant, stamp_of
from chauffeur.worlds.ros.threaded import ThreadedVehicle

PERIOD_S: Final = 0.05
"""Interval of looking at the graph when there is nothing to write."""

RETRY_S: Final = 2.0
"""Pause after the graph could not be joined, or a message not be written."""


@dataclass(frozen=True, slots=True)
class Ros2Settings:
    """Address of a ROS 2 vehicle.

    Attributes:
        domain: `ROS_DOMAIN_ID`.
        host: Our own address; the network interface that has it is used, and no other.
        peers: Addresses to look for the vehicle's nodes at; none for multicast on that interface.
    """

    domain: int = 0
    host: str = "127.0.0.1"
    peers: tuple[str, ...] = ("127.0.0.1",)


class Ros2Vehicle(ThreadedVehicle):
    """Publishes our velocity limit, reads mode, velocity and the limit in force."""

    def __init__(self, stack: Autoware, settings: Ros2Settings, *, clock: Callable[[], float] = time.time) -> None:
        """Start to join the graph; does not wait for it.

        Args:
            stack: The messages.
            settings: Where to send them.
            clock: Time of day in s, for the messages' stamps.

        Raises:
            MissingExtraError: `cyclonedds` is not installed.
        """
        if find_spec("cyclonedds") is None:  # said here; the thread that uses it could not raise it
            raise MissingExtraError("A ROS 2 vehicle needs cyclonedds.", extra="ros")
        super().__init__(stack, "ros2-vehicle", close_s=3.0)
        self._stack, self._settings, self._clock = stack, settings, clock
        self._pending: dict[str, TopicMessage] = {}
        self._fault = "The ROS 2 graph has not been joined yet."
        self._receivers = 0
        self._misfits = ""
        self._mode = ""
        self._limit_mps: float | None = None
        self._thread.start()

    def state(self) -> RosVehicleState:
        with self._lock:
            fault, misfits, receivers, mode = self._fault, self._misfits, self._receivers, self._mode
            limit_mps, pending = self._limit_mps, bool(self._pending)
        link, words = self._link(fault, misfits, receivers)
        if limit_mps is not None and link == "up":
            words += f" The velocity limit in force is {kmh(limit_mps):.4g} km/h."
        return RosVehicleState(
            link=link,
            words=words,
            receivers=receivers,
            delivered=bool(receivers) and not pending and self._setpoints.number > 0,
            speed_mps=self._speed_mps(),
            mode=mode,
            counts=self._notes.counted(),
            notes=self._notes.said(),
        )

    def _link(self, fault: str, misfits: str, receivers: int) -> tuple[Link, str]:
        if self._closed:
            return "closed", "Closed; the last wish stays in force in the vehicle."
        if fault:
            return "connecting", f"{fault} It is tried again every {RETRY_S:g} s."
        if misfits:
            return "refused", misfits
        if receivers:
            return "up", "Connected."
        return "waiting", f"Nobody listens to {autoware.CANDIDATE_TOPIC}; is Autoware's planning running?"

    def _send(self, number: int, messages: tuple[TopicMessage, ...]) -> None:
        del number
        self._leave([(message.topic, message) for message in messages], self._pending)

    def _run(self) -> None:
        while not self._ending.is_set():
            try:
                graph = Participant(
                    self._settings.domain,
                    self._settings.host,
                    self._settings.peers,
                    autoware.definitions(self._stack.package),
                )
            except VehicleError as error:
                self._lost(error.message)
                continue
            try:
                self._take_part(graph)
            except graph.faults as error:
                self._lost(f"DDS failed: {error}.")
            finally:
                graph.close()

    def _lost(self, words: str) -> None:
        with self._lock:
            self._fault, self._receivers, self._mode, self._limit_mps = words, 0, "", None
        self._notes.say(words)
        self._notes.count("join_failures")
        self._ending.wait(RETRY_S)

    def _take_part(self, graph: Participant) -> None:
        package = self._stack.package
        limit_type = f"{package}/msg/VelocityLimit"
        writers = {
            autoware.CANDIDATE_TOPIC: graph.writer(autoware.CANDIDATE_TOPIC, limit_type),
            autoware.CLEAR_TOPIC: graph.writer(autoware.CLEAR_TOPIC, f"{package}/msg/VelocityLimitClearCommand"),
        }
        mode = graph.reader(autoware.MODE_TOPIC, autoware.MODE_TYPE, kept=True)
        limit = graph.reader(autoware.CURRENT_TOPIC, limit_type, kept=True)
        velocity = graph.reader(autoware.VELOCITY_TOPIC, autoware.VELOCITY_TYPE, kept=False)
        with self._lock:
            self._fault = ""
        self._notes.say(f"Joined ROS 2 domain {self._settings.domain} on {self._settings.host}.")
        while True:
            last = self._ending.is_set()
            self._write(graph, writers)
            if last:
                break
            self._look(writers)
            if (heard := graph.newest(mode)) is not None:
                with self._lock:
                    self._mode = autoware.MODES.get(int(heard.mode), f"unknown ({int(heard.mode)})")
                    self._mode += ", in transition" if heard.is_in_transition else ""
            if (heard := graph.newest(limit)) is not None and math.isfinite(heard.max_velocity):
                with self._lock:
                    self._limit_mps = float(heard.max_velocity)
            if (heard := graph.newest(velocity)) is not None:
                self._hear(float(heard.longitudinal_velocity))
            self._woken.wait(PERIOD_S)
            self._woken.clear()

    def _write(self, graph: Participant, writers: dict[str, Any]) -> None:
        with self._lock:
            messages = list(self._pending.values())
        for message in messages:
            fields: Fields = {"stamp": stamp_of(self._clock()), **message.fields}
            try:
                graph.write(writers[message.topic], message.type, fields)
            except VehicleError as error:
                self._notes.say(error.message)
                self._notes.count("write_failures")
                continue  # it stays, and is tried again
            self._notes.count("sent")
            with self._lock:
                if self._pending.get(message.topic) is message:
                    del self._pending[message.topic]

    def _look(self, writers: dict[str, Any]) -> None:
        """Count matched and QoS-incompatible subscribers."""
        receivers = min(len(writer.get_matched_subscriptions()) for writer in writers.values())
        misfits = sum(writer.get_offered_incompatible_qos_status().total_count for writer in writers.values())
        with self._lock:
            before, self._receivers = self._receivers, receivers
            self._misfits = (
                "Who listens asks for another quality of service than reliable and transient local."
                if misfits and not receivers
                else ""
            )
        if before and not receivers:
            self._notes.say("Nobody listens any more.")
        elif receivers and not before:
            self._notes.say(f"{receivers} listening.")
