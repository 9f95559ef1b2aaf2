"""Ground truth of a clip of any world, read from its observations: lanes, who is where, lights, how the road goes on.

Where two answers could be called right (a vehicle between two lanes, a junction not yet near, a vehicle just out of
reach), the family of questions is named unclear and is not asked.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Final, Literal

from chauffeur.bench.nuplanqa.scenes.scene import LEFT_TAKEN_M, Layout, Motion, QaScene, QaUser, RoadKind, Sky
from chauffeur.concept import ScenarioError
from chauffeur.concept.scene import Observation, Signal, VehicleState
from chauffeur.describe.road import ego_lane, own_direction
from chauffeur.describe.town import own_signals
from chauffeur.geometry import Lane, Polyline

SIGHT_M: Final = 100.0
"""Greatest distance of a lead vehicle."""
_DENSITY_M: Final = 60.0
"""Vehicles this far ahead are counted; those beyond make the count unclear."""
_JUNCTION_M: Final = 45.0
_UNCLEAR_M: Final = 80.0
"""A junction this near is ahead; one between the two is neither there nor not."""
_LIGHT_M: Final = 60.0
_BESIDE_M: Final = (-3.0, 10.0)
_NOT_BESIDE_M: Final = (-9.0, 14.0)
"""Middles of who is beside lie between the former; who reaches between the latter with front or rear is unclear."""
_BEHIND_M: Final = 28.0
_NOT_BEHIND_M: Final = 60.0
_IN_LANE: Final = 0.42
_HALF_IN_LANE: Final = 0.75
"""Share of a lane's width by which a vehicle in it is off its middle; up to the second it is unclear."""
_ALONG_RAD: Final = math.radians(35.0)
_STRAIGHT_RAD: Final = 0.04
_BENT_RAD: Final = 0.2
_STEERING_RAD: Final = math.radians(3.0)
_STILL_MPS: Final = 0.15
_STEADY_MPS: Final = 0.6
_CHANGED_MPS: Final = 1.7
_WALKER_M: Final = 28.0
_AMONG_M: Final = 18.0
_AMONG: Final = 5
"""So many vehicles so near make the ego one among parked vehicles."""
_WIDE_M: Final = 2.0
"""A shoulder as wide as this looks like one more lane."""
_STREET_RAD: Final = math.radians(135.0)


def motion_of(instants: Sequence[Observation]) -> Motion | None:
    """Motion of the ego in a clip; None where two answers could be called right, or where it turns."""
    if any(abs(one.ego.steering_rad) > _STEERING_RAD for one in instants):
        return None
    speeds = [one.ego.speed_mps for one in instants]
    if max(speeds) < _STILL_MPS:
        return "still"
    change, steps = speeds[-1] - speeds[0], [b - a for a, b in pairwise(speeds)]
    if max(speeds) - min(speeds) < _STEADY_MPS and min(speeds) > 1.5:
        return "steady"
    if change > _CHANGED_MPS and min(steps) > 0.0:
        return "faster"
    return "slower" if change < -_CHANGED_MPS and max(steps) < 0.0 and speeds[-1] > 0.5 else None


@dataclass(frozen=True)
class _Way:
    """The lanes ahead and behind as one line, and who is where along it.

    Attributes:
        lane: The ego's.
        line: From behind the ego to `SIGHT_M` ahead or the end of the road.
        at_m: Station of the ego.
        junction_m: How far ahead the next junction begins; infinite for none.
        end_m: How far ahead the line ends.
    """

    observation: Observation
    lane: Lane
    line: Polyline
    at_m: float
    junction_m: float
    end_m: float

    @cached_property
    def users(self) -> tuple[tuple[VehicleState, float, float], ...]:
        """(road user, m ahead of the ego, m to the left of the line) of those who go along it within its reach."""
        found: list[tuple[VehicleState, float, float]] = []
        ego = self.observation.ego
        for one in self.observation.others:
            if math.hypot(one.x_m - ego.x_m, one.y_m - ego.y_m) > SIGHT_M + 50.0:
                continue
            station, offset = self.line.project(one.x_m, one.y_m)
            askew = abs(math.remainder(one.heading_rad - self.line.at(station).heading_rad, math.tau))
            if askew < _ALONG_RAD or one.kind == "pedestrian":
                found.append((one, station - self.at_m, offset))
        return tuple(sorted(found, key=lambda one: one[1]))


