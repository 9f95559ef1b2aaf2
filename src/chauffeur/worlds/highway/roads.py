"""LaMPilot's three roads: ramp merge, multi-lane highway with an emergency lane, four-way intersection.

Geometry and spawning rules are LaMPilot's (`ramp-merge-v0`, `dt-highway-v0`, `dt-intersection-v0`, DbLv1), so that a
sample and a seed start from the same traffic. Draws from the random generator stand in LaMPilot's order, those whose
result is not used included.
"""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from chauffeur.concept import LaneId, RoadGraph, ScenarioError
from chauffeur.control import LAMPILOT_HIGHWAY, LAMPILOT_INTERSECTION, Actuation
from chauffeur.geometry import Lane as GraphLane
from chauffeur.geometry import Polyline
from chauffeur.geometry.road_graph import turn_of
from chauffeur.worlds.highway.network import (
    LANE_WIDTH_M,
    ArcLane,
    FloatArray,
    HighwayLane,
    LaneKey,
    LaneNetwork,
    SineLane,
    StraightLane,
    lane_id,
)

DT_S = 0.1
HIGHWAY_LIMIT_MPS = 31.2928  # 70 mph
RAMP_LIMIT_MPS = 24.5872  # 55 mph
_CLEAR_M = 20.0
_JOINT_M = 0.5
"""Distance from a lane's end within which other lanes' starts continue it."""
_CAR_M = (5.0, 2.0)
_OBSTACLE_M = (2.0, 2.0)
_EXPONENTS = (3.5, 4.5)
"""IDM's exponent differs from driver to driver, drawn between these (highway-env's `DELTA_RANGE`)."""


class EgoConfig(BaseModel):
    """Start of the ego on a highway. speed m/s; start_position (longitudinal, lateral) m."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    speed: float = 20.0
    start_lane_index: tuple[str, str, int]
    start_position: tuple[float, float]


class RoadConfig(BaseModel):
    """LaMPilot's `env` mapping. Fields of other road kinds are accepted and ignored, as LaMPilot does.

    `redraw_unfit` is ours: traffic is drawn again where it begins with cars in each other (`fitness.fit_to_begin`).
    LaMPilot drives such draws as they are.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    type: str
    vehicles_count: int = Field(default=20, ge=0, le=500)
    vehicles_density: float = Field(default=1.0, gt=0)
    stage_length: tuple[float, ...] = ()
    num_lanes: int = Field(default=5, ge=2, le=12)
    emergency_lane: bool = True
    ego_vehicle: EgoConfig | None = None
    num_vehicles_left: int = Field(default=5, ge=0, le=100)
    num_vehicles_right: int = Field(default=5, ge=0, le=100)
    spawn_probability_left: float = Field(default=1.0, ge=0, le=1)
    spawn_probability_right: float = Field(default=1.0, ge=0, le=1)
    position_deviation_left: float = 0.1
    position_deviation_right: float = 0.1
    speed_deviation_left: float = 0.5
    speed_deviation_right: float = 0.5
    redraw_unfit: bool = False


@dataclass(slots=True)
class Spawn:
    """A vehicle or object where it enters the scene.

    Attributes:
        kind: What it is.
        position: (x, y), m.
        heading_rad, speed_mps: Its own.
        lane: Closest lane.
        size_m: (length, width).
        exponent: IDM's delta of a car of the traffic.
        timer_s: How long ago a car of the traffic last looked for a lane change.
        route: Roads it takes, for a car of the traffic that has a goal.
    """

    kind: Literal["ego", "traffic", "obstacle", "stop_sign"]
    position: FloatArray
    heading_rad: float
    speed_mps: float
    lane: LaneKey
    size_m: tuple[float, float] = _CAR_M
    exponent: float = 0.0
    timer_s: float = 0.0
    route: tuple[tuple[str, str], ...] = ()


@dataclass(slots=True)
class HighwayScene:
    """A road with its traffic, ready to be stepped.

    Attributes:
        kind: `highway` or `intersection`.
        network: The lanes.
        ego: The ego.
        traffic: All other vehicles, in the order in which they were placed.
        objects: Obstacles and signs.
        emergency_lanes: Lanes for cars in distress only.
        actuation: Full-scale pedal and wheel values.
        alone_steps: Steps of the traffic before the ego enters; 0 where it is there from the start.
        warm_up_steps: Steps with neutral controls before the trip begins.
        duration_s: Time limit of the environment, warm-up included.
        bounds: (min x, max x, min y): leaving them ends the trip.
    """

    kind: Literal["highway", "intersection"]
    network: LaneNetwork
    ego: Spawn
    traffic: list[Spawn]
    objects: list[Spawn]
    actuation: Actuation
    warm_up_steps: int
    duration_s: float
    bounds: tuple[float, float, float]
    alone_steps: int = 0
    emergency_lanes: frozenset[LaneId] = field(default_factory=frozenset[LaneId])


