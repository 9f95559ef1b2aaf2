"""Where the ego is on the road, read from an observation; and the few words every descriptor shares."""

from __future__ import annotations

from chauffeur.concept import Lane, Lead, Observation, ScenarioError, Situation, Turn

SIGHT_M = 100.0
"""How far ahead a vehicle is mentioned: the range of the benchmark's own text."""

_DRIVEN = frozenset({"driving", "emergency", "aisle"})
_ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")


def ego_lane(observation: Observation) -> Lane:
    """The lane the ego is in.

    Raises:
        ScenarioError: The observation says no lane, or one that its road does not have.
    """
    lane = observation.road.get(observation.ego.lane)
    if lane is not None:
        return lane
    raise ScenarioError(
        f"The situation cannot be described: the ego is on lane {observation.ego.lane}, which is not among the "
        f"{len(observation.road.lanes)} lanes of the road.",
        hint="The world must name the ego's closest lane in every observation.",
    )


def own_direction(observation: Observation) -> tuple[Lane, ...]:
    """Lanes of the ego's road segment and direction, leftmost first; the emergency lane is one of them.

    Pavements and what else no car drives on are none of them.
    """
    own = ego_lane(observation)
    return tuple(one for one in observation.road.abreast(own.id) if one is own or one.kind in _DRIVEN)


def front_in_sight(observation: Observation) -> Lead | None:
    """The vehicle ahead in the ego lane, if it is within sight."""
    front = observation.front
    return front if front is not None and front.distance_m <= SIGHT_M else None


def situation_of(observation: Observation, turns: tuple[Turn, ...] = ()) -> Situation:
    """C as values. Raises ScenarioError if the ego is on no lane of the road."""
    lane, lanes = ego_lane(observation), own_direction(observation)
    return Situation(
        world=observation.kind,
        speed_mps=observation.ego.speed_mps,
        speed_limit_mps=lane.speed_limit_mps,
        lane_count=len(lanes),
        lane_index=lanes.index(lane),
        emergency_lane=lanes[-1].emergency,
        front=front_in_sight(observation),
        stop_sign_m=observation.stop_sign_m,
        turns=turns,
    )


def ordinal(number: int) -> str:
    """1 -> `first`, ..., 11 -> `11th`."""
    if number <= len(_ORDINALS):
        return _ORDINALS[number - 1]
    suffix = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{suffix}"


def speed_sentence(observation: Observation) -> str:
    """The ego's speed in words."""
    return f"I am driving at {observation.ego.speed_mps:.1f} m/s."


def front_sentence(front: Lead | None) -> str:
    """The car ahead in words. Distances are centre to centre, as the driving APIs measure them."""
    if front is None:
        return f"There is no car ahead of me in my lane within {SIGHT_M:.0f} m."
    return f"The car ahead of me in my lane is {front.distance_m:.1f} m away and drives at {front.speed_mps:.1f} m/s."


def limit_sentence(lane: Lane) -> str:
    """The speed limit of the ego lane in words."""
    return f"The speed limit of my lane is {lane.speed_limit_mps:.1f} m/s."
