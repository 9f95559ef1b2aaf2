"""LaMPilot's three roads, built of highway-env's own objects: what `worlds/highway/roads.py` is compared with.

Geometry and spawning rules are LaMPilot's (`ramp-merge-v0`, `dt-highway-v0`, `dt-intersection-v0`, DbLv1), so that a
sample and a seed start from the same traffic. Draws from the random generator stand in LaMPilot's order, those whose
result is not used included.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from highway_env.road.lane import CircularLane, LineType, SineLane, StraightLane

from chauffeur.concept import LaneId, RoadGraph, ScenarioError
from chauffeur.control import LAMPILOT_HIGHWAY, LAMPILOT_INTERSECTION, Actuation
from chauffeur.worlds.highway.network import LaneKey, lane_id
from chauffeur.worlds.highway.roads import (
    HIGHWAY_LIMIT_MPS,
    LANE_WIDTH_M,
    RAMP_LIMIT_MPS,
    EgoConfig,
    RoadConfig,
    road_graph,
    stages,
)
from highway_oracle.traffic import (
    AxisLane,
    DynamicEgo,
    FastNetwork,
    FastRegulatedRoad,
    FastRoad,
    IDMVehicle,
    KinematicEgo,
    Obstacle,
    StopSign,
)


@dataclass(slots=True)
class Scene:
    """A road with its traffic, ready to be stepped.

    Attributes:
        kind: `highway` or `intersection`.
        road: highway-env road.
        ego: The ego vehicle; last in the road's vehicles once it has entered.
        emergency_lanes: Lanes nobody but a car in distress may use.
        actuation: Full-scale pedal and wheel values.
        alone_steps: Steps of the traffic before the ego enters; 0 where it is there from the start.
        warm_up_steps: Steps with neutral controls before the trip begins.
        duration_s: Time limit of the environment, warm-up included.
        bounds: (min x, max x, min y): leaving them ends the trip.
    """

    kind: str
    road: Any
    ego: Any
    actuation: Actuation
    warm_up_steps: int
    duration_s: float
    bounds: tuple[float, float, float]
    alone_steps: int = 0
    emergency_lanes: frozenset[LaneId] = field(default_factory=frozenset[LaneId])


def name_of(index: tuple[Any, Any, Any]) -> LaneId:
    """The name of highway-env's lane index, which mixes NumPy's strings and integers with Python's."""
    return lane_id((str(index[0]), str(index[1]), int(index[2])))


def key_of(lane: LaneId) -> LaneKey:
    """highway-env's index of a lane."""
    road, index = lane.split(":")
    start, end = road.split("-")
    return start, end, int(index)


def road_of(scene: Scene) -> RoadGraph:
    """The graph of highway-env's lanes."""
    lanes = {key_of(name_of(index)): lane for index, lane in scene.road.network.lanes_dict().items()}
    return road_graph(lanes, scene.emergency_lanes)


def build_scene(config: RoadConfig, rng: np.random.Generator) -> Scene:
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


def _ramp_merge(config: RoadConfig, rng: np.random.Generator) -> Scene:
    before, converging, merge, after = stages(config, 4, (500.0, 80.0, 80.0, 2000.0))
    ends = (0.0, before + converging, before + converging + merge, before + converging + merge + after)
    network = FastNetwork()
    continuous, striped, none = LineType.CONTINUOUS_LINE, LineType.STRIPED, LineType.NONE
    outer = [(continuous, striped), (none, continuous)]
    beside_merge = [(continuous, striped), (none, striped)]
    for i in range(2):
        y = i * LANE_WIDTH_M
        for nodes, start, end, lines in (
            (("a", "b"), ends[0], ends[1], outer),
            (("b", "c"), ends[1], ends[2], beside_merge),
            (("c", "d"), ends[2], ends[3], outer),
        ):
            network.add_lane(*nodes, AxisLane([start, y], [end, y], line_types=lines[i], speed_limit=HIGHWAY_LIMIT_MPS))
    ramp_y, amplitude = 6.5 + 4 + 4, 3.25
    edges = (continuous, continuous)
    ramp = AxisLane([0, ramp_y], [before, ramp_y], line_types=edges, forbidden=True, speed_limit=RAMP_LIMIT_MPS)
    curve = SineLane(
        ramp.position(before, -amplitude),
        ramp.position(before + converging, -amplitude),
        amplitude,
        2 * np.pi / (2 * converging),
        np.pi / 2,
        line_types=[continuous, continuous],
        forbidden=True,
        speed_limit=RAMP_LIMIT_MPS,
    )
    merge_start = curve.position(converging, 0)
    merging = StraightLane(
        merge_start,
        merge_start + np.array([merge, 0]),
        line_types=(none, continuous),
        forbidden=True,
        speed_limit=HIGHWAY_LIMIT_MPS,
    )
    network.add_lane("j", "k", ramp)
    network.add_lane("k", "b", curve)
    network.add_lane("b", "c", merging)
    network.freeze()
    road = FastRoad(network=network, np_random=rng)
    road.objects.append(Obstacle(road, merging.position(merge, 0)))
    ego = _place_ego(road, config, ("c", "d", 1), (105.0, 0.0))
    _populate(road, config, rng, spare_last_lane=False)
    road.vehicles.append(ego)
    return _highway_scene(road, ego)


