"""Between the page and the wheel: the network writes when it can, the drive reads when it must, neither waits."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Literal

from chauffeur.hmi.wheel.controls import Keys
from chauffeur.hmi.wheel.pace import Clock

Wish = Literal["", "pause", "go", "give_up"]


@dataclass(frozen=True, slots=True)
class PageInput:
    """What came from the page by now.

    Attributes:
        keys: Keys down now, or pressed for however short a time since the last look.
        number: The page's own number of its latest message.
        silent_s: How long nothing came.
        wish: The latest wish that was not one of driving; told once.
    """

    keys: Keys
    number: int
    silent_s: float
    wish: Wish


class Mailbox:
    """The latest of everything."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._keys = Keys.NONE
        self._tapped = Keys.NONE
        self._number = 0
        self._heard_s = clock.now_s()
        self._wish: Wish = ""

    def press(self, keys: Keys, number: int) -> None:
        """These keys are down now."""
        with self._lock:
            self._keys = keys
            self._tapped |= keys
            self._number = number
            self._heard_s = self._clock.now_s()

    def wish(self, wish: Wish) -> None:
        """The person wants something other than driving; giving up is final."""
        with self._lock:
            self._heard_s = self._clock.now_s()
            if self._wish != "give_up":
                self._wish = wish

    def look(self) -> PageInput:
        """What came by now; taps and wishes are told once."""
        with self._lock:
            heard = PageInput(self._keys | self._tapped, self._number, self._clock.now_s() - self._heard_s, self._wish)
            self._tapped = Keys.NONE
            if self._wish != "give_up":
                self._wish = ""
            return heard
