"""The highway world on highway-env: LaMPilot's roads behind the `World` contract, without the compiled core.

Inside, y, headings and steering grow to the right, as in highway-env; what is given from here on has them to the left.
"""

from __future__ import annotations

import math

import numpy as np

from chauffeur.concept import Command, Lead, Observation, RoadGraph, Scenario, ScenarioError
from chauffeur.control import Actuation
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway.roads import DT_S, crowded_rows, parse_config
from chauffeur.worlds.highway.world import FOLLOW_WITHIN_M
from highway_oracle.driver import ReferenceDriver
from highway_oracle.perception import ReferencePerception, vehicle_state
from highway_oracle.scenes import Scene, build_scene, road_of


class ReferenceWorld:
    """Ramp merge, multi-lane highway and intersection, stepped at 10 Hz."""

    engine = "highway-env"

    def __init__(self) -> None:
        self._scene: Scene | None = None
        self._perception: ReferencePerception | None = None
        self._driver: ReferenceDriver | None = None
        self._graph: RoadGraph = RoadGraph(())
        self._tick = 0
        self._clock_s = 0.0

    @property
    def dt_s(self) -> float:
        """Control period, s."""
        return DT_S

    @property
    def actuation(self) -> Actuation:
        """Full-scale pedal and wheel values of the ego."""
        return self.scene.actuation

    @property
    def scene(self) -> Scene:
        """The scene being driven. Raises ScenarioError before the first reset."""
        if self._scene is None:
            raise ScenarioError("The world has no scenario yet.", hint="Call reset(scenario) first.")
        return self._scene

    def reset(self, scenario: Scenario, seed: int | None = None) -> Observation:
        """Build road and traffic, let it warm up, and place the ego in the flow.

        Raises:
            ScenarioError: The configuration is malformed, or the ego starts in a crash.
        """
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(scenario.seed if seed is None else seed)))
        scene = build_scene(parse_config(scenario.config, scenario.id), rng)
        self._scene = scene
        self._tick = 0
        self._clock_s = 0.0
        if scene.alone_steps:
            _let_ego_enter(scene)
        for _ in range(scene.warm_up_steps):
            self._advance(Command(0.0, 0.0))
        self._perception = ReferencePerception(scene)
        self._driver = None
        self._graph = road_of(scene)
        self._tick = 0
        ego = scene.ego
        ego.speed = float(scene.road.network.get_lane(ego.lane_index).speed_limit)
        front = scene.road.neighbour_vehicles(ego, ego.lane_index)[0]
        if front is not None and ego.lane_distance_to(front) < FOLLOW_WITHIN_M:
            ego.speed = float(front.speed)
        return self.observe()

    def step(self, command: Command) -> Command:
        """Advance 0.1 s under `command`; returns what the vehicle really applied."""
        if not (math.isfinite(command.acceleration_mps2) and math.isfinite(command.steering_rad)):
            raise ValueError(f"A command must be finite numbers, not {command}.")
        applied = self._advance(Command(command.acceleration_mps2, 0.0 - command.steering_rad))
        self._tick += 1
        return Command(applied.acceleration_mps2, 0.0 - applied.steering_rad)

    def _advance(self, command: Command) -> Command:
        scene = self.scene
        self._clock_s += DT_S
        scene.ego.act({"acceleration": command.acceleration_mps2, "steering": command.steering_rad})
        scene.road.act()
        scene.road.step(DT_S)
        return Command(float(scene.ego.action["acceleration"]), float(scene.ego.action["steering"]))

    def observe(self) -> Observation:
        """The present instant as frozen values."""
        scene, perception = self.scene, self.perception()
        ego, road = scene.ego, scene.road
        front = road.neighbour_vehicles(ego, ego.lane_index)[0]
        lead = None
        if front is not None:
            lead = Lead(perception.id_of(front), float(ego.lane_distance_to(front)), float(front.speed))
        sign = perception.stop_sign_ahead(frozenset())
        return Observation(
            time_s=self._tick * DT_S,
            tick=self._tick,
            kind=scene.kind,
            ego=vehicle_state(EGO, ego),
            others=tuple(vehicle_state(perception.id_of(v), v) for v in road.vehicles if v is not ego),
            objects=tuple(vehicle_state(perception.id_of(o), o) for o in road.objects),
            road=self._graph,
            front=lead,
            stop_sign_m=None if sign is None else sign[1],
            off_road=not ego.on_road,
            ended=self.ended,
        )

    @property
    def ended(self) -> bool:
        """Crash, off the road, end of the stretch, or out of time."""
        scene = self.scene
        ego = scene.ego
        x, y = float(ego.position[0]), float(ego.position[1])
        min_x, max_x, min_y = scene.bounds
        beyond = x < min_x or x > max_x or y < min_y
        return bool(ego.crashed or not ego.on_road or beyond or self._clock_s >= scene.duration_s)

    def perception(self) -> ReferencePerception:
        """Questions about the present instant."""
        if self._perception is None:
            raise ScenarioError("The world has no scenario yet.", hint="Call reset(scenario) first.")
        return self._perception

    def driver(self) -> ReferenceDriver:
        """The low-level driver of the present trip; the same until the next reset."""
        if self._driver is None:
            self._driver = ReferenceDriver(self.scene, self.perception())
        return self._driver


def _let_ego_enter(scene: Scene) -> None:
    """Step the traffic alone, then let the ego in and take the cars away that are too close to it."""
    road = scene.road
    for _ in range(scene.alone_steps):
        road.act()
        road.step(DT_S)
    ego = scene.ego.position
    positions = [(float(v.position[0]), float(v.position[1])) for v in road.vehicles]
    for i in sorted(crowded_rows(positions, (float(ego[0]), float(ego[1]))), reverse=True):
        del road.vehicles[i]
    road.vehicles.append(scene.ego)
    road.forget_instant()
