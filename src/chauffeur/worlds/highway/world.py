"""The highway world: LaMPilot's roads behind the `World` contract, stepped by the compiled core.

`benchmarks/highway_oracle` is the same world on the highway-env package itself; scenes equal to the bit and whole trips
to rounding (tests/worlds/test_core.py) are what makes this one's results LaMPilot's. Inside, y, headings and steering
grow to the right, as there; here, and in perception and driver, they change their sign.
"""

from __future__ import annotations

import json
import math
import struct
from collections import OrderedDict
from dataclasses import dataclass

import numpy as np

from chauffeur.concept import Capabilities, Command, DataError, Lead, Observation, RoadGraph, Scenario, ScenarioError
from chauffeur.control import Actuation
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway.core import CoreRoad
from chauffeur.worlds.highway.core import layout as at
from chauffeur.worlds.highway.driver import HighwayDriver
from chauffeur.worlds.highway.fitness import fit_to_begin
from chauffeur.worlds.highway.perception import HighwayPerception
from chauffeur.worlds.highway.roads import DT_S, HighwayScene, RoadConfig, build_scene, parse_config, road_graph
from chauffeur.worlds.skeleton import WorldBase, finite, set_up

FOLLOW_WITHIN_M = 50.0
"""LaMPilot starts the ego at the speed of a vehicle closer than this ahead, at the speed limit otherwise."""

GRIP_MPS2 = 9.81
"""Tyres brake and push no harder than this; LaMPilot's full-scale pedals stay well below."""
LOCK_RAD = math.radians(60.0)
"""The wheels turn no further than this; LaMPilot's full-scale wheel stays below."""

ENGINE = "highway core 1 (physics of highway-env 1.12.1)"

_KEPT_STARTS = 64
_DRAWS = 100
_INSTANT = struct.Struct("<Qd")
"""Control periods since the trip began, and the simulator's own clock, s."""


@dataclass(frozen=True, slots=True)
class _Start:
    """A scene warmed up and ready; `core` is only ever copied."""

    scene: HighwayScene
    core: CoreRoad
    road: RoadGraph
    clock_s: float


_starts: OrderedDict[tuple[str, int], _Start] = OrderedDict()
"""Start situations of this process: the commands of a benchmark sample share the costly part of a reset."""


class HighwayWorld(WorldBase[HighwayPerception, HighwayDriver]):
    """Ramp merge, multi-lane highway and intersection, stepped at 10 Hz."""

    engine = ENGINE
    capabilities = Capabilities(
        roads=("highway", "intersection"),
        policies=("program", "parameters", "trajectory", "action_matrix"),
        lane_changes=True,
        turns=True,
        stop_signs=True,
    )
    dt_s = DT_S
    """Control period, s."""

    def __init__(self) -> None:
        self._start: _Start | None = None
        self._core: CoreRoad | None = None
        self._tick = 0
        self._clock_s = 0.0

    @property
    def actuation(self) -> Actuation:
        """Full-scale pedal and wheel values of the ego. Raises ScenarioError before the first reset."""
        return self._started().scene.actuation

    def _started(self) -> _Start:
        return set_up(self._start)

    def _road(self) -> CoreRoad:
        return set_up(self._core)

    def reset(self, scenario: Scenario, seed: int | None = None) -> Observation:
        """Build road and traffic, let it warm up, and place the ego in the flow.

        Raises:
            ScenarioError: The configuration is malformed.
        """
        start = _start_of(scenario, scenario.seed if seed is None else seed)
        self._start = start
        self._core = start.core.copy()
        self._clock_s = start.clock_s
        self._tick = 0
        self._shown = None
        self._perception = HighwayPerception(self._core, start.scene.kind, start.scene.emergency_lanes)
        self._driver = None
        return self.observe()

    def copy(self) -> HighwayWorld:
        """The same instant in a world of its own; stepping one leaves the other alone."""
        twin = HighwayWorld()
        twin._start = start = self._started()
        twin._core = core = self._road().copy()
        twin._clock_s, twin._tick, twin._shown = self._clock_s, self._tick, self._shown
        twin._perception = HighwayPerception(core, start.scene.kind, start.scene.emergency_lanes)
        if self._driver is not None:
            twin._driver = self._driver.copy(core, twin._perception)
        return twin

    def mirror(self) -> HighwayWorld:
        """A copy for another process."""
        return HighwayWorld()

    def mirrored(self) -> bytes:
        """The present instant, for a copy of this world in another process."""
        return _INSTANT.pack(self._tick, self._clock_s) + self._road().state()

    def adopt(self, observation: bytes) -> None:
        """Be at an instant of the same scenario and seed, stepped elsewhere. Raises DataError if it is none."""
        if len(observation) < _INSTANT.size:
            raise DataError("An observation ends too early.")
        tick, clock_s = _INSTANT.unpack_from(observation)
        self._road().adopt(observation[_INSTANT.size :])
        self._tick, self._clock_s, self._shown = tick, clock_s, None

    def step(self, command: Command) -> Command:
        """Advance 0.1 s under `command`; returns what the vehicle really applied: no more than a car can do."""
        finite(command)
        core = self._road()
        self._shown = None
        self._clock_s += DT_S
        acceleration = max(-GRIP_MPS2, min(GRIP_MPS2, command.acceleration_mps2))
        core.advance(acceleration, 0.0 - max(-LOCK_RAD, min(LOCK_RAD, command.steering_rad)))
        self._tick += 1
        return Command(float(core.out[at.OUT_ACCELERATION]), 0.0 - float(core.out[at.OUT_STEERING]))

    def _look(self) -> Observation:
        start, core, perception = self._started(), self._road(), self.perception()
        front, gap = int(core.out[at.OUT_FRONT]), float(core.out[at.OUT_GAP])
        lead = None if front < 0 else Lead(front, gap, float(core.floats[front, at.SPEED]))
        sign = perception.stop_sign_ahead(frozenset())
        everybody = perception.everybody()
        return Observation(
            time_s=self._tick * DT_S,
            tick=self._tick,
            kind=start.scene.kind,
            ego=everybody[EGO],
            others=everybody[1 : core.vehicles],
            objects=everybody[core.vehicles :],
            road=start.road,
            front=lead,
            stop_sign_m=None if sign is None else sign[1],
            off_road=bool(core.out[at.OUT_ON_ROAD] <= 0.0),
            ended=self.ended,
        )

    @property
    def ended(self) -> bool:
        """Crash, off the road, end of the stretch, or out of time."""
        scene, core = self._started().scene, self._road()
        if core.out[at.OUT_CRASHED] != 0.0 or core.out[at.OUT_ON_ROAD] <= 0.0:
            return True
        x, y = core.floats[EGO, at.X], core.floats[EGO, at.Y]
        min_x, max_x, min_y = scene.bounds
        return bool(x < min_x or x > max_x or y < min_y or self._clock_s >= scene.duration_s)

    def driver(self) -> HighwayDriver:
        """The low-level driver of the present trip; the same until the next reset."""
        if self._driver is None:
            scene = self._started().scene
            self._driver = HighwayDriver(self._road(), self.perception(), scene.actuation, scene.network)
        return self._driver


