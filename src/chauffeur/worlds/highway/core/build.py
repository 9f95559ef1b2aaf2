"""From highway-env's objects, as a scene spawns them, to arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import LaneId
from chauffeur.worlds.highway.core import layout as at
from chauffeur.worlds.highway.roads import Scene
from chauffeur.worlds.highway.traffic import CircularLane, IDMVehicle, KinematicEgo, SineLane, StopSign

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class RoadMap:
    """A road as arrays (layout.py); nothing in it changes while driving.

    Attributes:
        lane_ids: Names of the lanes, in the rows' order.
        rows: Row of each lane.
        lanes: (lanes, LANE_FLOATS).
        traits: (lanes, LANE_INTS).
        roads: (roads, ROAD_INTS).
        road_rows: Row of each (from, to).
    """

    lane_ids: tuple[LaneId, ...]
    rows: dict[LaneId, int]
    lanes: Floats
    traits: Ints
    roads: Ints
    road_rows: dict[tuple[str, str], int]


def map_network(network: Any) -> RoadMap:
    """Arrays of a highway-env road network."""
    found: dict[LaneId, Any] = {
        (str(start), str(end), i): lane
        for start, ends in network.graph.items()
        for end, lanes in ends.items()
        for i, lane in enumerate(lanes)
    }
    ids = tuple(found)
    pairs = list(dict.fromkeys((start, end) for start, end, _ in ids))
    nodes = {name: k for k, name in enumerate(dict.fromkeys(n for pair in pairs for n in pair))}
    road_rows = {pair: k for k, pair in enumerate(pairs)}
    roads = np.zeros((len(pairs), at.ROAD_INTS), dtype=np.int64)
    for k, (start, end) in enumerate(pairs):
        onward = [road_rows[end, to] for to in network.graph.get(end, {})]
        roads[k, at.FROM], roads[k, at.TO] = nodes[start], nodes[end]
        roads[k, at.FIRST] = ids.index((start, end, 0))
        roads[k, at.COUNT] = len(network.graph[start][end])
        roads[k, at.EXITS] = len(onward)
        roads[k, at.EXIT : at.EXIT + len(onward)] = onward
    lanes = np.zeros((len(ids), at.LANE_FLOATS))
    traits = np.zeros((len(ids), at.LANE_INTS), dtype=np.int64)
    for k, (name, lane) in enumerate(found.items()):
        _lane_row(lanes[k], traits[k], lane)
        traits[k, at.ROAD], traits[k, at.INDEX] = road_rows[name[0], name[1]], name[2]
    return RoadMap(ids, {name: k for k, name in enumerate(ids)}, lanes, traits, roads, road_rows)


def _lane_row(numbers: Floats, traits: Ints, lane: Any) -> None:
    numbers[at.LANE_LENGTH], numbers[at.LANE_WIDTH], numbers[at.LIMIT] = lane.length, lane.width, lane.speed_limit
    traits[at.FORBIDDEN], traits[at.PRIORITY] = int(lane.forbidden), int(lane.priority)
    if isinstance(lane, CircularLane):
        traits[at.SHAPE] = at.ARC
        numbers[at.START_X], numbers[at.START_Y] = lane.center
        numbers[at.RADIUS], numbers[at.START_PHASE] = lane.radius, lane.start_phase
        numbers[at.TURN_SIGN] = lane.direction
        return
    traits[at.SHAPE] = at.STRAIGHT
    numbers[at.START_X], numbers[at.START_Y] = lane.start
    numbers[at.DIRECTION_X], numbers[at.DIRECTION_Y] = lane.direction
    numbers[at.LANE_HEADING] = lane.heading
    if isinstance(lane, SineLane):
        traits[at.SHAPE] = at.SINE
        numbers[at.AMPLITUDE], numbers[at.PULSATION], numbers[at.PHASE] = lane.amplitude, lane.pulsation, lane.phase


def place_entities(scene: Scene, road: RoadMap) -> tuple[Floats, Ints, Ints]:
    """Entities of a scene just built, the ego in row 0 whether it has entered or not, and the scene's own numbers."""
    traffic = [v for v in scene.road.vehicles if v is not scene.ego]
    entities = [scene.ego, *traffic, *scene.road.objects]
    floats = np.zeros((len(entities), at.ENTITY_FLOATS))
    ints = np.zeros((len(entities), at.ENTITY_INTS), dtype=np.int64)
    for k, entity in enumerate(entities):
        _entity_row(floats[k], ints[k], entity, road)
    numbers = np.zeros(at.SCENE_INTS, dtype=np.int64)
    numbers[at.VEHICLES], numbers[at.ENTITIES] = 1 + len(traffic), len(entities)
    numbers[at.PARALLEL] = int(bool(np.all(road.traits[:, at.SHAPE] != at.ARC)))
    numbers[at.REGULATED] = int(scene.kind == "intersection")
    numbers[at.DYNAMIC_EGO] = int(not isinstance(scene.ego, KinematicEgo))
    numbers[at.EGO_PRESENT] = int(scene.alone_steps == 0)
    return floats, ints, numbers


def _entity_row(numbers: Floats, traits: Ints, entity: Any, road: RoadMap) -> None:
    start, end, index = entity.lane_index
    numbers[at.X], numbers[at.Y] = entity.position
    numbers[at.HEADING], numbers[at.SPEED] = entity.heading, entity.speed
    numbers[at.LENGTH], numbers[at.WIDTH] = entity.LENGTH, entity.WIDTH
    traits[at.LANE] = road.rows[str(start), str(end), int(index)]
    traits[at.TARGET_LANE] = traits[at.LANE]
    traits[at.KIND] = at.EGO_KIND
    driver: Any = entity
    if isinstance(entity, IDMVehicle):
        traits[at.KIND] = at.TRAFFIC
        start, end, index = entity.target_lane_index
        traits[at.TARGET_LANE] = road.rows[str(start), str(end), int(index)]
        numbers[at.TARGET_SPEED], numbers[at.EXPONENT] = driver.target_speed, driver.DELTA
        numbers[at.TIMER] = driver.timer
        for leg in driver.route or ():
            traits[at.ROUTE + traits[at.ROUTE_END]] = road.road_rows[str(leg[0]), str(leg[1])]
            traits[at.ROUTE_END] += 1
    elif not hasattr(entity, "action"):
        traits[at.KIND] = at.SIGN if isinstance(entity, StopSign) else at.OBSTACLE
