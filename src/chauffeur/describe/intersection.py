"""Situation descriptor of intersection worlds: the stop sign ahead and the ways on from there."""

from __future__ import annotations

import math

from chauffeur.concept import Context, LaneView, Snapshot, Turn
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


def allowed_turns(snapshot: Snapshot) -> tuple[Turn, ...]:
    """Ways on from the end of the ego lane, where there is a choice at all; empty inside or past the junction.

    Read from the geometry of the lanes that follow: how far the heading at their end differs from the ego lane's.
    """
    lane = ego_lane(snapshot)
    onward = [other for other in snapshot.lanes if other.id[0] == lane.id[1]]
    if len(onward) < 2:
        return ()
    arriving = _heading(lane)
    found = {_turn(_heading(other) - arriving) for other in onward}
    return tuple(turn for turn in _ORDER if turn in found)


def describe_intersection(snapshot: Snapshot) -> Context:
    """C of an intersection snapshot.

    Raises:
        ScenarioError: The ego is on no lane of the road.
    """
    turns = allowed_turns(snapshot)
    situation = situation_of(snapshot, turns)
    sentences = [speed_sentence(snapshot)]
    if turns:
        sentences.append("I am coming to an intersection on a two-way road with one lane per direction.")
    else:
        sentences.append("I am at an intersection of two-way roads with one lane per direction.")
    if snapshot.stop_sign_m is not None:
        # LaMPilot's fixed text says 90 m; the ego really starts 85 m away, and the number shrinks as it drives.
        sentences.append(
            f"A stop sign stands {snapshot.stop_sign_m:.0f} m ahead of me; the autopilot stops there by itself. "
            "I may recover from the stop only once my speed is below 1 m/s and only when crossing is safe."
        )
    if turns:
        ways = [_WORDS[turn] for turn in turns]
        choice = ways[0] if len(ways) == 1 else f"{', '.join(ways[:-1])} or {ways[-1]}"
        sentences.append(f"At the intersection I may {choice}; the route has to be chosen before I get there.")
    sentences += [limit_sentence(ego_lane(snapshot)), front_sentence(situation.front)]
    return Context(text=" ".join(sentences), situation=situation)


def _heading(lane: LaneView) -> float:
    """Heading at the end of a lane, rad."""
    (x0, y0), (x1, y1) = lane.centre_m[-2:]
    return math.atan2(y1 - y0, x1 - x0)


def _turn(change_rad: float) -> Turn | None:
    """Highway worlds have y to the right of +x, so a growing angle is a turn to the right."""
    change = math.remainder(change_rad, math.tau)
    if abs(change) < _STRAIGHT_RAD:
        return "straight"
    if abs(change) > _BACK_RAD:
        return None
    return "right" if change > 0 else "left"
