"""The way ahead of a car that another simulator, or a vehicle, moves: one lane along its route, and the car on it.

It is set up anew from what that simulator tells, and stepped to foresee what a policy would do from there. Road users
that are told keep their speed and heading; where none are told, none are known, and no filter can keep clear of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from pydantic import BaseModel, ConfigDict, Field

from chauffeur.concept import (
    AgentKind,
    Capabilities,
    Command,
    Lane,
    Lead,
    Observation,
    RoadGraph,
    Scenario,
    ScenarioError,
    Setpoints,
    VehicleState,
)
from chauffeur.control.kinematic_bicycle import LINCOLN_MKZ, BicycleState, KinematicBicycle, advanced
from chauffeur.geometry import Polyline, Pose, overlap
from chauffeur.worlds.base import EGO
from chauffeur.worlds.over_graph import LaneDriver, ObservedPerception
from chauffeur.worlds.path_follower import Chassis
from chauffeur.worlds.skeleton import WorldBase, config_of, finite, set_up

CAR: Final = LINCOLN_MKZ
"""The size of a car that is not told: a saloon."""
DT_S: Final = 0.1
LANE: Final = "route"
_MAX_POINTS: Final = 2_000
_MAX_AGENTS: Final = 500
_LEAST_STEP_M: Final = 0.01
"""Waypoints nearer to each other than this are one."""
BEND_MPS2: Final = 2.0
"""Lateral acceleration in bends, for which speed is lowered: as people drive."""
EASY_MPS2: Final = 2.0
"""Braking before bends and the end of the route."""
_LOOK_M: Final = 4.0
_STOP_SHORT_M: Final = 3.0
"""Of the end of the route: the middle of the car stops so far before it."""
_STRAIGHT_PER_M: Final = 1e-4


class RouteAgent(BaseModel):
    """A road user as it is told: its middle, world frame."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    kind: AgentKind = "car"
    x_m: float
    y_m: float
    heading_rad: float = 0.0
    speed_mps: float = 0.0
    length_m: float = Field(default=4.5, gt=0.0, le=50.0)
    width_m: float = Field(default=1.8, gt=0.0, le=10.0)


