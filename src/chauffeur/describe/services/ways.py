"""Roads as OpenStreetMap keeps them: a way is a line of points with tags."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final, Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from chauffeur.describe.services.readings import M_PER_DEG, Position
from chauffeur.describe.services.rules import RoadClass

Floats = NDArray[np.float64]

DRIVEABLE: Final = frozenset(get_args(RoadClass))
"""Values of `highway` that a car can drive on."""

_TEXT_CHARS: Final = 255
_KEPT: Final = frozenset({
    "maxspeed", "maxspeed:forward", "maxspeed:backward", "maxspeed:conditional", "maxspeed:forward:conditional",
    "maxspeed:backward:conditional", "maxspeed:type", "maxspeed:variable", "source:maxspeed", "zone:maxspeed",
    "zone:traffic",
})  # fmt: skip
_LANE_WIDTH_M: Final = 3.5
_MAX_LANES: Final = 16
_LANES: Final[Mapping[str, int]] = {"motorway": 2, "service": 1, "track": 1, "living_street": 1}
"""Lanes of a road whose number is not on the map, only to tell how wide it may be."""


@dataclass(frozen=True, slots=True)
class ServiceWay:
    """One way of the map that a car can drive on.

    Attributes:
        id: OSM's number of it.
        road_class: Its `highway` value.
        name: Name or number, as written by whoever drew it.
        lanes: Lanes in all; None where the map does not say.
        oneway: 1 along the points only, -1 against them only, 0 both ways.
        limits: Its tags about speed limits.
        points: (latitude, longitude) in degrees, at least two.
    """

    id: int
    road_class: RoadClass
    name: str
    lanes: int | None
    oneway: Literal[-1, 0, 1]
    limits: Mapping[str, str]
    points: tuple[tuple[float, float], ...]

    @property
    def half_width_m(self) -> float:
        """How far from its line a car may be and still be on it, about."""
        return _LANE_WIDTH_M * (self.lanes or _LANES.get(self.road_class, 2)) / 2.0


def way_of(number: int, tags: Mapping[str, str], points: Iterable[tuple[float, float]]) -> ServiceWay | None:
    """A way from its tags and points; None where no car may drive, or where fewer than two points differ."""
    road_class = tags.get("highway", "")
    if road_class not in DRIVEABLE or tags.get("area") == "yes":
        return None
    line = [
        (lat, lon)
        for lat, lon in points
        if math.isfinite(lat) and math.isfinite(lon) and abs(lat) <= 90.0 and abs(lon) <= 180.0
    ]
    # A point that is drawn twice in a row is one point: as two, it would look like a junction.
    line = [point for point, before in zip(line, [None, *line], strict=False) if point != before]
    if len(line) < 2:
        return None
    return ServiceWay(
        id=number,
        road_class=cast("RoadClass", road_class),
        name=(tags.get("name") or tags.get("ref") or "")[:_TEXT_CHARS],
        lanes=_lanes(tags.get("lanes", "")),
        oneway=_oneway(tags, road_class),
        limits={key: value[: _TEXT_CHARS + 1] for key, value in tags.items() if key in _KEPT},
        points=tuple(line),
    )


def _lanes(text: str) -> int | None:
    head = text.split(";", maxsplit=1)[0].strip()
    lanes = int(head) if head.isascii() and head.isdigit() and len(head) < 4 else 0
    return lanes if 1 <= lanes <= _MAX_LANES else None


def _oneway(tags: Mapping[str, str], road_class: str) -> Literal[-1, 0, 1]:
    said = tags.get("oneway", "")
    if said in ("yes", "1", "true"):
        return 1
    if said in ("-1", "reverse"):
        return -1
    # What the wiki calls implied: motorways and roundabouts go one way unless the map says otherwise.
    implied = road_class == "motorway" or tags.get("junction") in ("roundabout", "circular")
    return 1 if implied and said not in ("no", "0", "false") else 0


def plane_m(points: Floats, here: Position) -> tuple[Floats, Floats]:
    """(east, north) of points (latitude, longitude; shape (n, 2)) in a plane that touches the earth at a position."""
    east = np.remainder(points[:, 1] - here.longitude_deg + 180.0, 360.0) - 180.0
    across = M_PER_DEG * math.cos(math.radians(here.latitude_deg))
    return east * across, (points[:, 0] - here.latitude_deg) * M_PER_DEG


def nearest(x0: Floats, y0: Floats, x1: Floats, y1: Floats) -> tuple[Floats, Floats]:
    """(Distances of segments from the origin, places of their nearest points on them, 0 to 1); shapes (n,)."""
    dx, dy = x1 - x0, y1 - y0
    place = np.clip(-(x0 * dx + y0 * dy) / np.maximum(dx * dx + dy * dy, 1e-9), 0.0, 1.0)
    return np.hypot(x0 + place * dx, y0 + place * dy), place
