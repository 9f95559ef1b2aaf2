"""Traffic behind and beside the ego, for planners that read C: what a driver sees in the mirrors before moving over.

The benchmark's own text (`CONTEXT_BENCHMARK`) tells the ego's lane ahead and no more, and stays as its authors have it;
drives for a person add these sentences to it (`CONTEXT_DRIVE`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from chauffeur.concept import Context, Snapshot, VehicleState
from chauffeur.describe.dispatch import describe
from chauffeur.describe.road import SIGHT_M, ego_lane, own_direction

CONTEXT_BENCHMARK: Final = "context-v1"
CONTEXT_DRIVE: Final = "context-v2"


def describe_with_traffic(snapshot: Snapshot) -> Context:
    """C of a snapshot with the traffic behind and beside the ego; on roads without parallel lanes as `describe`.

    Raises:
        ScenarioError: As `describe`.
    """
    context = describe(snapshot)
    if snapshot.kind != "highway":
        return context
    return replace(context, text=" ".join((context.text, *traffic_sentences(snapshot))))


def traffic_sentences(snapshot: Snapshot) -> tuple[str, ...]:
    """The car behind, then the lane on either side. Distances are along the road, centre to centre.

    Raises:
        ScenarioError: The ego is on no lane of the road.
    """
    lanes = own_direction(snapshot)
    place = lanes.index(ego_lane(snapshot))
    rear = _nearest(_beside(snapshot, 0), ahead=False)
    sentences = [
        f"There is no car behind me in my lane within {SIGHT_M:.0f} m."
        if rear is None
        else f"The car behind me in my lane is {-rear[0]:.1f} m away and drives at {rear[1].speed_mps:.1f} m/s."
    ]
    for side, word in ((-1, "left"), (1, "right")):
        if not 0 <= place + side < len(lanes):
            sentences.append(f"There is no lane on my {word}.")
        elif lanes[place + side].emergency:
            sentences.append(f"On my {word} is the emergency lane.")
        else:
            sentences.append(_lane_sentence(snapshot, side, word))
    return tuple(sentences)


def _lane_sentence(snapshot: Snapshot, side: int, word: str) -> str:
    there = _beside(snapshot, side)
    level = [vehicle for along_m, vehicle in there if abs(along_m) < (vehicle.length_m + snapshot.ego.length_m) / 2.0]
    if level:
        return f"In the lane on my {word} a car is right beside me and drives at {level[0].speed_mps:.1f} m/s."
    told = [
        f"{abs(found[0]):.1f} m {'ahead' if ahead else 'behind'} at {found[1].speed_mps:.1f} m/s"
        for ahead in (True, False)
        if (found := _nearest(there, ahead=ahead)) is not None
    ]
    if not told:
        return f"The lane on my {word} is free of cars for {SIGHT_M:.0f} m ahead and behind."
    cars = "cars are" if len(told) > 1 else "car is"
    return f"In the lane on my {word} the nearest {cars} {' and '.join(told)}."


def _beside(snapshot: Snapshot, side: int) -> list[tuple[float, VehicleState]]:
    """Cars so many lanes to the right of the ego's (negative: left) within sight, with how far ahead each is, in m."""
    ego, lane = snapshot.ego, ego_lane(snapshot)
    cos, sin = math.cos(ego.heading_rad), math.sin(ego.heading_rad)
    found: list[tuple[float, VehicleState]] = []
    for vehicle in snapshot.others:
        dx, dy = vehicle.x_m - ego.x_m, vehicle.y_m - ego.y_m
        along_m, right_m = cos * dx + sin * dy, cos * dy - sin * dx
        same_road = vehicle.lane is not None and vehicle.lane[:2] == lane.id[:2]
        # On another segment of the road lanes are counted anew: there the place beside the ego tells.
        across = vehicle.lane[2] - lane.id[2] if same_road and vehicle.lane else round(right_m / lane.width_m)
        oncoming = math.cos(vehicle.heading_rad - ego.heading_rad) < 0.0
        if across == side and abs(along_m) <= SIGHT_M and not oncoming:
            found.append((along_m, vehicle))
    return found


def _nearest(there: list[tuple[float, VehicleState]], *, ahead: bool) -> tuple[float, VehicleState] | None:
    return min((one for one in there if (one[0] > 0.0) is ahead), key=lambda one: abs(one[0]), default=None)