class RouteConfig(BaseModel):
    """A scenario of the world: the rear axle of the car, the way ahead, and who else is there; world frame.

    `tick` counts control periods from the start of the other simulator's drive.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    route: tuple[tuple[float, float], ...] = Field(min_length=2, max_length=_MAX_POINTS)
    x_m: float = 0.0
    y_m: float = 0.0
    heading_rad: float = 0.0
    speed_mps: float = Field(default=0.0, ge=-1.0, le=100.0)
    acceleration_mps2: float = 0.0
    limit_mps: float = Field(default=13.9, gt=0.0, le=100.0)
    lane_width_m: float = Field(default=3.5, gt=1.0, le=10.0)
    tick: int = Field(default=0, ge=0)
    agents: tuple[RouteAgent, ...] = Field(default=(), max_length=_MAX_AGENTS)


@dataclass(frozen=True, slots=True)
class RouteManoeuvre:
    """A path that is to be driven, and at what speed; no place on it is a goal."""

    path: Polyline
    speed_mps: float
    goal_m: float | None = None


class BendAwareDriver(LaneDriver):
    """The lane driver, slower before bends and before the end of the route, beyond which nothing is known."""

    def settle(self, setpoints: Setpoints) -> Setpoints:
        """Wishes with defaults filled in, and the speed that the way ahead allows."""
        settled, now = super().settle(setpoints), self._observe()
        assert settled.target_speed_mps is not None
        centre = now.road[LANE].centre
        here = centre.nearest(now.ego.x_m, now.ego.y_m)
        reach = now.ego.speed_mps**2 / (2.0 * EASY_MPS2) + _LOOK_M
        fastest = math.sqrt(2.0 * EASY_MPS2 * max(0.0, centre.length_m - here - _STOP_SHORT_M))
        for i in range(int(reach / _LOOK_M) + 1):
            bend = abs(centre.curvature(here + i * _LOOK_M, _LOOK_M))
            fastest = min(fastest, math.sqrt(BEND_MPS2 / max(bend, _STRAIGHT_PER_M) + 2.0 * EASY_MPS2 * i * _LOOK_M))
        return replace(settled, target_speed_mps=min(settled.target_speed_mps, fastest))


class RouteWorld(WorldBase[ObservedPerception, BendAwareDriver]):
    """A car on its route, stepped at 10 Hz as a kinematic bicycle."""

    engine = "route 1 (kinematic bicycle)"
    capabilities = Capabilities(
        roads=("street",), policies=("program", "parameters", "trajectory", "action_matrix"), horizon_s=60.0
    )
    dt_s = DT_S
    chassis = Chassis.of(CAR)
    """The ego's size and axles."""
    steering_rate = CAR.steering_rate_radps
    """Steering rate of the ego, rad/s."""

    def __init__(self) -> None:
        self._config: RouteConfig | None = None
        self._road: RoadGraph | None = None
        self._state = BicycleState(Pose(0.0, 0.0, 0.0), 0.0)
        self._agents: tuple[VehicleState, ...] = ()
        self._tick, self._crashed = 0, False

    @property
    def car(self) -> KinematicBicycle:
        """The ego, as a filter may count on it."""
        return CAR

    @property
    def manoeuvre(self) -> RouteManoeuvre:
        """Follow the route at its speed limit: what is set for a policy that says how to drive and not what."""
        lane = set_up(self._road)[LANE]
        return RouteManoeuvre(lane.centre, lane.speed_limit_mps)

    def reset(self, scenario: Scenario, seed: int | None = None) -> Observation:
        """Place the car on its route; nothing is drawn at random.

        Raises:
            ScenarioError: The configuration is malformed, or the route has no length.
        """
        del seed
        config = config_of(RouteConfig, scenario, "route")
        centre = _line(config.route)
        self._config, self._road = config, RoadGraph((Lane(LANE, centre, config.lane_width_m, config.limit_mps),))
        rear = Pose(config.x_m, config.y_m, config.heading_rad)
        self._state = BicycleState(rear, max(0.0, config.speed_mps), 0.0, config.acceleration_mps2)
        self._agents = tuple(
            VehicleState(i, one.kind, one.x_m, one.y_m, one.heading_rad, one.speed_mps, one.length_m, one.width_m, None)
            for i, one in enumerate(config.agents, EGO + 1)
        )
        self._tick, self._crashed, self._shown = config.tick, False, None
        self._perception = ObservedPerception(self.observe)
        self._driver = BendAwareDriver(self.observe, self._perception)
        return self.observe()

    def step(self, command: Command) -> Command:
        """Advance 0.1 s under `command`; returns what the pedals and the wheel could do of it."""
        command = finite(command)
        set_up(self._config)
        before = self._state
        self._state = advanced(before, command.acceleration_mps2, command.steering_rad, DT_S, CAR)
        self._agents = tuple(
            replace(
                one,
                x_m=one.x_m + one.speed_mps * DT_S * math.cos(one.heading_rad),
                y_m=one.y_m + one.speed_mps * DT_S * math.sin(one.heading_rad),
            )
            for one in self._agents
        )
        self._tick, self._shown = self._tick + 1, None
        box = self.observe().ego.box
        if any(overlap(box, one.box) for one in self._agents):
            self._crashed, self._shown = True, None
        asked = max(-CAR.most_braking_mps2, min(CAR.most_acceleration_mps2, command.acceleration_mps2))
        return Command(asked, self._state.steering_rad)

    def rear(self) -> Pose:
        """The middle of the rear axle."""
        return self._state.rear

    def _look(self) -> Observation:
        road, state, middle = set_up(self._road), self._state, self._state.middle(CAR)
        lane = road[LANE]
        station = lane.centre.nearest(middle.x_m, middle.y_m)
        ego = VehicleState(
            EGO,
            "car",
            middle.x_m,
            middle.y_m,
            middle.heading_rad,
            state.speed_mps,
            CAR.length_m,
            CAR.width_m,
            LANE,
            self._crashed,
            acceleration_mps2=state.acceleration_mps2,
            yaw_rate_radps=state.yaw_rate_radps(CAR),
            steering_rad=state.steering_rad,
        )
        others = tuple(self._in_lane(one, lane) for one in self._agents)
        off_road = road.ground.off_road(middle.x_m, middle.y_m)
        return Observation(
            time_s=self._tick * DT_S,
            tick=self._tick,
            kind="street",
            ego=ego,
            others=others,
            objects=(),
            road=road,
            front=_front(others, lane, station),
            stop_sign_m=None,
            off_road=off_road,
            ended=self._crashed or off_road or station >= lane.length_m - 1e-6,
        )

    @staticmethod
    def _in_lane(one: VehicleState, lane: Lane) -> VehicleState:
        inside = abs(lane.centre.project(one.x_m, one.y_m)[1]) <= (lane.width_m + one.width_m) / 2.0
        return replace(one, lane=LANE if inside else None)


def _line(points: tuple[tuple[float, float], ...]) -> Polyline:
    kept = [points[0]]
    for point in points[1:]:
        if math.dist(kept[-1], point) >= _LEAST_STEP_M:
            kept.append(point)
    try:
        return Polyline.of(kept)
    except ValueError as error:
        raise ScenarioError("The route has no length.", hint="Give at least two places that lie apart.") from error


def _front(others: tuple[VehicleState, ...], lane: Lane, station_m: float) -> Lead | None:
    ahead = [
        (along - station_m, one)
        for one in others
        if one.lane == LANE and (along := lane.centre.nearest(one.x_m, one.y_m)) > station_m
    ]
    if not ahead:
        return None
    distance, one = min(ahead, key=lambda found: found[0])
    return Lead(one.id, distance, one.speed_mps)
