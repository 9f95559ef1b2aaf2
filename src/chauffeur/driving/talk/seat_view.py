"""The view from the seat for a screen, rendered in a thread of its own: a session never waits for a picture."""

from __future__ import annotations

import base64
import queue
import threading
from typing import Final

from chauffeur.concept import ChauffeurError, Observation
from chauffeur.driving.seat import SeatCamera
from chauffeur.driving.talk.messages import SeatView
from chauffeur.worlds.base import World

EVERY_S: Final = 1.0
"""Vehicle time between two pictures."""


class SeatWindow:
    """Takes instants to render, one at a time, and has the newest picture. For one thread beside its own."""

    def __init__(self) -> None:
        """Nothing is rendered before the first instant."""
        self._asked: queue.Queue[tuple[World, int, Observation] | None] = queue.Queue(maxsize=1)
        self._made: queue.SimpleQueue[SeatView] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None
        self._shown_s = float("-inf")
        self._failed = False

    def offer(self, world: World, seed: int, seen: Observation) -> None:
        """An instant that may be shown; left out where the last picture is young or still at work.

        Args:
            world: For its weather.
            seed: Of the place around the road.
            seen: The instant.
        """
        if self._failed or 0.0 <= seen.time_s - self._shown_s < EVERY_S or self._asked.full():
            return
        if self._thread is None:
            self._thread = threading.Thread(target=self._render, name="seat view", daemon=True)
            self._thread.start()
        self._shown_s = seen.time_s
        self._asked.put((world, seed, seen))

    def news(self) -> SeatView | None:
        """The newest picture that was not handed on yet; None where there is none."""
        newest: SeatView | None = None
        while not self._made.empty():
            newest = self._made.get()
        return newest

    def close(self) -> None:
        """End the thread after the picture at work."""
        if self._thread is not None:
            self._asked.put(None)
            self._thread.join()
            self._thread = None

    def _render(self) -> None:
        while (asked := self._asked.get()) is not None:
            world, seed, seen = asked
            try:
                taken = SeatCamera(world, seed).take(seen)
                shown = SeatView(round(seen.time_s, 2), base64.b64encode(taken[0].png()).decode("ascii"))
            except ChauffeurError as error:
                self._failed = True  # it would fail again, once a second
                shown = SeatView(round(seen.time_s, 2), "", str(error))
            self._made.put(shown)
