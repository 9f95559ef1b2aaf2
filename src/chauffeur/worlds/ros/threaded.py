"""Base of vehicle interfaces with a thread of their own. Callers hand over a wish and never wait."""

from __future__ import annotations

import math
import threading
import time
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Iterable
from typing import Final, TypeVar

from chauffeur.concept import Parameters
from chauffeur.worlds.ros.base import FRESH_S, Published, TopicMessage
from chauffeur.worlds.ros.stack import Stack, StackSetpoints

KEPT: Final = 20
"""Notes kept; a note said again right away is kept once."""


class Notes:
    """Notes and counters of one interface."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._notes: deque[str] = deque(maxlen=KEPT)
        self._counts: Counter[str] = Counter()

    def say(self, words: str) -> None:
        """Keep a note."""
        shown = "".join(c if c.isprintable() else "?" for c in words)[:500]  # parts of it came over the network
        with self._lock:
            if not self._notes or self._notes[-1] != shown:
                self._notes.append(shown)

    def count(self, name: str, by: int = 1) -> None:
        """Count something."""
        if by:
            with self._lock:
                self._counts[name] += by

    def said(self) -> tuple[str, ...]:
        """The notes, oldest first."""
        with self._lock:
            return tuple(self._notes)

    def counted(self) -> tuple[tuple[str, int], ...]:
        """The counters by name."""
        with self._lock:
            return tuple(sorted(self._counts.items()))


_T = TypeVar("_T")


class ThreadedVehicle(ABC):
    """A vehicle interface whose thread reaches the vehicle, writes and reads, until it is closed."""

    def __init__(self, stack: Stack, name: str, *, close_s: float) -> None:
        """Make everything ready; the thread is started by whoever derives from this, with all else in place.

        Args:
            stack: The messages.
            name: Name of the thread.
            close_s: How long `close` waits for it at most.
        """
        self._close_s = close_s
        self._notes = Notes()
        self._lock = threading.Lock()
        self._velocity: tuple[float, float] | None = None
        self._woken, self._ending = threading.Event(), threading.Event()
        self._closed = False
        self._setpoints = StackSetpoints(stack, self._send)
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def apply(self, parameters: Parameters) -> Published:
        return self._setpoints.apply(parameters)

    def release(self) -> Published:
        return self._setpoints.release()

    def close(self) -> None:
        self._setpoints.end("This vehicle interface is closed.")
        self._closed = True
        self._ending.set()
        self._woken.set()
        self._thread.join(timeout=self._close_s)

    @abstractmethod
    def _send(self, number: int, messages: tuple[TopicMessage, ...]) -> None:
        """Leave numbered messages for the thread, all or (raising) none."""

    @abstractmethod
    def _run(self) -> None:
        """Body of the thread until `_ending` is set; `_woken` signals work."""

    def _leave(self, left: Iterable[tuple[str, _T]], *places: dict[str, _T]) -> None:
        """Leave the newest of each topic for the thread, in place of what waits there; what comes last goes last."""
        with self._lock:
            for topic, what in left:
                self._notes.count("replaced", int(topic in places[0]))
                for place in places:
                    place.pop(topic, None)
                    place[topic] = what
        self._notes.count("published")
        self._woken.set()

    def _hear(self, speed_mps: float) -> None:
        """Take note of the vehicle's speed as it was just heard; what is no number is not."""
        if math.isfinite(speed_mps):
            with self._lock:
                self._velocity = (speed_mps, time.monotonic())
            self._notes.count("heard")

    def _speed_mps(self) -> float | None:
        """The vehicle's present speed, if it was heard of late."""
        with self._lock:
            velocity = self._velocity
        return velocity[0] if velocity is not None and time.monotonic() - velocity[1] <= FRESH_S else None
