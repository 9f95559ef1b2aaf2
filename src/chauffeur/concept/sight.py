"""States of a road user at one instant (parked, moving, crossing), derived from geometry and never guessed.

Several hold at once: a bus that turns left before us is moving, turning and maybe oncoming.
"""

from __future__ import annotations

import math
from typing import Final

from chauffeur.concept.scene import Observation, VehicleState
from chauffeur.concept.utterance import State
from chauffeur.geometry import Pose, wrap_to_pi

STANDS_MPS: Final = 0.3
"""Slower than this a road user stands."""
AT_KERB_M: Final = 1.2
"""A vehicle that stands so far off the middle of its lane stands at the kerb."""
_TURNING_RADPS: Final = 0.1
_ACROSS: Final = 0.7
"""Sine of the angle to the ego's heading from which a road user crosses; cosine from which it comes towards it."""
_ON_ROAD_M: Final = 0.3
_NEAR_ROAD_M: Final = 4.0


def states_of(agent: VehicleState, observation: Observation) -> frozenset[State]:
    """The states that hold of a road user at an instant."""
    ego = observation.ego
    turned = wrap_to_pi(agent.heading_rad - ego.heading_rad)
    moves = agent.speed_mps > STANDS_MPS
    if agent.kind == "pedestrian":
        found: set[State] = {"moving", "walking"} if moves else {"stopped", "standing"}
        if moves and _on_carriageway(agent, observation):
            found.add("crossing")
        return frozenset(found)
    if not moves:
        found = {"stopped", "standing"}
        if _at_kerb(agent, observation):
            found.add("parked")
        return frozenset(found)
    found = {"moving"}
    lane = observation.road.get(agent.lane)
    if abs(agent.yaw_rate_radps) > _TURNING_RADPS or (lane is not None and lane.junction and lane.turn != "straight"):
        found.add("turning")
    if math.cos(turned) < -_ACROSS:
        found.add("oncoming")
    if abs(math.sin(turned)) > _ACROSS:
        found.add("crossing")
    return frozenset(found)


def seen_from(ego: VehicleState, agent: VehicleState) -> tuple[float, float]:
    """(forward, leftward), m, of a road user's middle in the ego's frame."""
    return Pose(ego.x_m, ego.y_m, ego.heading_rad).sees(agent.x_m, agent.y_m)


def _at_kerb(agent: VehicleState, observation: Observation) -> bool:
    lane = observation.road.get(agent.lane)
    if lane is None:
        return True
    if lane.kind in ("parking", "emergency"):
        return True
    return not lane.junction and abs(lane.centre.project(agent.x_m, agent.y_m)[1]) > AT_KERB_M


def _on_carriageway(agent: VehicleState, observation: Observation) -> bool:
    place = observation.road.locate(agent.x_m, agent.y_m, None, ("driving",))
    if place is None or abs(place.offset_m) > _NEAR_ROAD_M:
        return False
    return abs(place.offset_m) < observation.road[place.lane].width_m / 2.0 + _ON_ROAD_M