def road_graph(network: Mapping[LaneKey, HighwayLane], emergency: Container[LaneId]) -> RoadGraph:
    """The road as the graph of its lanes, which has y to the left of +x; the network has it to the right."""
    ends = {key: (lane.position(0.0, 0.0), lane.position(lane.length, 0.0)) for key, lane in network.items()}
    lanes: list[GraphLane] = []
    for key, lane in network.items():
        length = lane.length
        bend = lane.heading_at(length) - lane.heading_at(0.0)
        straight = bend == 0.0 and lane.heading_at(length / 2) == lane.heading_at(0.0)
        points = 2 if straight else max(9, round(length / 2))
        centre = (lane.position(s, 0.0) for s in np.linspace(0.0, length, points))
        onward = [
            lane_id(other)
            for other in network
            if other[0] == key[1] and math.dist(ends[other][0], ends[key][1]) < _JOINT_M
        ]
        lanes.append(
            GraphLane(
                id=lane_id(key),
                centre=Polyline.of((float(p[0]), 0.0 - float(p[1])) for p in centre),
                width_m=LANE_WIDTH_M,
                speed_limit_mps=float(lane.speed_limit),
                kind="emergency" if lane_id(key) in emergency else "driving",
                road=f"{key[0]}-{key[1]}",
                index=key[2],
                successors=tuple(onward),
                closed=lane.forbidden,
                junction="crossing" if key[0].startswith("ir") else "",
                turn=turn_of(-bend),
            )
        )
    return RoadGraph(tuple(lanes))


def parse_config(config: dict[str, Any], scenario_id: str) -> RoadConfig:
    """Validated road configuration. Raises ScenarioError naming the scenario and every bad field."""
    try:
        return RoadConfig.model_validate(config)
    except ValidationError as error:
        faults = "; ".join(f"{'.'.join(map(str, e['loc'])) or 'env'}: {e['msg']}" for e in error.errors())
        raise ScenarioError(
            f"Scenario {scenario_id!r} has a bad road configuration: {faults}.",
            hint="Compare it with a DbLv1 sample's `env` mapping.",
        ) from error


def build_scene(config: RoadConfig, rng: np.random.Generator) -> HighwayScene:
    """Road and traffic of a scenario, with draws from `rng`. Raises ScenarioError for an unknown road type."""
    builders = {
        "ramp-merge-v0": _ramp_merge,
        "dt-highway-v0": _multi_lane,
        "dt-intersection-v0": _intersection,
    }
    builder = builders.get(config.type)
    if builder is None:
        raise ScenarioError(f"Unknown road type {config.type!r}.", hint=f"Known: {', '.join(sorted(builders))}.")
    return builder(config, rng)


def _ramp_merge(config: RoadConfig, rng: np.random.Generator) -> HighwayScene:
    before, converging, merge, after = stages(config, 4, (500.0, 80.0, 80.0, 2000.0))
    ends = (0.0, before + converging, before + converging + merge, before + converging + merge + after)
    network = LaneNetwork()
    for i in range(2):
        y = i * LANE_WIDTH_M
        for nodes, start, end in ((("a", "b"), ends[0], ends[1]), (("b", "c"), *ends[1:3]), (("c", "d"), *ends[2:])):
            network.add(*nodes, StraightLane([start, y], [end, y], speed_limit=HIGHWAY_LIMIT_MPS))
    ramp_y, amplitude = 6.5 + 4 + 4, 3.25
    ramp = StraightLane([0, ramp_y], [before, ramp_y], forbidden=True, speed_limit=RAMP_LIMIT_MPS)
    curve = SineLane(
        ramp.position(before, -amplitude),
        ramp.position(before + converging, -amplitude),
        amplitude,
        2 * np.pi / (2 * converging),
        np.pi / 2,
        forbidden=True,
        speed_limit=RAMP_LIMIT_MPS,
    )
    merge_start = curve.position(converging, 0)
    merging = StraightLane(
        merge_start, merge_start + np.array([merge, 0]), forbidden=True, speed_limit=HIGHWAY_LIMIT_MPS
    )
    network.add("j", "k", ramp)
    network.add("k", "b", curve)
    network.add("b", "c", merging)
    barrier = _standing(network, "obstacle", merging.position(merge, 0))
    ego = _place_ego(network, config, ("c", "d", 1), (105.0, 0.0))
    traffic = _populate(network, config, rng, spare_last_lane=False)
    return _highway_scene(network, ego, traffic, objects=[barrier])


