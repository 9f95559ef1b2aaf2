"""Descriptors of a road, a crossing, a lot: what a driver there would say, chosen by the observation itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from chauffeur.concept import Context, Observation, ParkingLot, ParkingSpot, ScenarioError, Turn, VehicleState
from chauffeur.describe.road import (
    ego_lane,
    front_in_sight,
    front_sentence,
    limit_sentence,
    ordinal,
    situation_of,
    speed_sentence,
)
from chauffeur.describe.town import describe_town
from chauffeur.describe.track import describe_track
from chauffeur.geometry import Pose

_WORDS: dict[Turn, str] = {"left": "turn left", "straight": "go straight", "right": "turn right"}


def allowed_turns(observation: Observation) -> tuple[Turn, ...]:
    """Ways on from the end of the ego lane, where there is a choice at all; empty inside or past the junction."""
    return observation.road.turns(ego_lane(observation).id)


def describe_intersection(observation: Observation) -> Context:
    """C of an intersection observation.

    Raises:
        ScenarioError: The ego is on no lane of the road.
    """
    turns = allowed_turns(observation)
    situation = situation_of(observation, turns)
    sentences = [speed_sentence(observation)]
    if turns:
        sentences.append("I am coming to an intersection on a two-way road with one lane per direction.")
    else:
        sentences.append("I am at an intersection of two-way roads with one lane per direction.")
    if observation.stop_sign_m is not None:
        # LaMPilot's fixed text says 90 m; the ego really starts 85 m away, and the number shrinks as it drives.
        sentences.append(
            f"A stop sign stands {observation.stop_sign_m:.0f} m ahead of me; the autopilot stops there by itself. "
            "I may recover from the stop only once my speed is below 1 m/s and only when crossing is safe."
        )
    if turns:
        ways = [_WORDS[turn] for turn in turns]
        choice = ways[0] if len(ways) == 1 else f"{', '.join(ways[:-1])} or {ways[-1]}"
        sentences.append(f"At the intersection I may {choice}; the route has to be chosen before I get there.")
    sentences += [limit_sentence(ego_lane(observation)), front_sentence(situation.front)]
    return Context(text=" ".join(sentences), situation=situation)


def describe_parking(observation: Observation) -> Context:
    """C of an observation of a parking lot.

    Raises:
        ScenarioError: The ego is on no lane of the lot.
    """
    situation = situation_of(observation)
    front = front_in_sight(observation)
    ahead = (
        "Nobody is ahead of me in my aisle."
        if front is None
        else f"The car ahead of me is {front.distance_m:.1f} m away and drives at {front.speed_mps:.1f} m/s."
    )
    lot = None if observation.lot is None else _seen_from(observation.ego, observation.lot)
    sentences = [
        speed_sentence(observation),
        f"I am in a parking lot, where {situation.speed_limit_mps:.1f} m/s are allowed.",
        ahead,
        "I can park in the nearest free spot, near the stadium, near the exit, or in a spot by its name, such as A3.",
    ]
    return Context(" ".join(sentences), situation, lot)


def _seen_from(ego: VehicleState, lot: ParkingLot) -> ParkingLot:
    """A lot of the world frame in the ego's."""
    pose = Pose(ego.x_m, ego.y_m, ego.heading_rad)
    spots: list[ParkingSpot] = []
    for spot in lot.spots:
        x, y = pose.sees(spot.x_m, spot.y_m)
        spots.append(replace(spot, x_m=x, y_m=y, heading_rad=spot.heading_rad - ego.heading_rad))
    return ParkingLot(tuple(spots), tuple((name, *pose.sees(x, y)) for name, x, y in lot.landmarks))


def describe_highway(observation: Observation) -> Context:
    """C of a highway observation.

    Only the ego's own lane is described beyond its speed, as in the benchmark; what drives behind and in the other
    lanes is told by `describe_with_traffic`.

    Raises:
        ScenarioError: The ego is on no lane of the road.
    """
    situation = situation_of(observation)
    lanes = situation.lane_count
    count = "1 lane" if lanes == 1 else f"{lanes} lanes"
    place = ordinal(lanes - situation.lane_index)
    sentences = [
        speed_sentence(observation),
        f"I am on a highway with {count} in my direction, in the {place} lane from the right.",
    ]
    if situation.emergency_lane:
        sentences.append("The right-most lane is an emergency lane.")
    sentences += [limit_sentence(ego_lane(observation)), front_sentence(situation.front)]
    return Context(text=" ".join(sentences), situation=situation)


DESCRIPTORS: Mapping[str, Callable[[Observation], Context]] = {
    "highway": describe_highway,
    "intersection": describe_intersection,
    "parking": describe_parking,
    "track": describe_track,
    "street": describe_track,
    "town": describe_town,
}


def describe(observation: Observation) -> Context:
    """C of an observation: the driving context in words for the model and as values for the checks.

    Raises:
        ScenarioError: No descriptor knows this kind of world, or the ego is on no lane.
    """
    descriptor = DESCRIPTORS.get(observation.kind)
    if descriptor is None:
        raise ScenarioError(
            f"No situation descriptor knows a world of kind {observation.kind!r}.",
            hint=f"Known kinds: {', '.join(sorted(DESCRIPTORS))}.",
        )
    return descriptor(observation)
