"""How traffic flows, from a server that speaks TomTom's flow segment data (version 4, JSON).

The service answers for the nearest road it knows, which may be another one than the car is on: an answer counts only
where its line passes near the car and points as the car does.
Source: developer.tomtom.com, Traffic API, Flow Segment Data.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Final

import numpy as np

from chauffeur.concept import DataError
from chauffeur.concept.units import MPS_PER_KMH
from chauffeur.describe.services.http_source import Service, Told
from chauffeur.describe.services.outside import decoded, items, number, part
from chauffeur.describe.services.readings import Position
from chauffeur.describe.services.ways import nearest, plane_m

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
    x, y = plane_m(np.array(line, dtype=np.float64).reshape(-1, 2), here)
    away, _ = nearest(x[:-1], y[:-1], x[1:], y[1:])
    away[np.hypot(np.diff(x), np.diff(y)) == 0.0] = np.inf
    if not np.isfinite(away).any():
        return None
    best = int(np.argmin(away))
    return float(away[best]), math.degrees(math.atan2(x[best + 1] - x[best], y[best + 1] - y[best]))


def _query(here: Position) -> dict[str, str]:
    latitude, longitude = here.rounded(_DECIMALS)
    return {"point": f"{latitude:.{_DECIMALS}f},{longitude:.{_DECIMALS}f}", "unit": "KMPH"}


def _cell(here: Position) -> Hashable:
    """Cells of about 100 m, and which way the car drives."""
    return (*here.rounded(3), None if here.heading_deg is None else round(here.heading_deg / 90.0) % 4)


def _same_segment(value: TrafficReport, asked: Position, here: Position) -> bool:
    del asked
    return value.about(here)


TOMTOM: Final = Service(
    name="TomTom",
    path=f"/traffic/services/4/flowSegmentData/absolute/{_ZOOM}/json",
    query=_query,
    read=lambda body, _: read_traffic(body),
    cell=_cell,
    near=_same_segment,
    serves=_same_segment,
    max_bytes=256_000,
    fresh_s=60.0,
    usable_s=300.0,
    oldest_s=300.0,
    keeps=64,
    missing="the road that the service answered for is another one",
    key=("key", "TOMTOM_API_KEY"),
)
"""A server that speaks TomTom's flow segment data."""
