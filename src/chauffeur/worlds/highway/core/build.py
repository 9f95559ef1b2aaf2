"""From a scene as it was placed to arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import LaneId
from chauffeur.worlds.highway.core import layout as at
from chauffeur.worlds.highway.network import (
    LANE_WIDTH_M,
    ArcLane,
    HighwayLane,
    LaneKey,
    LaneNetwork,
    SineLane,
    StraightLane,
    lane_id,
)
from chauffeur.worlds.highway.roads import HighwayScene, Spawn

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_KINDS = {"traffic": at.TRAFFIC, "ego": at.EGO_KIND, "obstacle": at.OBSTACLE, "stop_sign": at.SIGN}


@dataclass(frozen=True, slots=True)
class CoreRoadMap:
    """A road as arrays (layout.py); nothing in it changes while driving.

    Attributes:
        keys: The lanes' (from node, to node, index), in the rows' order.
        lane_ids: Their names.
        rows: Row of each lane.
        lanes: (lanes, LANE_FLOATS).
        traits: (lanes, LANE_INTS).
        roads: (roads, ROAD_INTS).
        road_rows: Row of each (from, to).
    """

    keys: tuple[LaneKey, ...]
    lane_ids: tuple[LaneId, ...]
    rows: dict[LaneId, int]
    lanes: Floats
    traits: Ints
    roads: Ints
    road_rows: dict[tuple[str, str], int]


def map_network(network: LaneNetwork) -> CoreRoadMap:
    """A road's lanes as arrays."""
    found = network.lanes()
    keys = tuple(found)
    ids = tuple(map(lane_id, keys))
    pairs = list(dict.fromkeys((start, end) for start, end, _ in keys))
    nodes = {name: k for k, name in enumerate(dict.fromkeys(n for pair in pairs for n in pair))}
    road_rows = {pair: k for k, pair in enumerate(pairs)}
    roads = np.zeros((len(pairs), at.ROAD_INTS), dtype=np.int64)
    for k, (start, end) in enumerate(pairs):
        onward = [road_rows[end, to] for to in network.graph.get(end, {})]
        roads[k, at.FROM], roads[k, at.TO] = nodes[start], nodes[end]
        roads[k, at.FIRST] = keys.index((start, end, 0))
        roads[k, at.COUNT] = len(network.graph[start][end])
        roads[k, at.EXITS] = len(onward)
        roads[k, at.EXIT : at.EXIT + len(onward)] = onward
    lanes = np.zeros((len(keys), at.LANE_FLOATS))
    traits = np.zeros((len(keys), at.LANE_INTS), dtype=np.int64)
    for k, (name, lane) in enumerate(found.items()):
        _lane_row(lanes[k], traits[k], lane)
        traits[k, at.ROAD], traits[k, at.INDEX] = road_rows[name[0], name[1]], name[2]
    return CoreRoadMap(keys, ids, {name: k for k, name in enumerate(ids)}, lanes, traits, roads, road_rows)


def _lane_row(numbers: Floats, traits: Ints, lane: HighwayLane) -> None:
    numbers[at.LANE_LENGTH], numbers[at.LANE_WIDTH], numbers[at.LIMIT] = lane.length, LANE_WIDTH_M, lane.speed_limit
    traits[at.FORBIDDEN], traits[at.PRIORITY] = int(lane.forbidden), lane.priority
    if isinstance(lane, ArcLane):
        traits[at.SHAPE] = at.ARC
        numbers[at.START_X], numbers[at.START_Y] = lane.centre
        numbers[at.RADIUS], numbers[at.START_PHASE] = lane.radius, lane.start_phase
        numbers[at.TURN_SIGN] = lane.turn_sign
        return
    assert isinstance(lane, StraightLane)
    traits[at.SHAPE] = at.STRAIGHT
    numbers[at.START_X], numbers[at.START_Y] = lane.start
    numbers[at.DIRECTION_X], numbers[at.DIRECTION_Y] = lane.direction
    numbers[at.LANE_HEADING] = lane.heading
    if isinstance(lane, SineLane):
        traits[at.SHAPE] = at.SINE
        numbers[at.AMPLITUDE], numbers[at.PULSATION], numbers[at.PHASE] = lane.amplitude, lane.pulsation, lane.phase


def place_entities(scene: HighwayScene, road: CoreRoadMap) -> tuple[Floats, Ints, Ints]:
    """Entities of a scene just built, the ego in row 0 whether it has entered or not, and the scene's own numbers."""
    entities = [scene.ego, *scene.traffic, *scene.objects]
    floats = np.zeros((len(entities), at.ENTITY_FLOATS))
    ints = np.zeros((len(entities), at.ENTITY_INTS), dtype=np.int64)
    for k, entity in enumerate(entities):
        _entity_row(floats[k], ints[k], entity, road)
    numbers = np.zeros(at.SCENE_INTS, dtype=np.int64)
    numbers[at.VEHICLES], numbers[at.ENTITIES] = 1 + len(scene.traffic), len(entities)
    numbers[at.PARALLEL] = int(bool(np.all(road.traits[:, at.SHAPE] != at.ARC)))
    numbers[at.REGULATED] = numbers[at.DYNAMIC_EGO] = int(scene.kind == "intersection")
    numbers[at.EGO_PRESENT] = int(scene.alone_steps == 0)
    return floats, ints, numbers


def _entity_row(numbers: Floats, traits: Ints, entity: Spawn, road: CoreRoadMap) -> None:
    numbers[at.X], numbers[at.Y] = entity.position
    numbers[at.HEADING], numbers[at.SPEED] = entity.heading_rad, entity.speed_mps
    numbers[at.LENGTH], numbers[at.WIDTH] = entity.size_m
    traits[at.LANE] = traits[at.TARGET_LANE] = road.rows[lane_id(entity.lane)]
    traits[at.KIND] = _KINDS[entity.kind]
    if entity.kind != "traffic":
        return
    numbers[at.TARGET_SPEED], numbers[at.EXPONENT] = entity.speed_mps, entity.exponent
    numbers[at.TIMER] = entity.timer_s
    legs = [road.road_rows[leg] for leg in entity.route]
    traits[at.ROUTE : at.ROUTE + len(legs)] = legs
    traits[at.ROUTE_END] = len(legs)