def _way(observation: Observation) -> _Way:
    lane, road, ego = ego_lane(observation), observation.road, observation.ego
    points: list[tuple[float, float]] = []
    before = road.predecessors(lane.id)
    if before:
        points += before[0].centre.points_m[:-1]
    start = len(points)
    points += lane.centre.points_m
    left = SIGHT_M + 60.0 - (lane.length_m - lane.centre.nearest(ego.x_m, ego.y_m))
    junction: tuple[float, float] | None = lane.centre.points_m[0] if lane.junction else None
    for onward in road.ahead(lane.id):
        if onward is lane:
            continue
        if left < 0.0:
            break
        if onward.junction and junction is None:
            junction = onward.centre.points_m[0]
        points += onward.centre.points_m[1:]
        left -= onward.length_m
    line = Polyline.of(points)
    low = 0.0 if not start else line.nearest(*lane.centre.points_m[0])
    at = line.nearest(ego.x_m, ego.y_m, low, low + lane.length_m)
    away = math.inf if junction is None else max(0.0, line.nearest(*junction) - at)
    return _Way(observation, lane, line, at, away, line.length_m - at)


def read_scene(
    instants: Sequence[Observation], token: str, source: str, sky: Sky, shakes_rad: Sequence[float]
) -> QaScene | None:
    """Ground truth of a clip; None where nothing can be asked about it.

    Args:
        instants: Five, half a second apart.
        token, source, sky: Of the scene.
        shakes_rad: What is added to the angle of the ego's front wheels at each instant.
    """
    motion, now = motion_of(instants), instants[-1]
    if motion is None or now.off_road or now.ended:
        return None
    try:
        way, abreast, signals = _way(now), own_direction(now), own_signals(now)
    except ScenarioError:
        return None
    lanes = [one for one in abreast if one.kind != "emergency"]
    if way.lane.junction or way.lane not in lanes or way.end_m < 40.0:
        return None
    unclear: set[str] = set()
    own = lanes.index(way.lane)
    kind = "lot" if now.lot is not None else _kind(way, lanes, unclear)
    light = _light(way, signals, unclear)
    lead = _lead(way, unclear)
    left, right = (_beside(way, lanes, own, side, unclear) for side in (-1, 1))
    walker, walker_from = _walker(way, unclear)
    if len(lanes) > 4 or any(one.kind == "emergency" and one.width_m > _WIDE_M for one in abreast):
        unclear.add("lanes")
    if kind == "lot":
        unclear |= {"lanes", "layout", "density", "manoeuvre", "behind"}
        near = [one for one in now.others if math.dist((one.x_m, one.y_m), (now.ego.x_m, now.ego.y_m)) < _AMONG_M]
        if len(near) < _AMONG:
            unclear.add("situation")
    if now.stop_sign_m is not None and now.stop_sign_m < _UNCLEAR_M:
        unclear |= {"key", "manoeuvre", "action"}
    return QaScene(
        token=token,
        source=source,
        kind=kind,
        lanes=len(lanes),
        own=own,
        layout=_layout(way, unclear),
        motion=motion,
        sky=sky,
        light=None if light is None or light.state == "off" else light.state,
        light_id="" if light is None else light.id,
        left_taken=own > 0 and _left_taken(way, lanes[own - 1]),
        lead=lead,
        left=left,
        right=right,
        behind=_behind(way, unclear),
        walker=walker,
        walker_from=walker_from,
        ahead=_ahead(way, lanes, own, unclear),
        unclear=frozenset(unclear),
        instants=tuple(
            replace(one, ego=replace(one.ego, steering_rad=one.ego.steering_rad + shake))
            for one, shake in zip(instants, shakes_rad, strict=True)
        ),
    )


