"""The car's spoken replies, one after the other; the drive does not wait for them."""

from __future__ import annotations

import queue
import threading
from typing import Final

from chauffeur.concept import MissingExtraError
from chauffeur.speech.say import can_speak, say

MOST_WAITING: Final = 3
"""Replies that may wait; what is older is not worth hearing any more."""


class Voice:
    """Speaks beside the drive.

    Attributes:
        speaking: Whether something is said just now, or waits to be: the car must not listen to itself.
    """

    def __init__(self) -> None:
        """Raises MissingExtraError: espeak-ng is not installed."""
        if not can_speak():
            raise MissingExtraError("Spoken replies need espeak-ng.", hint="Run: apt install espeak-ng")
        self._texts: queue.Queue[str] = queue.Queue(MOST_WAITING)
        self.speaking = False
        threading.Thread(target=self._run, name="voice", daemon=True).start()

    def say(self, text: str) -> None:
        """Say something when what was said before is over; dropped where too much waits."""
        self.speaking = True
        if not self._texts.full():
            self._texts.put(text)

    def _run(self) -> None:
        while True:
            text = self._texts.get()
            say(text)
            self.speaking = not self._texts.empty()
