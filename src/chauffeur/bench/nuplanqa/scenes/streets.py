"""Streets to stage a scene on: a carriageway of one to four lanes, straight or bent, with or without a junction.

Frame of a street: right-handed, m; the ego's direction runs along +x from the origin until the bend, y to its left.
Traffic drives on the right. The junction, where there is one, is crossed by a straight street at right angles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Literal

from chauffeur.geometry import Lane, Polyline, RoadGraph

StreetKind = Literal["highway", "street", "crossing"]
BACK_M: Final = 130.0
AHEAD_M: Final = 170.0
WIDTH_M: Final = 3.6
WALK_M: Final = 2.4
CROSSWALK_M: Final = 4.0
_STEP_M: Final = 4.0


@dataclass(frozen=True, slots=True)
class StreetPlan:
    """Layout of a street.

    Attributes:
        kind: `highway` (no oncoming traffic), `street` (two-way, pavements), `crossing` (a street with a junction).
        lanes: In the ego's direction.
        curvature_per_m: Of the bend, positive to the left; 0 for a straight one.
        bend_m: Where it begins, ahead of the ego.
        junction_m: Where the stop line of the junction is, ahead of the ego; None without one.
        crosswalk_m: Where a marked pedestrian crossing is; None without one.
    """

    kind: StreetKind
    lanes: int
    curvature_per_m: float = 0.0
    bend_m: float = 20.0
    junction_m: float | None = None
    crosswalk_m: float | None = None

    @property
    def junction_length_m(self) -> float:
        """From the stop line to where the street goes on."""
        return 2.0 * WIDTH_M * 2.0 + 6.0

    def line(self, offset_m: float, start_m: float = -BACK_M, end_m: float = AHEAD_M) -> Polyline:
        """The street's line at an offset to the left of its first lane's left edge, from a station to another."""
        count = max(2, math.ceil(abs(end_m - start_m) / _STEP_M) + 1)
        stations = [start_m + (end_m - start_m) * i / (count - 1) for i in range(count)]
        return Polyline.of(self.place(station, offset_m) for station in stations)

    def place(self, station_m: float, offset_m: float) -> tuple[float, float]:
        """World place of a station along the street and an offset to its left."""
        heading = self.heading(station_m)
        if station_m <= self.bend_m or self.curvature_per_m == 0.0:
            return station_m, offset_m
        radius = 1.0 / self.curvature_per_m
        x = self.bend_m + radius * math.sin(heading)
        y = radius * (1.0 - math.cos(heading))
        return x - offset_m * math.sin(heading), y + offset_m * math.cos(heading)

    def heading(self, station_m: float) -> float:
        """Heading of the street at a station, rad; a bend ends after a quarter of a turn's worth of arc at most."""
        return self.curvature_per_m * max(0.0, station_m - self.bend_m)

    def lane_offset(self, index: int) -> float:
        """Offset of the middle of a lane of the ego's direction; index 0 is leftmost."""
        return -(index + 0.5) * WIDTH_M

    @property
    def oncoming(self) -> int:
        """Lanes of the other direction."""
        return 0 if self.kind == "highway" else min(self.lanes, 2)

    def oncoming_offset(self, index: int) -> float:
        """Offset of the middle of a lane of the other direction; index 0 is next to the middle of the road."""
        return (index + 0.5) * WIDTH_M


def road_of(plan: StreetPlan) -> RoadGraph:
    """The street as a graph of lanes."""
    limit = 30.0 if plan.kind == "highway" else 13.9
    lanes: list[Lane] = []
    cut = plan.junction_m
    length = plan.junction_length_m
    for index in range(plan.lanes):
        offset = plan.lane_offset(index)
        parts = [("own", -BACK_M, AHEAD_M, "")]
        if cut is not None:
            parts = [("own", -BACK_M, cut, ""), ("over", cut, cut + length, "J"), ("off", cut + length, AHEAD_M, "")]
        lanes += _row(plan, parts, index, offset, limit)
    for index in range(plan.oncoming):
        offset = plan.oncoming_offset(index)
        parts = [("other", AHEAD_M, -BACK_M, "")]
        if cut is not None:
            parts = [("other", AHEAD_M, cut + length, ""), ("other_over", cut + length, cut, "J")]
            parts.append(("other_off", cut, -BACK_M, ""))
        lanes += _row(plan, parts, index, offset, limit)
    if cut is not None:
        lanes += _cross_street(cut, length, limit)
    if plan.kind != "highway":
        lanes += _pavements(plan)
    return RoadGraph(tuple(lanes))


def _row(
    plan: StreetPlan, parts: Sequence[tuple[str, float, float, str]], index: int, offset: float, limit: float
) -> list[Lane]:
    names = [f"{name}.{index}" for name, *_ in parts]
    return [
        Lane(
            names[place],
            plan.line(offset, start, end),
            WIDTH_M,
            limit,
            road=name,
            index=index,
            successors=tuple(names[place + 1 : place + 2]),
            junction=junction,
        )
        for place, (name, start, end, junction) in enumerate(parts)
    ]


def _cross_street(cut: float, length: float, limit: float) -> list[Lane]:
    """A street of one lane each way across the junction, in three parts each."""
    middle, reach = cut + length / 2.0, 80.0
    half = length / 2.0 + 2.0
    found: list[Lane] = []
    for name, side in (("left", 1.0), ("right", -1.0)):  # from where its traffic comes
        x = middle - side * WIDTH_M / 2.0
        ends = (side * reach, side * half, -side * half, -side * reach)
        names = (f"{name}.0", f"{name}_over.0", f"{name}_off.0")
        for place, (start, end) in enumerate(pairwise(ends)):
            line = Polyline.of(((x, start), (x, end)))
            onward, junction = names[place + 1 : place + 2], "J" if place == 1 else ""
            road = names[place].removesuffix(".0")
            found.append(Lane(names[place], line, WIDTH_M, limit, road=road, successors=onward, junction=junction))
    return found


def _pavements(plan: StreetPlan) -> list[Lane]:
    right = -plan.lanes * WIDTH_M - WALK_M / 2.0 - 0.4
    left = plan.oncoming * WIDTH_M + WALK_M / 2.0 + 0.4
    found: list[Lane] = []
    cut, length = plan.junction_m, plan.junction_length_m
    spans = ((-BACK_M, AHEAD_M),) if cut is None else ((-BACK_M, cut - 1.0), (cut + length + 1.0, AHEAD_M))
    for side, offset in (("right", right), ("left", left)):
        for number, (start, end) in enumerate(spans):
            line = plan.line(offset, start, end)
            found.append(Lane(f"walk.{side}.{number}", line, WALK_M, 1.5, "sidewalk", road=f"walk.{side}.{number}"))
    if plan.crosswalk_m is not None:
        ends = [plan.place(plan.crosswalk_m, offset) for offset in (right, left)]
        found.append(Lane("zebra", Polyline.of(ends), CROSSWALK_M, 1.5, "crossing", road="zebra"))
    return found
