"""Situation descriptor of towns: lane, limit, who is ahead, the next light and sign, people, and the way."""

from __future__ import annotations

import math
from dataclasses import replace

from chauffeur.concept import Context, Observation, Signal, VehicleState
from chauffeur.concept.sight import states_of
from chauffeur.describe.road import (
    ego_lane,
    front_in_sight,
    front_sentence,
    limit_sentence,
    ordinal,
    own_direction,
    situation_of,
    speed_sentence,
)
from chauffeur.describe.street import street_ahead
from chauffeur.geometry import Pose, turns_ahead, wrap_to_pi

SIGHT_M = 60.0
"""How far ahead lights, signs and people are mentioned."""
NEAR_M = 40.0
"""Vehicles within this are told one by one."""
MOST_VEHICLES = 3
MOST_NUMBERED = 8
"""Road users whose numbers are told."""
_WIDE_M = 8.0


def describe_town(observation: Observation) -> Context:
    """C of a observation of a town.

    Raises:
        ScenarioError: The ego is on no lane of the town.
    """
    lane = ego_lane(observation)
    lanes = [one for one in own_direction(observation) if not one.emergency]  # a town's are the strip along the kerb
    route = () if observation.route is None else observation.route.lanes
    turns = turns_ahead(observation.road, lane.id, route)
    scene = (("road", f"This is {lane.street}."),) if lane.street else ()
    situation = replace(situation_of(observation, turns), lane_count=len(lanes), emergency_lane=False, scene=scene)
    where = "crossing a junction" if lane.junction else f"in the {ordinal(situation.lane_index + 1)} lane from the left"
    of_street = f" of {lane.street}" if lane.street else ""
    of = "" if lane.junction else f" of {len(lanes)}"
    sentences = [
        speed_sentence(observation),
        f"I am in a town, {where}{of}{of_street}.",
        limit_sentence(lane),
        front_sentence(front_in_sight(observation)),
        *_vehicles(observation),
        *_lights(observation),
        *_people(observation),
        *_numbered(observation),
    ]
    if observation.stop_sign_m is not None and observation.stop_sign_m < SIGHT_M:
        sentences.append(f"A stop sign is {observation.stop_sign_m:.0f} m ahead.")
    if turns:
        sentences.append(f"At the next junction I can go {' or '.join(turns)}.")
    street = None if lane.junction else street_ahead(observation)
    return Context(text=" ".join(sentences), situation=situation, street=street)


def _vehicles(observation: Observation) -> list[str]:
    """The nearest vehicles ahead and beside, in the words of the paper's example (Sec. IV-D): distance, speed, angle
    off the ego's heading and between both headings, degrees to the left positive."""
    own = observation.ego
    ego = Pose(own.x_m, own.y_m, own.heading_rad)
    found: list[tuple[float, str]] = []
    for one in observation.others:
        forward, leftward = ego.sees(one.x_m, one.y_m)
        away = math.hypot(forward, leftward)
        if one.kind == "pedestrian" or away > NEAR_M or forward < -own.length_m:
            continue
        angle = math.degrees(math.atan2(leftward, forward))
        between = math.degrees(wrap_to_pi(one.heading_rad - own.heading_rad))
        what = "vehicle" if one.kind == "car" else "thing" if one.kind in ("static", "obstacle") else one.kind
        text = (
            f"There is a {what} at a distance of {away:.1f} m. It is moving at a speed of {one.speed_mps:.1f} m/s. "
            f"It is at an angle of {angle:.1f} degrees. The angle between the headings is {between:.1f} degrees."
        )
        found.append((away, text))
    return [text for _, text in sorted(found)[:MOST_VEHICLES]]


def _numbered(observation: Observation) -> list[str]:
    """The nearest road users by the number under which programs name them (`agent(17)`)."""
    own = observation.ego
    ego = Pose(own.x_m, own.y_m, own.heading_rad)
    found: list[tuple[float, str]] = []
    for one in observation.others:
        forward, leftward = ego.sees(one.x_m, one.y_m)
        away = math.hypot(forward, leftward)
        if away > SIGHT_M or forward < -own.length_m:
            continue
        words = " ".join(part for part in (_spoken_state(one, observation), one.colour or "", one.kind) if part)
        found.append((away, f"{one.id} {words}, {away:.0f} m"))
    named = "; ".join(text for _, text in sorted(found)[:MOST_NUMBERED])
    return [f"Road users by number: {named}."] if named else []


def _spoken_state(agent: VehicleState, observation: Observation) -> str:
    states = states_of(agent, observation)
    return next((state for state in ("parked", "oncoming", "crossing", "turning", "moving") if state in states), "")


def own_signals(observation: Observation) -> list[Signal]:
    """Traffic lights of the ego's lane and of those it leads into."""
    lane = ego_lane(observation)
    ahead = {one.id for one, _ in zip(observation.road.ahead(lane.id), range(4), strict=False)}
    return [one for one in observation.signals if ahead & set(one.lanes)]


def _lights(observation: Observation) -> list[str]:
    nearest = min(own_signals(observation), key=lambda one: _away(observation, one), default=None)
    if nearest is None or _away(observation, nearest) > SIGHT_M:
        return []
    return [f"The traffic light {_away(observation, nearest):.0f} m ahead is {nearest.state}."]


def _away(observation: Observation, signal: Signal) -> float:
    (ax, ay), (bx, by) = signal.stop_line_m
    return math.dist((observation.ego.x_m, observation.ego.y_m), ((ax + bx) / 2.0, (ay + by) / 2.0))


def _people(observation: Observation) -> list[str]:
    ego = Pose(observation.ego.x_m, observation.ego.y_m, observation.ego.heading_rad)

    def seen(one: VehicleState) -> tuple[float, float]:
        return ego.sees(one.x_m, one.y_m)

    near = [one for one in observation.others if one.kind == "pedestrian"]
    near = [one for one in near if 0.0 < seen(one)[0] < SIGHT_M and abs(seen(one)[1]) < _WIDE_M]
    if not near:
        return []
    nearest = min(seen(one)[0] for one in near)
    who = "Somebody is" if len(near) == 1 else f"{len(near)} people are"
    return [f"{who} on foot near my way, the nearest {nearest:.0f} m ahead."]
