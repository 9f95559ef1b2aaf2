"""Traffic behind and beside the ego, for planners that read C: what a driver sees in the mirrors before moving over.

The benchmark's own text (`CONTEXT_BENCHMARK`) tells the ego's lane ahead and no more, and stays as its authors have it;
drives for a person add these sentences to it (`CONTEXT_DRIVE`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from chauffeur.concept import Context, Observation, VehicleState
from chauffeur.describe.dispatch import describe
from chauffeur.describe.road import SIGHT_M, ego_lane, own_direction

CONTEXT_BENCHMARK: Final = "context-v1"
CONTEXT_DRIVE: Final = "context-v2"


def describe_with_traffic(observation: Observation) -> Context:
    """C of an observation with the traffic behind and beside the ego; on roads without parallel lanes as `describe`.

    Raises:
        ScenarioError: As `describe`.
    """
    context = describe(observation)
    if not observation.road.uninterrupted:
        return context
    return replace(context, text=" ".join((context.text, *traffic_sentences(observation))))


def traffic_sentences(observation: Observation) -> tuple[str, ...]:
    """The car behind, then the lane on either side. Distances are along the road, centre to centre.

    Raises:
        ScenarioError: The ego is on no lane of the road.
    """
    lanes = own_direction(observation)
    place = lanes.index(ego_lane(observation))
    rear = _nearest(abreast(observation, 0), ahead=False)
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
            sentences.append(_lane_sentence(observation, side, word))
    return tuple(sentences)


def _lane_sentence(observation: Observation, side: int, word: str) -> str:
    there = abreast(observation, side)
    level = [
        vehicle for along_m, vehicle in there if abs(along_m) < (vehicle.length_m + observation.ego.length_m) / 2.0
    ]
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


def abreast(observation: Observation, side: int) -> list[tuple[float, VehicleState]]:
    """Cars so many lanes to the right of the ego's (negative: left) within sight, with how far ahead each is, in m."""
    ego, lane = observation.ego, ego_lane(observation)
    cos, sin = math.cos(ego.heading_rad), math.sin(ego.heading_rad)
    found: list[tuple[float, VehicleState]] = []
    for vehicle in observation.others:
        dx, dy = vehicle.x_m - ego.x_m, vehicle.y_m - ego.y_m
        along_m, right_m = cos * dx + sin * dy, sin * dx - cos * dy
        there = observation.road.get(vehicle.lane)
        places = None if there is None else observation.road.places_between(lane.id, there.id)
        # On another segment of the road lanes are counted anew: there the place beside the ego tells.
        across = round(right_m / lane.width_m) if places is None else places
        oncoming = math.cos(vehicle.heading_rad - ego.heading_rad) < 0.0
        if across == side and abs(along_m) <= SIGHT_M and not oncoming:
            found.append((along_m, vehicle))
    return found


def _nearest(there: list[tuple[float, VehicleState]], *, ahead: bool) -> tuple[float, VehicleState] | None:
    return min((one for one in there if (one[0] > 0.0) is ahead), key=lambda one: abs(one[0]), default=None)
