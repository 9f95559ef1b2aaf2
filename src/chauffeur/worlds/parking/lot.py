"""The parking lot: a drive in along the north, one-way aisles with slanted spots on both sides, a drive out.

```
   entrance ->  n1 ------- n2 ------- n3        x grows to the east, y to the north: the drive in lies on y = 0,
                 \\          \\          \\        all else to the south of it
                 a1         a2         a3
              A  |  B    C  |  D    E  |  F     | stadium gate
                 b1         b2         b3
                 /          /          /
   exit  <-- s1 ------- s2 ------- s3
```

A spot's lines are its rectangle. Spots stand at 60 degrees to their aisle, as is usual where aisles are one-way: a car
can drive in forwards in one turn. Sizes follow ordinary practice (spots 2.75 m by 5.5 m, aisles 5.5 m).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from chauffeur.concept.units import MPS_PER_KMH
from chauffeur.geometry import Box, Lane, LaneId, Polyline, RoadGraph

Points = tuple[tuple[float, float], ...]

AISLE_M: Final = 5.5
"""Width of a drive or an aisle."""
SPOT_WIDTH_M: Final = 2.75
SPOT_LENGTH_M: Final = 5.5
SLANT_RAD: Final = math.radians(60.0)
"""Angle between an aisle and its spots."""
CORNER_M: Final = 6.0
"""Radius, along the middle, of the corners between drives and aisles."""
ISLAND_M: Final = 1.2
"""Between rows that stand back to back."""
LIMIT_MPS: Final = 15.0 * MPS_PER_KMH
_APPROACH_M: Final = 24.0
_END_M: Final = 12.0
"""From the middle of a drive to the first spot."""
_MARGIN_M: Final = 6.0
_ARC_STEP_RAD: Final = math.radians(3.0)


@dataclass(frozen=True, slots=True)
class Spot:
    """A parking spot.

    Attributes:
        name: Row letter and number, counted from the north: `B4`.
        aisle: Number of its aisle, from 1 in the west.
        box: The ground between its lines.
        lane: Id of its lane in the observation: wishing for that lane is wishing for this spot.
    """

    name: str
    aisle: int
    box: Box
    lane: LaneId


@dataclass(frozen=True, slots=True)
class Lot:
    """A lot's ground.

    Attributes:
        aisles: How many.
        spots: By name.
        road: Drives, corners, aisles and spots.
        ground: What is paved.
        gate_m: Where people enter the stadium.
        exit_m: Where cars leave.
    """

    aisles: int
    spots: dict[str, Spot]
    road: RoadGraph
    ground: Box
    gate_m: tuple[float, float]
    exit_m: tuple[float, float]

    def aisle_x_m(self, aisle: int) -> float:
        """x of an aisle's middle, m; the first aisle is 1."""
        return self.road[way_id(f"a{aisle}", f"b{aisle}")].centre.points_m[0][0]


def build_lot(aisles: int, spots_a_row: int, taken: frozenset[str] = frozenset()) -> Lot:
    """A lot with `aisles` aisles and `spots_a_row` spots on each side of each; lanes of `taken` spots are closed."""
    depth = SPOT_LENGTH_M * math.sin(SLANT_RAD) + SPOT_WIDTH_M * math.cos(SLANT_RAD)
    module = AISLE_M + 2.0 * depth + ISLAND_M
    pitch = SPOT_WIDTH_M / math.sin(SLANT_RAD)
    south = 2.0 * _END_M + spots_a_row * pitch
    middles = [depth + module * j for j in range(aisles)]
    lanes = _ways(middles, south)
    spots: dict[str, Spot] = {}
    for j, x in enumerate(middles):
        for side in (0, 1):
            letter = chr(ord("A") + 2 * j + side)
            out = -1.0 if side == 0 else 1.0  # west of the aisle, or east of it
            heading = out * SLANT_RAD - math.pi / 2.0
            for number in range(spots_a_row):
                name = f"{letter}{number + 1}"
                y = _END_M + (number + 0.5) * pitch + SPOT_LENGTH_M / 2.0 * math.cos(SLANT_RAD)
                box = Box(x + out * (AISLE_M + depth) / 2.0, -y, heading, SPOT_LENGTH_M, SPOT_WIDTH_M)
                spots[name] = Spot(name, j + 1, box, name)
    lanes.extend(_spot_lane(spot, spot.name in taken) for spot in spots.values())
    west, east = -_APPROACH_M, middles[-1] + AISLE_M / 2.0 + depth + _MARGIN_M
    top, bottom = AISLE_M / 2.0 + 1.0, -south - AISLE_M / 2.0 - 1.0
    ground = Box((west + east) / 2.0, (top + bottom) / 2.0, 0.0, east - west, top - bottom)
    return Lot(aisles, spots, RoadGraph(tuple(lanes), paved=(ground,)), ground, (east, -south / 2.0), (west, -south))


def way_id(start: str, end: str) -> LaneId:
    """The name of the drive, corner or aisle between two nodes; a spot's lane has the spot's name."""
    return f"{start}-{end}"


def nodes_of(way: LaneId) -> tuple[str, str]:
    """The nodes that a drive, corner or aisle joins."""
    start, _, end = way.partition("-")
    return start, end


def _ways(middles: list[float], south: float) -> list[Lane]:
    """Drives, corners and aisles: x of the middles of the aisles, and how far south the drive out is."""
    found: dict[tuple[str, str], Points] = {}
    for j, x in enumerate(middles, start=1):
        before = (-_APPROACH_M, 0.0) if j == 1 else (middles[j - 2] - CORNER_M, 0.0)
        come = "entrance" if j == 1 else f"n{j - 1}"
        found[come, f"n{j}"] = before, (x - CORNER_M, 0.0)
        found[f"n{j}", f"a{j}"] = _corner(x - CORNER_M, -CORNER_M, math.pi / 2.0)
        found[f"a{j}", f"b{j}"] = (x, -CORNER_M), (x, CORNER_M - south)
        found[f"b{j}", f"s{j}"] = _corner(x - CORNER_M, CORNER_M - south, 0.0)
        after = (-_APPROACH_M, -south) if j == 1 else (middles[j - 2] - CORNER_M, -south)
        found[f"s{j}", "exit" if j == 1 else f"s{j - 1}"] = (x - CORNER_M, -south), after
    return [
        Lane(
            way_id(start, end),
            Polyline.of(centre),
            AISLE_M,
            LIMIT_MPS,
            kind="aisle",
            successors=tuple(way_id(*other) for other in found if other[0] == end),
            turn="straight" if len(centre) == 2 else "right",
        )
        for (start, end), centre in found.items()
    ]


def _corner(x: float, y: float, phase: float) -> Points:
    """A quarter of a circle about a point, driven to the right."""
    count = round(math.pi / 2.0 / _ARC_STEP_RAD)
    angles = [phase - math.pi / 2.0 * i / count for i in range(count + 1)]
    return tuple((x + CORNER_M * math.cos(a), y + CORNER_M * math.sin(a)) for a in angles)


def _spot_lane(spot: Spot, taken: bool) -> Lane:
    half = spot.box.length_m / 2.0
    c, s = math.cos(spot.box.heading_rad), math.sin(spot.box.heading_rad)
    x, y = spot.box.x_m, spot.box.y_m
    ends = (x - c * half, y - s * half), (x + c * half, y + s * half)
    return Lane(spot.lane, Polyline.of(ends), spot.box.width_m, LIMIT_MPS, kind="parking", closed=taken)
