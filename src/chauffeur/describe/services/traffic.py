"""How traffic flows, from a server that speaks TomTom's flow segment data (version 4, JSON).

The service answers for the nearest road it knows, which may be another one than the car is on: an answer counts only
where its line passes near the car and points as the car does.
Source: developer.tomtom.com, Traffic API, Flow Segment Data.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from chauffeur.concept import DataError
from chauffeur.concept.units import MPS_PER_KMH
from chauffeur.describe.services.http_request import ServiceCaller
from chauffeur.describe.services.outside import decoded, items, number, part
from chauffeur.describe.services.readings import M_PER_DEG, Position
from chauffeur.describe.services.remote import Told

MAX_BYTES: Final = 256_000
LEAST_CONFIDENCE: Final = 0.5
"""Answers of which the service itself is less sure are not told."""
NEAR_M: Final = 35.0
"""A segment farther away than this is another road."""
NEAR_BLIND_M: Final = 15.0
"""The same where the heading is not known, and a crossing road cannot be told from this one."""

_MAX_TURN_DEG: Final = 50.0
_MAX_POINTS: Final = 2_000
_DECIMALS: Final = 4
_ZOOM: Final = 12
"""Decides which roads the service looks among; larger numbers know smaller roads."""


@dataclass(frozen=True, slots=True)
class TrafficReport:
    """How traffic flows on the road.

    Attributes:
        speed_mps: Speed it flows at.
        free_mps: Speed it flows at when the road is free.
        closed: Whether the road is closed.
        confidence: How sure the service is, 0 to 1.
        line: (latitude, longitude) of the segment's points.
    """

    speed_mps: float
    free_mps: float
    closed: bool
    confidence: float
    line: tuple[tuple[float, float], ...]

    def about(self, here: Position) -> bool:
        """Whether the segment passes near a position, and points as the car does."""
        found = _nearest(self.line, here)
        if found is None:
            return False
        away_m, bearing_deg = found
        if here.heading_deg is None:
            return away_m <= NEAR_BLIND_M
        # The order of the points is not said to be the direction of traffic.
        turn = abs(math.remainder(here.heading_deg - bearing_deg, 180.0))
        return away_m <= NEAR_M and turn <= _MAX_TURN_DEG


def read_traffic(body: bytes) -> Told[TrafficReport]:
    """The traffic in an answer.

    Raises:
        DataError: It is not an answer of that service, or lacks a number.
    """
    segment = part(decoded(body), "flowSegmentData")
    speed, free = number(segment, "currentSpeed", 0.0, 300.0), number(segment, "freeFlowSpeed", 0.1, 300.0)
    confidence = number(segment, "confidence", 0.0, 1.0)
    if speed is None or free is None or confidence is None:
        raise DataError("the answer is not one about traffic")
    line = tuple(
        (lat, lon)
        for point in items(part(segment, "coordinates"), "coordinate")[:_MAX_POINTS]
        if (lat := number(point, "latitude", -90.0, 90.0)) is not None
        and (lon := number(point, "longitude", -180.0, 180.0)) is not None
    )
    closed = segment.get("roadClosure") is True
    return Told(TrafficReport(speed * MPS_PER_KMH, free * MPS_PER_KMH, closed, confidence, line))


def _nearest(line: tuple[tuple[float, float], ...], here: Position) -> tuple[float, float] | None:
    """(Distance from a line in m, compass bearing of its nearest segment); None for less than two points."""
    across = M_PER_DEG * math.cos(math.radians(here.latitude_deg))
    plane = [
        (math.remainder(lon - here.longitude_deg, 360.0) * across, (lat - here.latitude_deg) * M_PER_DEG)
        for lat, lon in line
    ]
    best: tuple[float, float] | None = None
    for (x0, y0), (x1, y1) in pairwise(plane):
        dx, dy = x1 - x0, y1 - y0
        square = dx * dx + dy * dy
        place = min(1.0, max(0.0, -(x0 * dx + y0 * dy) / square)) if square > 0.0 else 0.0
        away = math.hypot(x0 + place * dx, y0 + place * dy)
        if square > 0.0 and (best is None or away < best[0]):
            best = (away, math.degrees(math.atan2(dx, dy)))
    return best


class TomTom:
    """A server that speaks TomTom's flow segment data.

    Args:
        caller: Where it is, with the key.
    """

    name = "TomTom"
    fresh_s = 60.0
    usable_s = 300.0
    oldest_s = 300.0
    keeps = 64
    missing = "the road that the service answered for is another one"

    def __init__(self, caller: ServiceCaller) -> None:
        self._caller = caller

    def cell(self, here: Position) -> Hashable:
        """Cells of about 100 m, and which way the car drives."""
        way = None if here.heading_deg is None else round(here.heading_deg / 90.0) % 4
        return (*here.rounded(3), way)

    def near(self, value: TrafficReport, asked: Position, here: Position) -> bool:
        """On the same segment."""
        del asked
        return value.about(here)

    def serves(self, value: TrafficReport, asked: Position, here: Position) -> bool:
        """On the same segment."""
        del asked
        return value.about(here)

    async def ask(self, here: Position) -> Told[TrafficReport]:
        """Ask how traffic flows at a position."""
        latitude, longitude = here.rounded(_DECIMALS)
        path = f"/traffic/services/4/flowSegmentData/absolute/{_ZOOM}/json"
        query = {"point": f"{latitude:.{_DECIMALS}f},{longitude:.{_DECIMALS}f}", "unit": "KMPH"}
        return read_traffic(await self._caller.get(path, query))