def _multi_lane(config: RoadConfig, rng: np.random.Generator) -> Scene:
    (length,) = stages(config, 1, (2000.0,))
    network = FastNetwork()
    continuous, striped, none = LineType.CONTINUOUS_LINE, LineType.STRIPED, LineType.NONE
    regular = config.num_lanes - 1 if config.emergency_lane else config.num_lanes
    for i in range(regular):
        left = continuous if i == 0 else none
        right = continuous if i == regular - 1 else striped
        y = i * LANE_WIDTH_M
        network.add_lane(
            "a", "b", AxisLane([0, y], [length, y], line_types=(left, right), speed_limit=HIGHWAY_LIMIT_MPS)
        )
    emergency: frozenset[tuple[str, str, int]] = frozenset()
    if config.emergency_lane:
        y = regular * LANE_WIDTH_M
        network.add_lane(
            "a",
            "b",
            AxisLane(
                [0, y],
                [length, y],
                line_types=(continuous, continuous),
                forbidden=True,
                speed_limit=HIGHWAY_LIMIT_MPS,
            ),
        )
        emergency = frozenset({name_of(("a", "b", regular))})
    network.freeze()
    road = FastRoad(network=network, np_random=rng)
    ego = _place_ego(road, config, ("a", "b", 0), (380.0, 0.0))
    _populate(road, config, rng, spare_last_lane=config.emergency_lane)
    road.vehicles.append(ego)
    return _highway_scene(road, ego, emergency)


def _highway_scene(road: Any, ego: Any, emergency: frozenset[tuple[str, str, int]] = frozenset()) -> Scene:
    return Scene(
        kind="highway",
        road=road,
        ego=ego,
        actuation=LAMPILOT_HIGHWAY,
        warm_up_steps=30,
        duration_s=1000.0,
        bounds=(-math.inf, 2400.0, -math.inf),
        emergency_lanes=emergency,
    )


def _place_ego(
    road: Any, config: RoadConfig, default_lane: tuple[str, str, int], default_position: tuple[float, float]
) -> KinematicEgo:
    ego = config.ego_vehicle or EgoConfig(start_lane_index=default_lane, start_position=default_position)
    try:
        lane = road.network.get_lane(ego.start_lane_index)
    except (KeyError, IndexError):
        raise ScenarioError(f"The ego's start lane {ego.start_lane_index} is not on this {config.type} road.") from None
    return KinematicEgo(road, lane.position(*ego.start_position), speed=ego.speed)


