"""The official route files, read unchanged (CARLA Leaderboard 1.0, `data/routes_*.xml`), and those of Leaderboard 2.

Leaderboard 2 and Bench2Drive write the way as `waypoints/position`, without headings; their own scenarios are not read.

CARLA's frame is left-handed: here y and yaw change their sign, so that everything behind this file is right-handed.
"""

from __future__ import annotations

import hashlib
import itertools
import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from chauffeur.concept import DataError
from chauffeur.geometry import Pose

_HINT: Final = "The files of the branch leaderboard-1.0 of carla-simulator/leaderboard have the right form."
_MAX_BYTES: Final = 50_000_000
_MOST_M: Final = 1e6
"""No town is larger."""


@dataclass(frozen=True, slots=True)
class LeaderboardRoute:
    """A route of a file.

    Attributes:
        id: As in the file; names it in the official results (`RouteScenario_<id>`).
        town: Map that it belongs to.
        keypoints: Places it passes, right-handed frame; none for a malformed one.
        headed: Whether the file says which way one drives at its key points; else their headings lead to the next one.
        heights_m: Of the key points: a bridge and the street under it differ in nothing else.
        weather: The file's weather attributes, where it has any. Nothing here drives by them.
        fault: Why the route cannot be driven; empty for a sound one.
    """

    id: str
    town: str
    keypoints: tuple[Pose, ...]
    heights_m: tuple[float, ...] = ()
    weather: Mapping[str, float] = field(default_factory=dict[str, float])
    fault: str = ""
    headed: bool = True


@dataclass(frozen=True, slots=True)
class RouteFile:
    """All routes of a file, in its order.

    Attributes:
        name: Name of the file without its ending.
        routes: The routes; malformed ones keep their place, with their fault.
        sha256: Of the file's content.
    """

    name: str
    routes: tuple[LeaderboardRoute, ...]
    sha256: str


def read_routes(path: Path) -> RouteFile:
    """Read a route file.

    A malformed route is kept with its fault, since the benchmark scores it as not driven; a malformed file is an error.

    Raises:
        DataError: There is no such file, it is no XML, or it has no route.
    """
    try:
        with path.open("rb") as file:
            content = file.read(_MAX_BYTES + 1)
    except OSError as error:
        raise DataError(f"The route file {path} cannot be read: {error.strerror}.", hint=_HINT) from error
    if len(content) > _MAX_BYTES or b"<!ENTITY" in content:
        raise DataError(f"{path} is no route file: too large, or it declares entities.", hint=_HINT)
    try:
        root = ET.fromstring(content)  # noqa: S314 - entities are refused above
    except (ET.ParseError, ValueError, LookupError) as error:
        raise DataError(f"The route file {path} is no XML: {error}.", hint=_HINT) from error
    routes: list[LeaderboardRoute] = []
    for number, element in enumerate(root.iter("route")):
        route = _route(element, number)
        if any(route.id == known.id for known in routes):
            route = LeaderboardRoute(f"{route.id}-{number}", route.town, (), fault=f"the id {route.id!r} comes twice")
        routes.append(route)
    if not routes:
        raise DataError(f"The route file {path} has no route.", hint=_HINT)
    return RouteFile(path.stem, tuple(routes), hashlib.sha256(content).hexdigest())


def _route(element: ET.Element, number: int) -> LeaderboardRoute:
    name = element.get("id", "")
    town = (element.get("town") or element.get("map") or "").rpartition("/")[2]
    points = element.findall("waypoint") + [
        one for one in element.findall("waypoints/*") if one.tag in ("position", "waypoint")
    ]
    keypoints: list[Pose] = []
    heights: list[float] = []
    fault = "" if name else "it has no id"
    fault = fault or ("" if town else "it names no town")
    for place, point in enumerate(points):
        try:
            x, y = _number(point, "x"), _number(point, "y")
            yaw = _number(point, "yaw") if "yaw" in point.attrib else 0.0
            z = _number(point, "z") if "z" in point.attrib else 0.0
        except ValueError as error:
            fault = fault or f"waypoint {place}: {error}"
            continue
        keypoints.append(Pose(x, -y, -math.radians(yaw)))
        heights.append(z)
    if not fault and len(keypoints) < 2:
        fault = f"it has {len(keypoints)} waypoints, and a way needs two"
    headed = all("yaw" in point.attrib for point in points)
    if not headed:
        keypoints = _headed(keypoints)
    weather = element.find("weather")
    values: dict[str, float] = {}
    for key, text in {} if weather is None else weather.attrib.items():
        try:
            values[key] = float(text)
        except ValueError:
            continue  # a preset's name
    if fault:
        keypoints, heights = [], []
    return LeaderboardRoute(name or f"unnamed-{number}", town, tuple(keypoints), tuple(heights), values, fault, headed)


def _headed(points: list[Pose]) -> list[Pose]:
    """Key points that look at the next one, the last away from the one before."""
    legs = [math.atan2(then.y_m - now.y_m, then.x_m - now.x_m) for now, then in itertools.pairwise(points)]
    return [Pose(one.x_m, one.y_m, heading) for one, heading in zip(points, [*legs, *legs[-1:]], strict=False)]


def _number(element: ET.Element, name: str) -> float:
    text = element.get(name)
    if text is None:
        raise ValueError(f"{name} is missing")
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"{name}={text!r} is no number") from None
    if not math.isfinite(value) or abs(value) > _MOST_M:
        raise ValueError(f"{name}={text!r} is no number of a place")
    return value
