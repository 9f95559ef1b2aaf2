"""What the driving APIs answer, as far as it is known without asking: what it is about, and what it depends on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from chauffeur.safety.faithfulness.values import NOTHING, LaneValue, TracedValue, of

_STEPS: Final = {"get_left_lane": -1, "get_right_lane": 1}
_CROSSING: Final = {
    "get_left_to_right_cross_traffic_lanes": "left",
    "get_right_to_left_cross_traffic_lanes": "right",
}


def answer(name: str, asked: Sequence[TracedValue], at: frozenset[int]) -> TracedValue:
    """The answer of an API that only asks.

    Args:
        name: The API.
        asked: Its arguments in order; NOTHING for one that is left out or not known.
        at: Lanes the ego may have moved to the right since the start.
    """
    first = asked[0] if asked else NOTHING
    if name == "get_ego_vehicle":
        return TracedValue(vehicle="ego")
    if name in _STEPS:
        return _lane(_STEPS[name], at) if first.vehicle in ("", "ego") else TracedValue(tags=first.tags)
    if name == "get_lane_of":
        return _lane(0, at) if first.vehicle in ("", "ego") else TracedValue(lanes=first.lanes, tags=first.tags)
    if name in _CROSSING:
        return TracedValue(crossing=_CROSSING[name])
    if name == "is_safe_enter":
        return TracedValue(tags=frozenset(_safe(first)))
    if name in ("detect_front_vehicle_in", "detect_rear_vehicle_in"):
        vehicle = "front" if "front" in name else "rear"
        lanes = first.lanes or (frozenset() if first.crossing else _lane(0, at).lanes)
        return TracedValue(vehicle=vehicle, tags=frozenset({vehicle}), lanes=lanes)
    if name == "get_speed_of":
        return of("ego", "speed") if first.vehicle == "ego" else of("other", "other speed")
    if name == "get_distance_between_vehicles":
        return _distance(first, asked[1])
    if name == "detect_stop_sign_ahead":
        return of("sign", "sign")
    if name == "get_speed_limit":
        return of("limit", "limit")
    if name == "get_target_speed":
        return of("ego", "speed")
    return of("headway", "headway") if name == "get_desired_time_headway" else NOTHING


def _lane(offset: int, at: frozenset[int]) -> TracedValue:
    return TracedValue(lanes=frozenset({LaneValue(offset, at)}))


def _safe(lane: TracedValue) -> set[str]:
    if lane.crossing:
        return {"safe:cross", f"safe:cross:{lane.crossing}"}
    return {f"safe:{one.offset}" for one in lane.lanes} or {"safe:?"}


def _distance(one: TracedValue, other: TracedValue) -> TracedValue:
    match one.vehicle, other.vehicle:
        case "front", "ego":
            return of("gap", "gap")
        case "ego", "front":
            return of("past", "past")
        case "ego", "rear":
            return of("behind", "behind")
        case "", "ego":
            return of("gap", "gap")
        case "ego", "":
            return of("past", "past")
        case _:
            return NOTHING
