"""Situation descriptor of highway worlds: what a driver there would say of the road in two breaths."""

from __future__ import annotations

from chauffeur.concept import Context, Observation
from chauffeur.describe.road import (
    ego_lane,
    front_sentence,
    limit_sentence,
    ordinal,
    situation_of,
    speed_sentence,
)


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
