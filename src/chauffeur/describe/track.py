"""Situation descriptor of the test track and of a street: how fast, what is ahead, which way the road goes."""

from __future__ import annotations

from typing import Final

from chauffeur.concept import Context, Observation, Turn
from chauffeur.describe.road import ego_lane, front_sentence, limit_sentence, situation_of, speed_sentence
from chauffeur.describe.street import street_ahead, street_sentences

_ROADS: Final = {"track": "test track", "street": "street"}


def describe_track(observation: Observation) -> Context:
    """C of an observation of the test track, or of a street of which no more is known.

    Raises:
        ScenarioError: The ego is on no lane.
    """
    street = street_ahead(observation)
    ways = () if street is None else street.ways
    turns: list[Turn] = [way.turn for way in ways if way.bend_m is not None]
    situation = situation_of(observation, tuple(turns) if len(turns) > 1 else ())
    lanes = "2 lanes" if situation.lane_count == 2 else "1 lane"
    sentences = [
        speed_sentence(observation),
        f"I am on a {_ROADS[observation.kind]} with {lanes} in my direction.",
        limit_sentence(ego_lane(observation)),
        front_sentence(situation.front),
        *([] if street is None else street_sentences(street)),
    ]
    return Context(text=" ".join(sentences), situation=situation, street=street)
