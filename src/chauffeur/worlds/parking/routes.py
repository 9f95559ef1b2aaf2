"""Ways through a lot, for the rear axle of a car: onto a spot, or out.

To a spot: along the drive, round the corner into its aisle, along that aisle's far side, and onto the spot's middle
line on a circle. The circles are wider than the car's turning circle, and the far side of the aisle is what lets a car
clear its neighbours in one turn (0.5 m are left at every spot, tests/worlds/test_parking_lot.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from chauffeur.geometry import LaneId, Polyline, Pose, joined, wrap_to_pi
from chauffeur.worlds.parking.lot import AISLE_M, CORNER_M, Lot, Points, Spot, nodes_of

TURN_M: Final = 5.4
"""Radius onto a spot."""
ASIDE_M: Final = 1.1
"""Offset from the aisle's middle, away from the spot, at which its far side is driven."""
SPOT_ROOM_M: Final = 0.15
"""How far beside the way onto a spot the rear axle may be: a third of what is left at the neighbours."""
_SHORT_M: Final = 0.5
"""Distance before the end of the lanes at which the front bumper stops."""
_STEP_M: Final = 0.25
_SHIFT_M: Final = 8.0
"""Way over which a car that is in the aisle already gets to its far side."""
_JOINED_M: Final = 2.0
_ALONG_RAD: Final = math.radians(35.0)


@dataclass(frozen=True, slots=True)
class Way:
    """A way of the rear axle.

    Attributes:
        path: What to follow; it ends where the rear axle is to stop.
        room_m: How far beside the path the car may be, given what stands there.
    """

    path: Polyline
    room_m: float


def way_to_spot(lot: Lot, spot: Spot, rear: Pose, wheelbase_m: float) -> Way | None:
    """The way onto a spot, forwards; None where none is left from here (the lot is one-way and has no way round).

    Args:
        lot: The ground.
        spot: Where to park.
        rear: Where the rear axle is.
        wheelbase_m: The car's; its axles are as far from its ends.
    """
    middle = lot.aisle_x_m(spot.aisle)
    heading = spot.box.heading_rad
    turn = wrap_to_pi(heading + math.pi / 2.0)
    x = middle - math.copysign(ASIDE_M, math.cos(heading))
    axis = spot.box
    onto_y = axis.y_m + (x - axis.x_m) * math.tan(heading)  # where the aisle's far side meets the spot's middle line
    start_y = onto_y + TURN_M * math.tan(abs(turn) / 2.0)
    in_aisle = abs(rear.x_m - middle) < AISLE_M / 2.0 and rear.y_m < -CORNER_M / 2.0
    if in_aisle and abs(wrap_to_pi(rear.heading_rad + math.pi / 2.0)) < _ALONG_RAD:
        before = _shift(rear, x, start_y)
    elif rear.x_m < x - CORNER_M + _JOINED_M and abs(rear.y_m) < AISLE_M / 2.0:
        corner = _arc(x - CORNER_M, -CORNER_M, CORNER_M, math.pi / 2.0, -math.pi / 2.0)
        before = ((min(rear.x_m, x - CORNER_M) - _JOINED_M, 0.0), *corner)
    else:
        before = None
    if before is None:
        return None
    side = math.copysign(1.0, turn)
    onto = _arc(x + side * TURN_M, start_y, TURN_M, math.pi if side > 0.0 else 0.0, turn)
    end = axis.x_m - math.cos(heading) * wheelbase_m / 2.0, axis.y_m - math.sin(heading) * wheelbase_m / 2.0
    return Way(Polyline.of((*before, *onto, end)), SPOT_ROOM_M)


def way_along(lot: Lot, lane: LaneId, overhang_m: float) -> Way:
    """The way on from a lane, straight on where there is a choice, to where the lanes end and the bumper is to stop."""
    lanes = [lot.road[lane]]
    while onward := lot.road.successors(lanes[-1].id):
        kind = nodes_of(lanes[-1].id)[0][0]
        lanes.append(next((one for one in onward if nodes_of(one.id)[1][0] == kind), onward[0]))
    whole = joined([one.centre for one in lanes])
    end = whole.length_m - overhang_m - _SHORT_M
    kept = [point for point, at in zip(whole.points_m, whole.stations_m, strict=True) if at < end]
    last = whole.at(end)
    return Way(Polyline.of([*kept, (last.x_m, last.y_m)]), (AISLE_M - 2.0) / 2.0)


def _arc(x: float, y: float, radius: float, phase: float, turn: float) -> Points:
    """An arc about a point: from a phase, through an angle."""
    count = max(2, math.ceil(abs(turn) * radius / _STEP_M))
    angles = [phase + turn * i / count for i in range(count + 1)]
    return tuple((x + radius * math.cos(a), y + radius * math.sin(a)) for a in angles)


def _shift(rear: Pose, x: float, before_y: float) -> Points | None:
    """From where the car is in an aisle to its far side; None where that comes too late for the turn."""
    off = x - rear.x_m
    needed = _SHIFT_M * min(1.0, math.sqrt(abs(off) / ASIDE_M)) if abs(off) > 0.1 else 0.5
    if rear.y_m - needed < before_y:
        return None
    steps = 16
    shares = [i / steps for i in range(steps + 1)]
    return tuple((rear.x_m + off * (3.0 * u**2 - 2.0 * u**3), rear.y_m - needed * u) for u in shares)
