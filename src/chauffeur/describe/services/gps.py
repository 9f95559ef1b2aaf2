"""Where the car is: as a person wrote it down, or as `gpsd` measures it.

`gpsd` is the daemon that most receivers are read with. It is asked once (`?WATCH`), and then writes a line of JSON for
each fix (`TPV`: `lat`, `lon`, `track` in degrees from true north, `eph` in metres; https://gpsd.io/gpsd_json.html).
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import time
from collections.abc import Callable
from typing import Any, Final, Protocol

from chauffeur.describe.services.outside import number
from chauffeur.describe.services.readings import Position, Unknown

FRESH_S: Final = 3.0
"""A fix older than this is not where the car is: at 30 m/s it has gone 90 m."""

RETRY_S: Final = 2.0
"""Pause before a lost receiver is asked again."""

SILENCE_S: Final = 10.0
"""A receiver that says nothing for so long is connected to anew; `gpsd` speaks every second."""

MOVING_MPS: Final = 1.0
"""Below this speed a receiver's heading is noise."""

_LONGEST_LINE: Final = 65_536
_WATCH: Final = b'?WATCH={"enable":true,"json":true};\n'
_USUAL_ACCURACY_M: Final = 10.0
"""Where the receiver does not tell its own."""


class Whereabouts(Protocol):
    """Says where the car is. Never waits."""

    def position(self) -> Position | Unknown:
        """The place now, or why it is not known."""
        ...

    def words(self) -> str:
        """Who says so, a whole sentence for C. The place itself is not in it: C may go to a model elsewhere."""
        ...

    async def close(self) -> None:
        """Stop looking."""
        ...


class WrittenFix:
    """A place that a person wrote down."""

    def __init__(self, at: Position, where: str) -> None:
        """Be there.

        Args:
            at: The place.
            where: Name of the file it stands in.
        """
        self._at, self._where = at, where

    def position(self) -> Position | Unknown:
        return self._at

    def words(self) -> str:
        return f"Place: as it stands in {self._where}; it is not measured, and does not move."

    async def close(self) -> None:
        """See `Whereabouts.close`."""


class Gpsd:
    """Reads `gpsd`, connects again when it was lost, and knows how old the last fix is."""

    def __init__(self, host: str, port: int, *, clock: Callable[[], float] = time.monotonic) -> None:
        """Start to read; needs a running event loop.

        Args:
            host: Where `gpsd` is.
            port: Its port, 2947 by default.
            clock: Seconds.
        """
        self._host, self._port, self._clock = host, port, clock
        self._last: tuple[Position, float] | None = None
        self._fault = f"gpsd at {host}:{port} has not answered yet"
        self._task = asyncio.get_running_loop().create_task(self._keep())

    def position(self) -> Position | Unknown:
        if self._last is None:
            return Unknown(self._fault or "the receiver has no fix")
        place, at_s = self._last
        age_s = self._clock() - at_s
        if age_s > FRESH_S:
            return Unknown(f"the last fix is {age_s:.0f} s old: {self._fault or 'the receiver has none now'}")
        return place

    def words(self) -> str:
        place = self.position()
        if isinstance(place, Unknown) or self._last is None:
            return ""
        age_s = self._clock() - self._last[1]
        return f"Place: measured {age_s:.1f} s ago, within about {place.accuracy_m:.0f} m. (Source: gpsd.)"

    async def close(self) -> None:
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)

    async def _keep(self) -> None:
        where = f"gpsd at {self._host}:{self._port}"
        while True:
            try:
                await self._read()
                self._fault = f"{where} ended the connection"
            except TimeoutError:
                self._fault = f"{where} says nothing"
            except (OSError, ValueError, RecursionError) as error:  # a line without an end, or what is no JSON
                self._fault = f"{where} cannot be read ({type(error).__name__})"
            await asyncio.sleep(RETRY_S)

    async def _read(self) -> None:
        async with asyncio.timeout(SILENCE_S):
            reader, writer = await asyncio.open_connection(self._host, self._port, limit=_LONGEST_LINE)
        try:
            writer.write(_WATCH)
            while True:
                async with asyncio.timeout(SILENCE_S):
                    line = await reader.readline()
                if not line:
                    return
                self._hear(json.loads(line))
        finally:
            writer.close()
            with contextlib.suppress(OSError):
                await writer.wait_closed()

    def _hear(self, report: Any) -> None:
        if not isinstance(report, dict) or report.get("class") != "TPV":  # pyright: ignore[reportUnknownMemberType]
            return
        place = read_fix(report)  # pyright: ignore[reportUnknownArgumentType]
        if place is not None:
            self._last, self._fault = (place, self._clock()), ""


def read_fix(report: dict[str, Any]) -> Position | None:
    """The place of a `TPV` report; None where it has no fix, or one that cannot be."""
    latitude, longitude = number(report, "lat", -90.0, 90.0), number(report, "lon", -180.0, 180.0)
    if report.get("mode") not in (2, 3) or latitude is None or longitude is None:
        return None
    speed, track = number(report, "speed", MOVING_MPS, math.inf), number(report, "track", -math.inf, math.inf)
    error = number(report, "eph", -math.inf, math.inf)
    accuracy = _USUAL_ACCURACY_M if error is None else min(max(error, 1.0), 999.0)
    return Position(latitude, longitude, None if speed is None else track, accuracy)