def _kind(way: _Way, lanes: Sequence[Lane], unclear: set[str]) -> RoadKind:
    if way.junction_m <= _JUNCTION_M:
        return "crossing"
    if way.junction_m <= _UNCLEAR_M:
        unclear |= {"layout", "manoeuvre", "situation", "key", "action"}
    road, leftmost = way.observation.road, lanes[0]
    pose = leftmost.centre.at(leftmost.centre.nearest(way.observation.ego.x_m, way.observation.ego.y_m))
    s, c = math.sin(pose.heading_rad), math.cos(pose.heading_rad)
    beside = pose.x_m - leftmost.width_m * s, pose.y_m + leftmost.width_m * c
    place = road.locate(*beside, kinds=("driving",))
    if place is not None and abs(place.offset_m) < leftmost.width_m:
        other = road[place.lane]
        turned = math.remainder(other.centre.at(place.station_m).heading_rad - pose.heading_rad, math.tau)
        if abs(turned) > _STREET_RAD:
            return "street"
    if len(lanes) < 2:
        unclear.add("situation")
    return "highway"


def _layout(way: _Way, unclear: set[str]) -> Layout:
    if way.junction_m <= _JUNCTION_M:
        return "junction"
    near, far = (min(way.at_m + ahead, way.line.length_m) for ahead in (0.0, 45.0))
    turned = math.remainder(way.line.at(far).heading_rad - way.line.at(near).heading_rad, math.tau)
    if abs(turned) < _STRAIGHT_RAD:
        return "straight"
    if abs(turned) < _BENT_RAD:
        unclear.add("layout")
    return "left" if turned > 0.0 else "right"


def _light(way: _Way, signals: Sequence[Signal], unclear: set[str]) -> Signal | None:
    """The ego's traffic light, at most `_LIGHT_M` ahead."""
    away = [(_middle_ahead(way, one), one) for one in signals]
    found = min((one for one in away if one[0] > -2.0), key=lambda one: one[0], default=None)
    if found is None or found[0] > _LIGHT_M or found[1].state == "off":
        if way.observation.signals and way.junction_m <= SIGHT_M + 50.0:  # one may be seen that is not ours, or far
            unclear |= {"light", "key", "manoeuvre", "situation", "action"}
        return None
    return found[1]


def _middle_ahead(way: _Way, signal: Signal) -> float:
    (ax, ay), (bx, by) = signal.stop_line_m
    return way.line.nearest((ax + bx) / 2.0, (ay + by) / 2.0) - way.at_m


def _vehicles(way: _Way) -> list[tuple[VehicleState, float, float]]:
    return [one for one in way.users if one[0].kind != "pedestrian"]


def _lead(way: _Way, unclear: set[str]) -> QaUser | None:
    width = way.lane.width_m
    for one, ahead, offset in _vehicles(way):
        if not 0.0 < ahead <= SIGHT_M or abs(offset) > _HALF_IN_LANE * width:
            continue
        if abs(offset) > _IN_LANE * width or ahead > way.junction_m - 1.0 or ahead > way.end_m:
            unclear.add("lead")
        return QaUser(one.id, one.kind, ahead)
    return None


