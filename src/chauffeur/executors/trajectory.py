"""Drives a `Trajectory`: waypoints in the ego frame of the moment it was planned, at a fixed period.

A smooth path is laid through the waypoints, with the speed that their distances ask for at each, and tracked like a
manoeuvre: MPC across, PID along. Where it ends the car stops: whoever wants to go on plans again in time.
"""

from __future__ import annotations

import math
from itertools import islice, pairwise
from typing import Final

import numpy as np

from chauffeur.concept import Command, Limits, Observation, ScenarioError, Setpoints, Trajectory, VehicleState
from chauffeur.executors.action_matrix import HEADWAY_S, chassis_of
from chauffeur.executors.base import ExecutorBase
from chauffeur.executors.reference import ReferencePath
from chauffeur.executors.tracking import DEFAULT_GAINS, PathTracker
from chauffeur.geometry import Polyline, Pose, joined
from chauffeur.geometry.polyline import smooth
from chauffeur.worlds.base import World

_STAND_MPS: Final = 0.1
_END_M: Final = 0.3
_SAME_M: Final = 0.05
"""Waypoints nearer to each other than this are one place: the car stands there."""
_EASY_MPS2: Final = 1.5
_OFF_M: Final = 1.0
"""A car that is farther beside a trajectory than this has driven something else since it was planned."""
_LOST_M: Final = 3.0
"""A car that is farther beside its trajectory than this has been led elsewhere by the safety filter, past its turn say:
it stops in the lane where it is, for the way back would lead across others."""
_STOP_M: Final = 2.0
_LANES: Final = 3
_FIRM_MPS2: Final = 3.0
_AHEAD_S: Final = 0.3
"""The drive answers so much later."""
_LAG_S: Final = 1.0 / DEFAULT_GAINS.pid.kp
"""Feed-forward for the actuator lag, s: a P controller trails a changing speed by 1 / kp, so the set-point leads."""


class TrajectoryExecutor(ExecutorBase):
    """PID and MPC along the waypoints; a new trajectory may be started at any time."""

    def __init__(self, world: World) -> None:
        """Args: the world: how long its periods are, and what its car is."""
        super().__init__(world)
        self._tracker = PathTracker(chassis_of(world), world.dt_s, DEFAULT_GAINS)
        self._limit = world.perception().speed_limit
        self._reference: ReferencePath | None = None
        self._lost = False

    @property
    def tracker(self) -> PathTracker:
        """The tracker."""
        return self._tracker

    def start(
        self, policy: Trajectory, observation: Observation, limits: Limits, origin: VehicleState | None = None
    ) -> None:
        ego = observation.ego if origin is None else origin
        reference = reference_of(policy, Pose(ego.x_m, ego.y_m, ego.heading_rad), ego.speed_mps)
        self._tracker.follow(reference)
        self._reference, self._limits = reference, limits
        self._status, self._lost = "running", False
        self._aim(observation)

    def step(self, observation: Observation, held: Setpoints | None = None) -> Command:
        if not self._lost and abs(self._tracker.offset_m) > _LOST_M:
            self._stop_in_lane(observation)
        self._aim(observation)
        stands = (self._setpoints.target_speed_mps or 0.0) < _STAND_MPS
        command = self._tracker.command(observation, self._hold(held), self._setpoints.time_headway_s)
        assert self._reference is not None
        left = self._reference.length_m - self._tracker.station_m
        if left < _END_M or (stands and observation.ego.speed_mps < _STAND_MPS):
            self._status = "finished"
        return command

    def _stop_in_lane(self, observation: Observation) -> None:
        self._lost, ego, road = True, observation.ego, observation.road
        lane = road.get(ego.lane)
        if lane is None:
            return
        line = joined([one.centre for one in islice(road.ahead(lane.id), _LANES)])
        start = line.nearest(ego.x_m, ego.y_m, high_m=lane.length_m)
        path = line.between(start, min(line.length_m, start + _STOP_M + ego.speed_mps**2 / (2.0 * _EASY_MPS2)))
        if path.length_m > _SAME_M:
            self._reference = ReferencePath(path, np.linspace(ego.speed_mps, 0.0, len(path.points_m)).tolist())
            self._tracker.follow(self._reference)

    def _aim(self, observation: Observation) -> None:
        assert self._reference is not None
        ego = observation.ego
        station = self._tracker.station_m
        left = max(0.0, self._reference.length_m - station)
        ahead = station + max(ego.speed_mps, 1.0) * _AHEAD_S
        target = self._reference.speed_at(ahead) + self._reference.acceleration_at(ahead) * _LAG_S
        needed = ego.speed_mps**2 / (2.0 * max(left - _AHEAD_S * ego.speed_mps, 0.1))
        if needed > _EASY_MPS2:  # later than the waypoints wanted: brake for the end of the path
            target = min(target, ego.speed_mps - min(needed, _FIRM_MPS2) * _LAG_S)
        target = min(target, math.sqrt(2.0 * _EASY_MPS2 * left))
        most = math.inf if ego.lane is None else self._limits.most_mps(self._limit(ego.lane))
        self._setpoints = Setpoints(max(0.0, min(target, most)), HEADWAY_S, ego.lane)


