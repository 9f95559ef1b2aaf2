"""Drives an `ActionMatrix` (paper Eq. 22): its rows are the gains with which a set manoeuvre is tracked.

What is driven is the world's own manoeuvre where it sets one, and the present lane at the limit of the road elsewhere.
"""

from __future__ import annotations

import math
from typing import Final

from chauffeur.concept import ActionMatrix, Command, Limits, Observation, ScenarioError, Setpoints, VehicleState
from chauffeur.control.mpc import MpcWeights
from chauffeur.control.pid import PidGains, PidLimits
from chauffeur.executors.base import ExecutorBase, KnowsChassis, SetsManoeuvre
from chauffeur.executors.reference import ReferencePath
from chauffeur.executors.tracking import Gains, PathTracker
from chauffeur.geometry import Polyline, joined
from chauffeur.worlds.base import World
from chauffeur.worlds.corridor import Body
from chauffeur.worlds.path_follower import Chassis

HEADWAY_S: Final = 1.0
"""Time headway to a lead vehicle: an action matrix has none."""
REACHED_MPS: Final = 0.5
"""A target speed is reached within so much."""
_SETTLED_S: Final = 2.0


def gains_of(policy: ActionMatrix) -> Gains:
    """Its rows, named."""
    return Gains(PidGains(*policy.pid), MpcWeights(*policy.mpc))


def chassis_of(world: World) -> Chassis:
    """The ego's size and axles; where a world does not tell, its axles are at its ends, as those of highway-env are."""
    if isinstance(world, KnowsChassis):
        return world.chassis
    ego = world.observe().ego
    body = Body(ego.length_m, ego.width_m, ego.length_m / 2.0)
    return Chassis(body, ego.length_m, math.pi / 4.0, PidLimits().high_mps2)


class ActionMatrixExecutor(ExecutorBase):
    """PID and MPC with the policy's gains."""

    def __init__(self, world: World) -> None:
        """Args: the world, just reset: how long its periods are, what its car is, and whether it sets a manoeuvre."""
        super().__init__(world)
        self._chassis, self._dt_s = chassis_of(world), world.dt_s
        self._set = world.manoeuvre if isinstance(world, SetsManoeuvre) else None
        self._limit = world.perception().speed_limit
        self._tracker: PathTracker | None = None
        self._set_mps = 0.0
        self._settled_s = 0.0

    @property
    def tracker(self) -> PathTracker:
        """The tracker. Raises ScenarioError before `start`."""
        if self._tracker is None:
            raise ScenarioError("Nothing is driven yet.", hint="Call start(policy, observation, limits) first.")
        return self._tracker

    def start(
        self, policy: ActionMatrix, observation: Observation, limits: Limits, origin: VehicleState | None = None
    ) -> None:
        """See Executor. Gains have no place: they hold from where the car is."""
        del origin
        if self._set is not None:
            path, target = self._set.path, self._set.speed_mps
        else:
            path, target = _lane_path(observation), max(observation.ego.speed_mps, 0.0)
        tracker = PathTracker(self._chassis, self._dt_s, gains_of(policy))
        tracker.follow(ReferencePath(path, target))
        self._tracker, self._set_mps, self._limits = tracker, target, limits
        self._status, self._settled_s = "running", 0.0
        self._aim(observation)

    def step(self, observation: Observation, held: Setpoints | None = None) -> Command:
        self._aim(observation)
        tracker = self.tracker
        before = tracker.steered.total() - tracker.steered["solved"]
        command = tracker.command(observation, self._hold(held), self._setpoints.time_headway_s)
        if tracker.steered.total() - tracker.steered["solved"] > before and not self._notes:
            self._notes.append((observation.time_s, "The steering solver found nothing in time; I steer without it."))
        self._look_whether_done(observation)
        return command

    def _aim(self, observation: Observation) -> None:
        lane = observation.ego.lane
        most = self._limits.most_mps(self._limit(lane)) if lane is not None else self._set_mps
        headway = min(max(HEADWAY_S, self._limits.min_time_headway_s), self._limits.max_time_headway_s)
        self._setpoints = Setpoints(max(0.0, min(self._set_mps, most)), headway, lane)

    def _look_whether_done(self, observation: Observation) -> None:
        if self._set is None:
            return
        if self._set.goal_m is not None:
            done = self.tracker.station_m >= self._set.goal_m
        else:
            reached = observation.ego.speed_mps >= self._set_mps - REACHED_MPS
            self._settled_s = self._settled_s + self._dt_s if reached else 0.0
            done = self._settled_s >= _SETTLED_S
        if done:
            self._status = "finished"


def _lane_path(observation: Observation) -> Polyline:
    """The ego's lane and what follows it. Raises ScenarioError where there is no lane."""
    ego = observation.ego
    place = observation.road.locate(ego.x_m, ego.y_m, ego.heading_rad)
    if place is None:
        raise ScenarioError("The car is on no lane that could be followed.", hint="Start on a lane of the road.")
    return joined([lane.centre for lane in observation.road.ahead(place.lane)])
