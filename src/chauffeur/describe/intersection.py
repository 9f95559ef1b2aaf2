"""Situation descriptor of intersection worlds: the stop sign ahead and the ways on from there."""

from __future__ import annotations

import math

from chauffeur.concept import Context, Observation, Turn
from chauffeur.describe.road import (
    ego_lane,
    front_sentence,
    limit_sentence,
    situation_of,
    speed_sentence,
)

_STRAIGHT_RAD = math.radians(30.0)
_BACK_RAD = math.radians(150.0)
_ORDER: tuple[Turn, ...] = ("left", "straight", "right")
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