def reference_of(policy: Trajectory, start: Pose, speed_mps: float) -> ReferencePath:
    """Path and speeds of a trajectory in the world.

    Args:
        policy: Waypoints; the first is reached one period after the start.
        start: Middle and heading of the car when it was planned.
        speed_mps: Its speed then.

    Raises:
        ScenarioError: The waypoints lead nowhere.
    """
    kept, legs, stands = [(0.0, 0.0)], list[float](), set[int]()
    for before, point in pairwise([(0.0, 0.0), *policy.waypoints_m]):
        if math.dist(kept[-1], point) < _SAME_M:
            stands.add(len(kept) - 1)
            continue
        kept.append(point)
        legs.append(math.dist(before, point) / policy.period_s)
    if not legs:
        kept.append((_SAME_M, 0.0))
        legs, stands = [0.0], {0, 1}
    # The speed of a leg is that at its middle.
    speeds = [max(speed_mps, 0.0), *((one + two) / 2.0 for one, two in pairwise(legs)), legs[-1]]
    speeds = [0.0 if place in stands else speed for place, speed in enumerate(speeds)]
    x, y = smooth(np.array(kept)).T
    points = [start.place(float(px), float(py)) for px, py in zip(x, y, strict=True)]
    try:
        path = Polyline.of(points)
    except ValueError as error:
        raise ScenarioError("The waypoints of the trajectory lead nowhere.", hint="Give places apart.") from error
    through = np.linspace(0.0, 1.0, len(path.points_m))
    given = np.linspace(0.0, 1.0, len(speeds))
    return ReferencePath(path, np.interp(through, given, speeds).tolist())


def rebased(policy: Trajectory, there: Pose, here: Pose) -> Trajectory:
    """The rest of a trajectory in the present ego frame, at the same period and speeds.

    Args:
        policy: Waypoints in the ego frame of the moment it was planned.
        there: Middle and heading of the car then.
        here: And now.

    Raises:
        ScenarioError: The car has passed its end, or is somewhere else by now.
    """
    places = [(there.x_m, there.y_m), *(there.place(x, y) for x, y in policy.waypoints_m)]
    # How far along the car is, in periods: on the leg that is nearest to it.
    nearest, begun = math.inf, 0.0
    for index, ((ax, ay), (bx, by)) in enumerate(pairwise(places)):
        dx, dy = bx - ax, by - ay
        way = dx * dx + dy * dy
        share = min(max(((here.x_m - ax) * dx + (here.y_m - ay) * dy) / way, 0.0), 1.0) if way > 0.0 else 0.0
        away = math.hypot(here.x_m - ax - share * dx, here.y_m - ay - share * dy)
        if away < nearest:
            nearest, begun = away, index + share
    last = len(places) - 1
    if begun > last - 1e-6:
        raise ScenarioError("The trajectory lies behind the car: planning took longer than it lasts.")
    if nearest > _OFF_M:
        raise ScenarioError(f"The car is {nearest:.1f} m beside the trajectory by now.")
    ahead: list[tuple[float, float]] = []
    for period in range(1, math.ceil(last - begun - 1e-6) + 1):
        at = min(begun + period, last)
        index = min(int(at), last - 1)
        (ax, ay), (bx, by) = places[index], places[index + 1]
        ahead.append(here.sees(ax + (at - index) * (bx - ax), ay + (at - index) * (by - ay)))
    return Trajectory(tuple(ahead), policy.period_s)
