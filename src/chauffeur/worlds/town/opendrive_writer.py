"""OpenDRIVE of a town plan, through scenariogeneration: needed to build maps, not to drive in them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree as ET

import numpy as np

from chauffeur.concept import MissingExtraError
from chauffeur.worlds.town.recipes import TownPlan, TownStreet

if TYPE_CHECKING:
    from scenariogeneration import xodr as Xodr  # noqa: N812

LANE_M: Final = 3.5
KERB_M: Final = 0.5
SIDEWALK_M: Final = 2.5
CROSSING_M: Final = 3.0
_CROSSING_BACK_M: Final = 3.0
"""From the end of a street to the middle of its crossing."""
_SIGN_BACK_M: Final = 12.0
_BUILDING_M: Final = 8.0
_STRAIGHT_RAD: Final = math.radians(45.0)
_FIRST_WAY: Final = 1000
"""Ids of streets are below, those of ways through crossroads from here on."""
_FIRST_JUNCTION: Final = 100
_PROJECTION: Final = "+proj=tmerc +lat_0=0 +lon_0=0 +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m +no_defs"
_DATE: Final = "2026-01-01T00:00:00"


@dataclass(frozen=True)
class _Arm:
    """An end of a street at a crossroads.

    Attributes:
        street: Its number.
        at_start: Whether the street begins here.
        x_m, y_m: Of the street's middle.
        out_rad: Heading away from the crossroads.
        into, away: Number of lanes that lead into the crossroads and away from it.
    """

    street: int
    at_start: bool
    x_m: float
    y_m: float
    out_rad: float
    into: int
    away: int

    def lane(self, place: int, *, into: bool) -> int:
        """OpenDRIVE id of the lane at a place from the middle (1 is leftmost), leading into the crossroads or away."""
        return place if into == self.at_start else -place


def draw(plan: TownPlan) -> bytes:
    """The OpenDRIVE file of a plan; the same bytes every time.

    Raises:
        MissingExtraError: scenariogeneration is not installed.
    """
    try:
        from scenariogeneration import xodr
    except ImportError as error:
        raise MissingExtraError("Drawing a town needs scenariogeneration.", extra="maps") from error
    town = xodr.OpenDrive(plan.name, "1", "4", _PROJECTION)
    arms: dict[int, list[_Arm]] = {}
    for i, street in enumerate(plan.streets):
        road = _street(xodr, plan, i, street)
        for node, arm in _arms(plan, i, street):
            arms.setdefault(node, []).append(arm)
        town.add_road(road)
    number = _FIRST_WAY
    for node, ends in arms.items():
        junction = xodr.Junction(f"junction {node}", _FIRST_JUNCTION + node)
        for start, goal, place, onto in _ways(ends):
            walk = _kerbside(ends, start) is goal and (place, onto) == (start.into, goal.away)
            links = [(place, onto)] + ([(place + k, onto + k) for k in (1, 2)] if walk else [])
            town.add_road(_way(xodr, number, _FIRST_JUNCTION + node, start, goal, links))
            connection = xodr.Connection(start.street, number, xodr.ContactPoint.start)
            for k, (own, _) in enumerate(links):
                connection.add_lanelink(start.lane(own, into=True), -1 - k)
            junction.add_connection(connection)
            number += 1
        town.add_junction(junction)
    root = town.get_element()
    for header in root.findall("header"):
        header.set("date", _DATE)
    # scenariogeneration numbers signals and objects through the life of the process.
    for kind in ("signal", "object"):
        for count, node in enumerate(root.iter(kind)):
            node.set("id", str(count))
    for thing in root.iter("object"):  # one outline, as OpenDRIVE 1.4 and CARLA have it
        for outlines in thing.findall("outlines"):
            thing.remove(outlines)
            thing.extend(outlines.findall("outline"))
    return ET.tostring(root, encoding="UTF-8", xml_declaration=True)


# Geometry -------------------------------------------------------------------------------------------------------------


def _ends(plan: TownPlan, street: TownStreet) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """(x, y, heading along the street) where it begins and where it ends."""
    a, b = plan.crossroads[street.a], plan.crossroads[street.b]
    straight = math.atan2(b.y_m - a.y_m, b.x_m - a.x_m)
    leaves = straight if street.leaves_rad is None else street.leaves_rad
    arrives = straight if street.arrives_rad is None else street.arrives_rad
    return (
        (a.x_m + a.radius_m * math.cos(leaves), a.y_m + a.radius_m * math.sin(leaves), leaves),
        (b.x_m - b.radius_m * math.cos(arrives), b.y_m - b.radius_m * math.sin(arrives), arrives),
    )


def _arms(plan: TownPlan, i: int, street: TownStreet) -> Iterator[tuple[int, _Arm]]:
    (ax, ay, leaves), (bx, by, arrives) = _ends(plan, street)
    back = 0 if street.one_way else street.lanes
    yield street.a, _Arm(i, True, ax, ay, leaves, back, street.lanes)
    yield street.b, _Arm(i, False, bx, by, arrives + math.pi, street.lanes, back)


def _curve(
    xodr: Any, start: tuple[float, float, float], end: tuple[float, float, float]
) -> tuple[Xodr.PlanView, float]:
    """(plan view, length) of a line where that does, else of a cubic that leaves and arrives with given headings."""
    (ax, ay, heading), (bx, by, arrives) = start, end
    dx, dy = bx - ax, by - ay
    chord = math.hypot(dx, dy)
    u, v = dx * math.cos(heading) + dy * math.sin(heading), dy * math.cos(heading) - dx * math.sin(heading)
    turned = math.remainder(arrives - heading, 2.0 * math.pi)
    view = xodr.PlanView()
    if abs(turned) < 1e-9 and abs(v) < 1e-6:
        view.add_fixed_geometry(xodr.Line(chord), ax, ay, heading)
        return view, chord
    # Handles as of the Bezier curve nearest to a circular arc; a third of the chord for none.
    handle = (
        chord if abs(turned) < 1e-6 else 4.0 * math.tan(abs(turned) / 4.0) * chord / (2.0 * math.sin(abs(turned) / 2.0))
    )
    tu, tv = handle * math.cos(turned), handle * math.sin(turned)
    us = (0.0, handle, 3.0 * u - 2.0 * handle - tu, handle + tu - 2.0 * u)
    vs = (0.0, 0.0, 3.0 * v - tv, tv - 2.0 * v)
    p = np.linspace(0.0, 1.0, 2001)
    xs, ys = (c[0] + p * (c[1] + p * (c[2] + p * c[3])) for c in (us, vs))
    length = round(float(np.hypot(np.diff(xs), np.diff(ys)).sum()), 6)
    view.add_fixed_geometry(xodr.ParamPoly3(*us, *vs, "normalized", length), ax, ay, heading)
    return view, length


# Streets --------------------------------------------------------------------------------------------------------------


def _street(xodr: Any, plan: TownPlan, i: int, street: TownStreet) -> Xodr.Road:
    start, end = _ends(plan, street)
    view, length = _curve(xodr, start, end)
    section = xodr.LaneSection(0, _lane(xodr, "none", 0.0, "solid", changes="none"))
    for side in (-1, 1):
        if side < 0 or not street.one_way:
            for place in range(street.lanes):
                last = place == street.lanes - 1
                mark, changes = ("solid", "none") if last else ("broken", "both")
                _add(section, side, _lane(xodr, "driving", LANE_M, mark, changes=changes))
            _add(section, side, _lane(xodr, "shoulder", KERB_M, "curb", changes="none"))
            _add(section, side, _lane(xodr, "sidewalk", SIDEWALK_M, "none", changes="none"))
    lanes = xodr.Lanes()
    lanes.add_lanesection(section)
    road = xodr.Road(i, view, lanes, name=street.name)
    road.add_predecessor(xodr.ElementType.junction, _FIRST_JUNCTION + street.a)
    road.add_successor(xodr.ElementType.junction, _FIRST_JUNCTION + street.b)
    road.add_type(xodr.RoadType.town, 0, speed=street.speed_kmh, speed_unit="km/h")
    _furnish(xodr, plan, street, road, length)
    return road


def _lane(xodr: Any, kind: str, width_m: float, mark: str, *, changes: str) -> Xodr.Lane:
    lane = xodr.Lane(getattr(xodr.LaneType, kind), a=width_m)
    change = getattr(xodr.LaneChange, changes)
    lane.add_roadmark(xodr.RoadMark(getattr(xodr.RoadMarkType, mark), 0.12, laneChange=change))
    return lane


def _add(section: Xodr.LaneSection, side: int, lane: Xodr.Lane) -> None:
    if side < 0:
        section.add_right_lane(lane)
    else:
        section.add_left_lane(lane)


def _furnish(xodr: Any, plan: TownPlan, street: TownStreet, road: Xodr.Road, length: float) -> None:
    """Lights, signs, crossings and landmarks of a street."""
    edge = street.lanes * LANE_M + KERB_M
    minor = {end: _minor(plan, street, end) for end in (street.a, street.b)}
    ways = [(True, street.b)] if street.one_way else [(True, street.b), (False, street.a)]
    for along, end in ways:
        sign, at = (-1.0 if along else 1.0), (length if along else 0.0)
        facing = xodr.Orientation.positive if along else xodr.Orientation.negative
        control = plan.crossroads[end].control
        kind = {"lights": "1000001", "stop": "206", "yield": "205"}.get(control)
        if kind is not None and (control == "lights" or minor[end]):
            road.add_signal(
                xodr.Signal(
                    at + sign * 0.5, sign * (edge + 0.5), "OpenDRIVE", kind,
                    name=control, dynamic=getattr(xodr.Dynamic, "yes" if control == "lights" else "no"),
                    orientation=facing,
                )
            )  # fmt: skip
        start = _SIGN_BACK_M if along else length - _SIGN_BACK_M
        if length > 3.0 * _SIGN_BACK_M:
            limit = xodr.Signal(
                start, sign * (edge + 0.5), "OpenDRIVE", "274", str(street.speed_kmh), orientation=facing
            )
            limit.name, limit.value, limit.unit = "speed limit", street.speed_kmh, "km/h"
            road.add_signal(limit)
        if control == "lights":
            back = length - _CROSSING_BACK_M if along else _CROSSING_BACK_M
            road.add_object(_crossing(xodr, back, edge))
    if street.middle_crossing:
        road.add_object(_crossing(xodr, length / 2.0, edge))
    for mark in street.landmarks:
        side = -1.0 if mark.along else 1.0
        away = edge + SIDEWALK_M + (0.5 if mark.kind == "bus_stop" else _BUILDING_M)
        kind = "busStop" if mark.kind == "bus_stop" else "building"
        size = (
            {"width": 2.0, "length": 6.0, "height": 3.0}
            if kind == "busStop"
            else {"width": 12.0, "length": 16.0, "height": 10.0}
        )
        road.add_object(xodr.Object(mark.share * length, side * away, kind, mark.kind, None, mark.name, **size))


def _minor(plan: TownPlan, street: TownStreet, node: int) -> bool:
    """True if a street gives way at a crossroads: to a ring it joins, a wider street, one that goes through."""
    others = [one for one in plan.streets if node in (one.a, one.b) and one is not street]
    if len(others) < 2:
        return False
    if any(one.one_way for one in others):
        return not street.one_way
    if any(one.lanes != street.lanes for one in others):
        return street.lanes < max(one.lanes for one in others)
    own = _leaving_rad(plan, street, node)
    turns = [math.remainder(_leaving_rad(plan, one, node) - own - math.pi, 2.0 * math.pi) for one in others]
    return all(abs(turn) > _STRAIGHT_RAD for turn in turns)


def _leaving_rad(plan: TownPlan, street: TownStreet, node: int) -> float:
    """Heading of a street away from one of its crossroads."""
    (_, _, leaves), (_, _, arrives) = _ends(plan, street)
    return leaves if street.a == node else arrives + math.pi


def _crossing(xodr: Any, at: float, edge: float) -> Xodr.Object:
    length = 2.0 * edge
    crossing = xodr.Object(
        at, 0.0, "crosswalk", name="crossing", hdg=math.pi / 2.0, width=CROSSING_M, length=length, height=0.01
    )
    outline = xodr.Outline()
    for u, v in ((0.5, 0.5), (0.5, -0.5), (-0.5, -0.5), (-0.5, 0.5)):
        outline.add_corner(xodr.CornerLocal(u * length, v * CROSSING_M, 0.0, 0.01))
    crossing.add_outline(outline)
    return crossing


# Ways through crossroads ----------------------------------------------------------------------------------------------


def _ways(arms: list[_Arm]) -> Iterator[tuple[_Arm, _Arm, int, int]]:
    """(from, to, place of the lane it leaves, of the lane it enters): left from the left, right from the right lane."""
    for start in arms:
        found: list[tuple[_Arm, int, int]] = []
        for goal in arms:
            if goal is start or not start.into or not goal.away:
                continue
            turn = math.remainder(goal.out_rad - start.out_rad - math.pi, 2.0 * math.pi)
            if abs(turn) <= _STRAIGHT_RAD:
                found += [(goal, place, place) for place in range(1, min(start.into, goal.away) + 1)]
            elif turn > 0.0:
                found.append((goal, 1, 1))
            else:
                found.append((goal, start.into, goal.away))
        used = {place for _, place, _ in found}
        for place in range(1, start.into + 1):
            if place not in used and found:  # a lane of its own leads on with its neighbour
                goal = min(found, key=lambda one: abs(one[1] - place))[0]
                found.append((goal, place, min(place, goal.away)))
        yield from ((start, goal, place, onto) for goal, place, onto in found)


def _kerbside(arms: list[_Arm], start: _Arm) -> _Arm | None:
    """The arm around the kerb on the right of who comes in: no other arm lies between the two."""
    others = [arm for arm in arms if arm is not start]
    return min(others, key=lambda arm: (arm.out_rad - start.out_rad) % (2.0 * math.pi), default=None)


def _way(xodr: Any, number: int, junction: int, start: _Arm, goal: _Arm, links: list[tuple[int, int]]) -> Xodr.Road:
    """One lane through a crossroads, perhaps with kerb and sidewalk; its reference line is the lane's left edge."""
    place, onto = links[0]
    heading = start.out_rad + math.pi
    a, b = ((place - 1) * LANE_M, heading, start), ((onto - 1) * LANE_M, goal.out_rad, goal)
    ends = [(arm.x_m + aside * math.sin(to), arm.y_m - aside * math.cos(to), to) for aside, to, arm in (a, b)]
    view, _ = _curve(xodr, ends[0], ends[1])
    section = xodr.LaneSection(0, _lane(xodr, "none", 0.0, "none", changes="none"))
    kinds = (("driving", LANE_M), ("shoulder", KERB_M), ("sidewalk", SIDEWALK_M))
    for (own, its), (kind, width) in zip(links, kinds, strict=False):
        lane = _lane(xodr, kind, width, "none", changes="none")
        lane.add_link("predecessor", start.lane(own, into=True))
        lane.add_link("successor", goal.lane(its, into=False))
        section.add_right_lane(lane)
    lanes = xodr.Lanes()
    lanes.add_lanesection(section)
    road = xodr.Road(number, view, lanes, road_type=junction)
    for add, arm in ((road.add_predecessor, start), (road.add_successor, goal)):
        contact = xodr.ContactPoint.start if arm.at_start else xodr.ContactPoint.end
        add(xodr.ElementType.road, arm.street, contact)
    return road
