"""Lights and signs of a town from tables of stop lines and cycles, laid onto its lanes."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal, cast

from chauffeur.concept import DataError, Sign, SignalState
from chauffeur.geometry import LaneId, RoadGraph, wrap_to_pi
from chauffeur.worlds.town.pack import Line, Point, SignalGroup, SignalHead, SignalPhase

_ASKEW_RAD: Final = math.radians(45.0)
"""A lane that meets a stop line at more than this from square is not ruled by it."""
_INSIDE_M: Final = 6.0
"""A stop line no farther inside a junction rules the lanes before it."""


def carla_tables(
    road: RoadGraph, stop_lines: Sequence[Mapping[str, Any]], cycles: Sequence[Sequence[Mapping[str, Any]]]
) -> tuple[tuple[SignalGroup, ...], tuple[Sign, ...], dict[str, tuple[Point, ...]]]:
    """(lights, signs, stop boxes of the signs) from tables exported from CARLA, in CARLA's left-handed frame.

    Raises DataError for a table of another form.
    """
    heads: dict[str, SignalHead] = {}
    signs: list[Sign] = []
    boxes: dict[str, tuple[Point, ...]] = {}
    try:
        for row in stop_lines:
            name = str(row["actor_id"])
            x, y, heading = float(row["x"]), -float(row["y"]), wrap_to_pi(-float(row["orientation"]))
            width, depth = float(row["width"]), float(row["length"])
            lanes = lanes_at(road, x, y, heading, width)
            line, box = across(x, y, heading, width), box_at(x, y, heading, depth, width)
            if row["agent_type"] == "traffic_light":
                heads[name] = SignalHead(name, lanes, line, box)
            else:
                kind = cast('Literal["stop", "yield"]', str(row["agent_type"]).removesuffix("_sign"))
                signs.append(Sign(name, kind, lanes, x, y, line))
                boxes[name] = box
        groups = tuple(_group(road, i, phases, heads) for i, phases in enumerate(cycles))
    except (KeyError, TypeError, ValueError) as error:
        raise DataError(f"A table of stop lines or light cycles is not of the known form: {error!r}.") from error
    return groups, tuple(signs), boxes


def _group(
    road: RoadGraph, number: int, phases: Sequence[Mapping[str, Any]], heads: Mapping[str, SignalHead]
) -> SignalGroup:
    order = [name for name in phases[0]["actor_states"] if name in heads]
    own = tuple(heads[name] for name in order)
    return SignalGroup(
        str(number),
        junction_of(road, [lane for head in own for lane in head.lanes]),
        own,
        tuple(
            SignalPhase(
                float(phase["duration"]), tuple(cast("SignalState", phase["actor_states"][name]) for name in order)
            )
            for phase in phases
        ),
    )


def lanes_at(road: RoadGraph, x_m: float, y_m: float, heading_rad: float, width_m: float) -> tuple[LaneId, ...]:
    """Driving lanes that a stop line lies across; for a line just inside a junction, those that lead there."""
    found: dict[LaneId, None] = {}
    for share in (0.0, -0.2, 0.2, -0.4, 0.4):
        left = share * width_m
        place = road.locate(
            x_m - left * math.sin(heading_rad), y_m + left * math.cos(heading_rad), heading_rad, ("driving",)
        )
        if place is None:
            continue
        lane = road[place.lane]
        askew = wrap_to_pi(lane.centre.at(place.station_m).heading_rad - heading_rad)
        if abs(askew) > _ASKEW_RAD or abs(place.offset_m) > lane.width_m / 2.0 + 0.3:
            continue
        before = [one for one in road.predecessors(lane.id) if not one.junction]
        if lane.junction and before and place.station_m < _INSIDE_M:
            found.update(dict.fromkeys(one.id for one in before))
        else:
            found[lane.id] = None
    return tuple(found)


def junction_of(road: RoadGraph, lanes: Sequence[LaneId]) -> str:
    """The junction that most of some lanes lead to or lie in; empty for none."""
    votes = Counter[str]()
    for lane in lanes:
        seen: set[LaneId] = set()
        rim = [road[lane]]
        while rim and len(seen) < 20:
            one = rim.pop(0)
            if one.junction:
                votes[one.junction] += 1
                break
            if one.id not in seen:
                seen.add(one.id)
                rim += road.successors(one.id)
    return votes.most_common(1)[0][0] if votes else ""


def across(x_m: float, y_m: float, heading_rad: float, width_m: float) -> Line:
    """A line square to a heading, its left end first."""
    dx, dy = -math.sin(heading_rad) * width_m / 2.0, math.cos(heading_rad) * width_m / 2.0
    return (x_m + dx, y_m + dy), (x_m - dx, y_m - dy)


def box_at(x_m: float, y_m: float, heading_rad: float, depth_m: float, width_m: float) -> tuple[Point, ...]:
    """Corners of a box around a place: rear left, rear right, front right, front left."""
    ux, uy = math.cos(heading_rad) * depth_m / 2.0, math.sin(heading_rad) * depth_m / 2.0
    (lx, ly), (rx, ry) = across(x_m, y_m, heading_rad, width_m)
    return (lx - ux, ly - uy), (rx - ux, ry - uy), (rx + ux, ry + uy), (lx + ux, ly + uy)
