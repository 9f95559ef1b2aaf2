"""The last things worth telling, from any thread, without growing."""

from __future__ import annotations

import threading
from collections import Counter, deque
from typing import Final

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