def _beside(way: _Way, lanes: Sequence[Lane], own: int, side: int, unclear: set[str]) -> QaUser | None:
    """Vehicle next to the ego in the lane on a side (-1 left, 1 right)."""
    if not 0 <= own + side < len(lanes):
        return None
    middle = -side * (way.lane.width_m + lanes[own + side].width_m) / 2.0
    width, name = lanes[own + side].width_m, f"beside {'left' if side < 0 else 'right'}"
    found: QaUser | None = None
    for one, ahead, offset in _vehicles(way):
        front, rear = ahead + one.length_m / 2.0, ahead - one.length_m / 2.0
        near = front > _NOT_BESIDE_M[0] and rear < _NOT_BESIDE_M[1]
        if not near or abs(offset - middle) > _HALF_IN_LANE * width:
            continue
        inside = _BESIDE_M[0] < ahead < _BESIDE_M[1] and abs(offset - middle) <= _IN_LANE * width
        if not inside or found is not None:
            unclear.add(name)
        found = found or QaUser(one.id, one.kind, ahead)
    return found


def _left_taken(way: _Way, lane: Lane) -> bool:
    middle = (way.lane.width_m + lane.width_m) / 2.0
    return any(
        0.0 < ahead < LEFT_TAKEN_M and abs(offset - middle) < lane.width_m / 2.0 for _, ahead, offset in _vehicles(way)
    )


def _behind(way: _Way, unclear: set[str]) -> QaUser | None:
    width = way.lane.width_m
    if way.at_m < _NOT_BEHIND_M and way.observation.road.predecessors(way.lane.id):
        unclear.add("behind")  # who comes from where is told by a part of the road that was not followed
    for one, ahead, offset in reversed(_vehicles(way)):
        if not -_NOT_BEHIND_M < ahead < 0.0 or abs(offset) > _HALF_IN_LANE * width:
            continue
        if abs(offset) > _IN_LANE * width or ahead < -_BEHIND_M:
            unclear.add("behind")
        return QaUser(one.id, one.kind, ahead)
    return None


def _ahead(way: _Way, lanes: Sequence[Lane], own: int, unclear: set[str]) -> tuple[QaUser, ...]:
    """Vehicles wholly ahead in the lanes of the ego's direction."""
    left = sum(one.width_m for one in lanes[:own]) + way.lane.width_m * 0.5
    right = sum(one.width_m for one in lanes[own + 1 :]) + way.lane.width_m * 0.5
    front = way.observation.ego.length_m / 2.0
    found: list[QaUser] = []
    beyond = False
    for one, ahead, offset in _vehicles(way):
        if not -right < offset < left or ahead + one.length_m / 2.0 < front + 1.0:
            continue
        if ahead - one.length_m / 2.0 <= front:
            unclear.add("density")
        elif ahead <= _DENSITY_M:
            found.append(QaUser(one.id, one.kind, ahead))
        else:
            beyond = True
    if (beyond and len(found) < 3) or way.junction_m < _DENSITY_M:
        unclear.add("density")
    return tuple(found)


def _walker(way: _Way, unclear: set[str]) -> tuple[QaUser | None, Literal["left", "right"]]:
    """Pedestrian on the carriageway ahead, and the side they come from."""
    found: list[tuple[QaUser, Literal["left", "right"]]] = []
    road = way.observation.road
    for one, ahead, offset in way.users:
        if one.kind != "pedestrian" or not 0.0 < ahead < _WALKER_M + 12.0 or abs(offset) > 14.0:
            continue
        place = road.locate(one.x_m, one.y_m, kinds=("driving", "aisle"))
        if place is None or abs(place.offset_m) > road[place.lane].width_m / 2.0:
            continue
        along = math.remainder(one.heading_rad - way.line.at(way.at_m + ahead).heading_rad, math.tau)
        side: Literal["left", "right"] = "right" if along > 0.0 else "left"
        # A pedestrian who has passed the ego's lane, or goes along it, or is far: a matter of opinion.
        passed = offset > 2.0 if side == "right" else offset < -2.0
        crosses = one.speed_mps > 0.3 and math.radians(50.0) < abs(along) < math.radians(130.0)
        if passed or not crosses or ahead > _WALKER_M:
            unclear |= {"key", "manoeuvre", "situation", "action"}
        found.append((QaUser(one.id, one.kind, ahead), side))
    if len(found) > 1:
        unclear |= {"key"}
    return found[0] if found else (None, "left")
