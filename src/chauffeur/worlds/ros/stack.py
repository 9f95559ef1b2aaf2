"""Shared by all vehicle interfaces: a driving stack's own messages for a wish, numbered and remembered."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Protocol

from chauffeur.concept import Parameters
from chauffeur.worlds.ros.base import Asked, Published, TopicMessage, VehicleError
from chauffeur.worlds.ros.limits import CheckedWish, VehicleLimits, checked


class Stack(Protocol):
    """A driving stack (Autoware.AI, Autoware): which messages ask it for what."""

    @property
    def limits(self) -> VehicleLimits:
        """Limits on what is published to the vehicle."""
        ...

    def wished(self, wish: CheckedWish) -> Asked:
        """Messages for a wish. Raises VehicleRefusalError where there are none."""
        ...

    def released(self, last: CheckedWish | None) -> Asked:
        """Messages that take the last wish back."""
        ...

    def closing(self, last: CheckedWish | None) -> Asked:
        """Messages to end with; most often none."""
        ...


class StackSetpoints:
    """The wishes of one interface, one after the other. Safe from any thread."""

    def __init__(self, stack: Stack, send: Callable[[int, tuple[TopicMessage, ...]], None]) -> None:
        """Wish nothing yet.

        Args:
            stack: The messages.
            send: Hands numbered messages on, all or (raising) none, without waiting.
        """
        self._stack, self._send = stack, send
        self._lock = threading.Lock()
        self._number = 0
        self._last: CheckedWish | None = None
        self._over = ""

    @property
    def number(self) -> int:
        """Number of publications."""
        with self._lock:
            return self._number

    def apply(self, parameters: Parameters) -> Published:
        wish = checked(parameters, self._stack.limits)
        asked = self._stack.wished(wish)
        with self._lock:
            published = self._publish(asked)
            self._last = wish
        return published

    def release(self) -> Published:
        with self._lock:
            return self._publish(self._stack.released(self._last))

    def end(self, why: str) -> None:
        """Publish the stack's last messages, and nothing after them."""
        with self._lock:
            if self._over:
                return
            asked = self._stack.closing(self._last)
            try:
                if asked[0]:
                    self._publish(asked)
            finally:
                self._over = why

    def _publish(self, asked: Asked) -> Published:
        """Under the lock: of two callers at once, the later number is also what is sent last."""
        if self._over:
            raise VehicleError(self._over, hint="Open a new vehicle interface.")
        messages, words = asked
        self._send(self._number + 1, messages)
        self._number += 1
        return Published(self._number, messages, words)