def _multi_lane(config: RoadConfig, rng: np.random.Generator) -> HighwayScene:
    (length,) = stages(config, 1, (2000.0,))
    network = LaneNetwork()
    regular = config.num_lanes - 1 if config.emergency_lane else config.num_lanes
    for i in range(config.num_lanes):
        y = i * LANE_WIDTH_M
        network.add("a", "b", StraightLane([0, y], [length, y], forbidden=i >= regular, speed_limit=HIGHWAY_LIMIT_MPS))
    ego = _place_ego(network, config, ("a", "b", 0), (380.0, 0.0))
    traffic = _populate(network, config, rng, spare_last_lane=config.emergency_lane)
    emergency = frozenset({lane_id(("a", "b", regular))} if config.emergency_lane else ())
    return _highway_scene(network, ego, traffic, emergency=emergency)


def _highway_scene(
    network: LaneNetwork,
    ego: Spawn,
    traffic: list[Spawn],
    *,
    objects: Sequence[Spawn] = (),
    emergency: frozenset[LaneId] = frozenset(),
) -> HighwayScene:
    return HighwayScene(
        kind="highway",
        network=network,
        ego=ego,
        traffic=traffic,
        objects=list(objects),
        actuation=LAMPILOT_HIGHWAY,
        warm_up_steps=30,
        duration_s=1000.0,
        bounds=(-math.inf, 2400.0, -math.inf),
        emergency_lanes=emergency,
    )


def stages(config: RoadConfig, count: int, default: tuple[float, ...]) -> tuple[float, ...]:
    """Lengths of a road's stretches, m. Raises ScenarioError for another number of them than the road has."""
    stages = config.stage_length or default
    if len(stages) != count:
        raise ScenarioError(f"stage_length of a {config.type} road needs {count} lengths in metres, not {len(stages)}.")
    return tuple(stages)


def _standing(network: LaneNetwork, kind: Literal["obstacle", "stop_sign"], position: FloatArray) -> Spawn:
    return Spawn(kind, position, 0.0, 0.0, network.closest(position, 0.0), size_m=_OBSTACLE_M)


def _car(network: LaneNetwork, lane: HighwayLane, longitudinal_m: float, speed_mps: float) -> Spawn:
    """A car of the traffic on the centre of a lane."""
    position, heading = lane.position(longitudinal_m, 0), lane.heading_at(longitudinal_m)
    return Spawn(
        "traffic",
        position,
        heading,
        speed_mps,
        network.closest(position, heading),
        timer_s=float((np.sum(position) * np.pi) % 1.0),
    )


def _place_ego(
    network: LaneNetwork, config: RoadConfig, default_lane: LaneKey, default_position: tuple[float, float]
) -> Spawn:
    ego = config.ego_vehicle or EgoConfig(start_lane_index=default_lane, start_position=default_position)
    try:
        lane = network.lane(ego.start_lane_index)
    except (KeyError, IndexError):
        raise ScenarioError(f"The ego's start lane {ego.start_lane_index} is not on this {config.type} road.") from None
    position = lane.position(*ego.start_position)
    return Spawn("ego", position, 0.0, ego.speed, network.closest(position, 0.0))


def _populate(
    network: LaneNetwork, config: RoadConfig, rng: np.random.Generator, *, spare_last_lane: bool
) -> list[Spawn]:
    graph = network.graph
    traffic: list[Spawn] = []
    for i in range(config.vehicles_count):
        # The first car starts on the first road; its node draws are not made.
        start = "a" if i == 0 else rng.choice(list(graph.keys()))
        end = "b" if i == 0 else rng.choice(list(graph[start].keys()))
        lanes = graph[start][end]
        lane = lanes[rng.choice(list(range(len(lanes) - 1))) if spare_last_lane else rng.choice(len(lanes))]
        speed = rng.uniform(0.8 * lane.speed_limit, 1.1 * lane.speed_limit)
        spacing = (12 + speed) * (1 / config.vehicles_density)
        furthest = max((lane.local_coordinates(car.position)[0] for car in traffic), default=12)
        s = furthest + spacing * rng.uniform(0.7, 1.3)
        car = _car(network, lane, s, speed)
        car.exponent = rng.uniform(*_EXPONENTS)
        traffic.append(car)
    return traffic


