"""A vehicle interface without a vehicle: it says what would be published and publishes nothing."""

from __future__ import annotations

import threading
from collections import deque
from typing import Literal

from chauffeur.concept import Parameters
from chauffeur.worlds.ros.base import Published, RosVehicleState, TopicMessage
from chauffeur.worlds.ros.lines import command_line
from chauffeur.worlds.ros.stack import Stack, StackSetpoints

KEPT = 100
"""Lines remembered."""


class DryRun:
    """Checks like the real ones, keeps the equivalent command lines, opens no socket and starts no process."""

    def __init__(self, stack: Stack, ros: Literal[1, 2] = 1) -> None:
        """Make the messages of a stack, and tell them as lines of that generation's command-line tool."""
        self._ros: Literal[1, 2] = ros
        self._setpoints = StackSetpoints(stack, self._send)
        self._lock = threading.Lock()
        self._lines: deque[str] = deque(maxlen=KEPT)
        self._closed = False

    @property
    def lines(self) -> tuple[str, ...]:
        """Messages that would have been published, as command lines, oldest first."""
        with self._lock:
            return tuple(self._lines)

    def apply(self, parameters: Parameters) -> Published:
        return self._setpoints.apply(parameters)

    def release(self) -> Published:
        return self._setpoints.release()

    def state(self) -> RosVehicleState:
        link = "closed" if self._closed else "dry-run"
        count = ("published", self._setpoints.number)
        return RosVehicleState(link, "Dry run: nothing is published.", counts=(count,), notes=self.lines[-20:])

    def close(self) -> None:
        self._setpoints.end("This vehicle interface is closed.")
        self._closed = True

    def _send(self, number: int, messages: tuple[TopicMessage, ...]) -> None:
        del number
        with self._lock:
            self._lines.extend(command_line(message, self._ros) for message in messages)
