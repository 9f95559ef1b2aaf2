"""Roads around a place, from a server that speaks Overpass. Source: wiki.openstreetmap.org/wiki/Overpass_API.

A circle is asked for and kept as a small map, so that a drive of several hundred metres costs one request.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, cast

from chauffeur.concept import DataError
from chauffeur.describe.services.http_source import Service, Told
from chauffeur.describe.services.outside import decoded, items, number, part, unix_time
from chauffeur.describe.services.readings import Position
from chauffeur.describe.services.road_map import RoadMap
from chauffeur.describe.services.ways import DRIVEABLE, ServiceWay, way_of

RADIUS_M: Final = 500.0
"""Radius of the circle that is asked for."""
_INNER_M: Final = 150.0
"""So near to its edge, a new circle is asked for."""
_DECIMALS: Final = 3
_MAX_WAYS: Final = 5_000
_MAX_POINTS: Final = 2_000
"""OSM allows no more in a way."""


def read_ways(body: bytes, centre: Position) -> Told[RoadMap]:
    """The roads in an answer.

    Args:
        body: The answer.
        centre: Centre of the circle that was asked for.

    Raises:
        DataError: It is not an answer of Overpass, or not a whole one.
    """
    answer = decoded(body)
    if not isinstance(answer, Mapping) or not isinstance(cast("Mapping[str, Any]", answer).get("elements"), list):
        raise DataError("the answer is not one of a map service")
    if "remark" in answer:  # a query that ran out of time or memory answers with status 200 and half of the roads
        raise DataError("the map service did not finish the answer")
    ways = tuple(way for one in items(answer, "elements")[:_MAX_WAYS] if (way := _way(one)) is not None)
    as_of_s = unix_time(part(answer, "osm3s").get("timestamp_osm_base"))
    return Told(RoadMap(ways, source="OpenStreetMap", as_of_s=as_of_s, extent=(centre, RADIUS_M)), as_of_s)


def _way(one: object) -> ServiceWay | None:
    tags = {key: value for key, value in part(one, "tags").items() if isinstance(value, str)}
    points = [
        (lat, lon)
        for point in items(one, "geometry")[:_MAX_POINTS]
        if (lat := number(point, "lat", -90.0, 90.0)) is not None
        and (lon := number(point, "lon", -180.0, 180.0)) is not None
    ]
    return way_of(int(number(one, "id", 0.0, 1e15) or 0), tags, points)


def _query(here: Position) -> dict[str, str]:
    latitude, longitude = here.rounded(_DECIMALS)
    around = f"around:{RADIUS_M:.0f},{latitude:.{_DECIMALS}f},{longitude:.{_DECIMALS}f}"
    classes = "|".join(sorted(DRIVEABLE))
    return {"data": f'[out:json][timeout:5];way({around})[highway~"^({classes})$"];out tags geom;'}


OVERPASS: Final = Service(
    name="OpenStreetMap (Overpass)",
    path="/api/interpreter",
    query=_query,
    read=lambda body, asked: read_ways(body, Position(*asked.rounded(_DECIMALS))),
    cell=lambda here: here.rounded(_DECIMALS),
    near=lambda value, _, here: value.covers(here, _INNER_M),
    serves=lambda value, _, here: value.covers(here),
    max_bytes=3_000_000,
    fresh_s=86_400.0,
    usable_s=7 * 86_400.0,
    oldest_s=math.inf,
    keeps=8,  # each is a map of some megabytes
    posts=True,
)
"""A server that speaks Overpass."""
