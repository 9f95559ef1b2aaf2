"""What the page shows now, for whichever page looks: the latest of each kind of message, and word when it changes."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator

from chauffeur.hmi.wheel.scene import Json


class WheelScreen:
    """Kept by one event loop. A page that reads slowly misses instants in between, never the last of each kind."""

    def __init__(self) -> None:
        self._latest: dict[str, tuple[int, str]] = {}
        self._count = 0
        self._news = asyncio.Event()

    def show(self, message: Json) -> None:
        """Put a message in the place of the last one of its kind (`t`)."""
        self._count += 1
        self._latest[message["t"]] = (self._count, json.dumps(message, ensure_ascii=False, separators=(",", ":")))
        self._news.set()
        self._news = asyncio.Event()

    def forget(self, kind: str) -> None:
        """A message that no longer holds is not shown to a page that comes later."""
        self._latest.pop(kind, None)

    async def follow(self) -> AsyncGenerator[str]:
        """Every kind's latest message, oldest first, and then each change. Never ends by itself."""
        seen = 0
        while True:
            news = self._news
            fresh = sorted(entry for entry in self._latest.values() if entry[0] > seen)
            for number, text in fresh:
                yield text
                seen = number
            if not fresh:
                await news.wait()