def _start_of(scenario: Scenario, seed: int) -> _Start:
    key = json.dumps(scenario.config, sort_keys=True, default=str), seed
    start = _starts.get(key)
    if start is None:
        start = _starts[key] = _drawn(scenario, seed)
        if len(_starts) > _KEPT_STARTS:
            _starts.popitem(last=False)
    _starts.move_to_end(key)
    return start


def _drawn(scenario: Scenario, seed: int) -> _Start:
    """The start a seed stands for: its first draw, or where the scenario asks for one, its first that is fit."""
    config = parse_config(scenario.config, scenario.id)
    start = _warm_up(config, np.random.SeedSequence(seed))
    if not config.redraw_unfit:
        return start
    for draw in range(1, _DRAWS):
        if fit_to_begin(HighwayPerception(start.core, start.scene.kind, start.scene.emergency_lanes).everybody()):
            return start
        start = _warm_up(config, np.random.SeedSequence([seed, draw]))
    raise ScenarioError(
        f"Scenario {scenario.id!r} has no start without a collision for seed {seed}, in {_DRAWS} draws.",
        hint="Give it fewer vehicles, or a smaller vehicles_density.",
    )


def _warm_up(config: RoadConfig, seeds: np.random.SeedSequence) -> _Start:
    rng = np.random.Generator(np.random.PCG64(seeds))
    scene = build_scene(config, rng)
    core = CoreRoad.of(scene)
    if not _starts:
        core.make_ready()
    clock_s = 0.0
    if scene.alone_steps:
        core.advance(0.0, 0.0, scene.alone_steps)
        core.admit_ego()
    if scene.warm_up_steps:
        core.advance(0.0, 0.0, scene.warm_up_steps)
        for _ in range(scene.warm_up_steps):
            clock_s += DT_S
    ego_lane = core.lane_of(EGO)
    speed = float(core.road.lanes[ego_lane, at.LIMIT])
    front, _ = core.neighbours(EGO, ego_lane)
    if front >= 0 and core.gap(EGO, front) < FOLLOW_WITHIN_M:
        speed = float(core.floats[front, at.SPEED])
    core.floats[EGO, at.SPEED] = speed
    core.report()
    return _Start(scene, core, road_graph(scene.network.lanes(), scene.emergency_lanes), clock_s)