def _intersection(config: RoadConfig, rng: np.random.Generator) -> HighwayScene:
    network = _crossroads()
    approach = network.lane(("o0", "ir0", 0))
    sign = _standing(network, "stop_sign", approach.position(95, 0))
    traffic: list[Spawn] = []
    for origin, goal, count, probability, position_deviation, speed_deviation in (
        (
            "o3",
            "o1",
            config.num_vehicles_right,
            config.spawn_probability_right,
            config.position_deviation_right,
            config.speed_deviation_right,
        ),
        (
            "o1",
            "o3",
            config.num_vehicles_left,
            config.spawn_probability_left,
            config.position_deviation_left,
            config.speed_deviation_left,
        ),
    ):
        for s in np.linspace(0, 100, count):
            car = _crossing_car(network, rng, (origin, goal), s, probability, position_deviation, speed_deviation)
            if car is None or any(np.linalg.norm(other.position - car.position) < 15 for other in traffic):
                continue
            path = network.shortest_path(car.lane[1], goal)
            car.route = (car.lane[:2], *pairwise(path))
            car.exponent = rng.uniform(*_EXPONENTS)
            traffic.append(car)
    position, heading = approach.position(10, 0), approach.heading_at(60)
    ego = Spawn("ego", position, heading, approach.speed_limit, network.closest(position, heading))
    return HighwayScene(
        kind="intersection",
        network=network,
        ego=ego,
        traffic=traffic,
        objects=[sign],
        actuation=LAMPILOT_INTERSECTION,
        warm_up_steps=0,
        duration_s=100.0,
        bounds=(-40.0, 40.0, -40.0),
        alone_steps=30,
    )


def _crossroads() -> LaneNetwork:
    """Four arms of one lane a direction; arms 1 and 3 have the right of way, left turns yield."""
    network = LaneNetwork()
    right_radius = LANE_WIDTH_M + 5
    left_radius = right_radius + LANE_WIDTH_M
    outer = right_radius + LANE_WIDTH_M / 2
    access = 50 + 50
    for corner in range(4):
        angle = np.radians(90 * corner)
        priority = 3 if corner % 2 else 1
        rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        into, left, ahead, right = (
            f"ir{corner}",
            f"il{(corner + 1) % 4}",
            f"il{(corner + 2) % 4}",
            f"il{(corner - 1) % 4}",
        )
        start = rotation @ np.array([LANE_WIDTH_M / 2, access + outer])
        end = rotation @ np.array([LANE_WIDTH_M / 2, outer])
        network.add(f"o{corner}", into, StraightLane(start, end, priority=priority, speed_limit=10))
        network.add(
            into,
            right,
            ArcLane(
                rotation @ np.array([outer, outer]),
                right_radius,
                angle + np.radians(180),
                angle + np.radians(270),
                1,
                priority=priority,
                speed_limit=10,
            ),
        )
        network.add(
            into,
            left,
            ArcLane(
                rotation @ np.array([-left_radius + LANE_WIDTH_M / 2, left_radius - LANE_WIDTH_M / 2]),
                left_radius,
                angle + np.radians(0),
                angle + np.radians(-90),
                -1,
                priority=priority - 1,
                speed_limit=10,
            ),
        )
        start = rotation @ np.array([LANE_WIDTH_M / 2, outer])
        end = rotation @ np.array([LANE_WIDTH_M / 2, -outer])
        network.add(into, ahead, StraightLane(start, end, priority=priority, speed_limit=10))
        start = rotation @ np.flip([LANE_WIDTH_M / 2, access + outer], axis=0)
        end = rotation @ np.flip([LANE_WIDTH_M / 2, outer], axis=0)
        network.add(right, f"o{(corner - 1) % 4}", StraightLane(end, start, priority=priority, speed_limit=10))
    return network


def crowded_rows(positions: Sequence[tuple[float, float]], ego: tuple[float, float]) -> list[int]:
    """Cars that LaMPilot takes away when the ego enters: those within 20 m of it.

    It removes them while it walks the list, so the car after a removed one is not looked at.
    """
    left = list(range(len(positions)))
    removed: list[int] = []
    i = 0
    while i < len(left):
        x, y = positions[left[i]]
        if np.linalg.norm(np.array([x - ego[0], y - ego[1]])) < _CLEAR_M:
            removed.append(left.pop(i))
        i += 1
    return removed


def _crossing_car(
    network: LaneNetwork,
    rng: np.random.Generator,
    route: tuple[str, str],
    longitudinal_m: float,
    probability: float,
    position_deviation_m: float,
    speed_deviation_mps: float,
) -> Spawn | None:
    """A car on its way across; None where none is drawn."""
    if rng.uniform() > probability:
        return None
    rng.choice(range(4), size=2, replace=False)  # a route LaMPilot draws and then overwrites
    origin, _ = route
    lane = network.lane((origin, origin.replace("o", "ir"), 0))
    s = longitudinal_m + 5 + rng.normal() * position_deviation_m
    return _car(network, lane, s, 8 + rng.normal() * speed_deviation_mps)