def _populate(road: Any, config: RoadConfig, rng: np.random.Generator, *, spare_last_lane: bool) -> None:
    graph = road.network.graph
    for i in range(config.vehicles_count):
        # The first car starts on the first road; its node draws are not made.
        start = "a" if i == 0 else rng.choice(list(graph.keys()))
        end = "b" if i == 0 else rng.choice(list(graph[start].keys()))
        lanes = graph[start][end]
        index = rng.choice(list(range(len(lanes) - 1))) if spare_last_lane else rng.choice(len(lanes))
        lane = road.network.get_lane((start, end, index))
        speed = rng.uniform(0.8 * lane.speed_limit, 1.1 * lane.speed_limit)
        spacing = (12 + speed) * (1 / config.vehicles_density)
        furthest = np.max([lane.local_coordinates(v.position)[0] for v in road.vehicles]) if road.vehicles else 12
        s = furthest + spacing * rng.uniform(0.7, 1.3)
        vehicle = IDMVehicle(road, lane.position(s, 0), lane.heading_at(s), speed)
        vehicle.randomize_behavior()
        road.vehicles.append(vehicle)


def _intersection(config: RoadConfig, rng: np.random.Generator) -> Scene:
    network = FastNetwork()
    right_radius = LANE_WIDTH_M + 5
    left_radius = right_radius + LANE_WIDTH_M
    outer = right_radius + LANE_WIDTH_M / 2
    access = 50 + 50
    none, continuous, striped = LineType.NONE, LineType.CONTINUOUS, LineType.STRIPED
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
        network.add_lane(
            f"o{corner}",
            into,
            StraightLane(start, end, line_types=(striped, continuous), priority=priority, speed_limit=10),
        )
        network.add_lane(
            into,
            right,
            CircularLane(
                rotation @ np.array([outer, outer]),
                right_radius,
                angle + np.radians(180),
                angle + np.radians(270),
                line_types=[none, continuous],
                priority=priority,
                speed_limit=10,
            ),
        )
        network.add_lane(
            into,
            left,
            CircularLane(
                rotation @ np.array([-left_radius + LANE_WIDTH_M / 2, left_radius - LANE_WIDTH_M / 2]),
                left_radius,
                angle + np.radians(0),
                angle + np.radians(-90),
                clockwise=False,
                line_types=[none, none],
                priority=priority - 1,
                speed_limit=10,
            ),
        )
        start = rotation @ np.array([LANE_WIDTH_M / 2, outer])
        end = rotation @ np.array([LANE_WIDTH_M / 2, -outer])
        network.add_lane(
            into, ahead, StraightLane(start, end, line_types=(none, none), priority=priority, speed_limit=10)
        )
        start = rotation @ np.flip([LANE_WIDTH_M / 2, access + outer], axis=0)
        end = rotation @ np.flip([LANE_WIDTH_M / 2, outer], axis=0)
        network.add_lane(
            right,
            f"o{(corner - 1) % 4}",
            StraightLane(end, start, line_types=(none, continuous), priority=priority, speed_limit=10),
        )
    network.freeze()
    road = FastRegulatedRoad(network=network, np_random=rng)
    approach = network.get_lane(("o0", "ir0", 0))
    road.objects.append(StopSign(road, approach.position(95, 0)))
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
            _spawn_crossing(road, rng, (origin, goal), s, probability, position_deviation, speed_deviation)
    ego = DynamicEgo(road, approach.position(10, 0), speed=approach.speed_limit, heading=approach.heading_at(60))
    return Scene(
        kind="intersection",
        road=road,
        ego=ego,
        actuation=LAMPILOT_INTERSECTION,
        warm_up_steps=0,
        duration_s=100.0,
        bounds=(-40.0, 40.0, -40.0),
        alone_steps=30,
    )


def _spawn_crossing(
    road: Any,
    rng: np.random.Generator,
    route: tuple[str, str],
    longitudinal_m: float,
    probability: float,
    position_deviation_m: float,
    speed_deviation_mps: float,
) -> None:
    if rng.uniform() > probability:
        return
    rng.choice(range(4), size=2, replace=False)  # a route LaMPilot draws and then overwrites
    origin, goal = route
    vehicle = IDMVehicle.make_on_lane(
        road,
        (origin, origin.replace("o", "ir"), 0),
        longitudinal=longitudinal_m + 5 + rng.normal() * position_deviation_m,
        speed=8 + rng.normal() * speed_deviation_mps,
    )
    if any(np.linalg.norm(v.position - vehicle.position) < 15 for v in road.vehicles):
        return
    vehicle.plan_route_to(goal)
    vehicle.randomize_behavior()
    road.vehicles.append(vehicle)
