"""LaMPilot's success conditions (DbLv1 `eval` mapping), as its own evaluators judge them.

They are kept to the letter, oddities included, so that results compare with the published ones; what is odd stands in
the docstrings. Distances are centre to centre.
"""

from __future__ import annotations

import math
from typing import Any, Literal, Protocol

import numpy as np

from chauffeur.concept import LaneId, Scenario, ScenarioError
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.perception import lane_id

Ruling = Literal["open", "success", "failure"]

HOLD_S = 5.0
"""A speed or a distance must be held for longer than this."""
GIVE_UP_S = 60.0
"""Speed and distance tasks fail after this."""
SIGHT_M = 100.0
"""A vehicle further ahead than this does not count."""


class Goal(Protocol):
    """A success condition, asked after every control period."""

    def rule(self, elapsed_s: float) -> Ruling:
        """Whether the task is done at the present instant, `elapsed_s` after it began."""
        ...


class _Held:
    """Success once a condition has held long enough; failure when time runs out."""

    def __init__(self) -> None:
        self._since = -1.0

    def judge(self, elapsed_s: float, *, reached: bool, lost: bool) -> Ruling:
        """One instant. `reached` starts the clock, `lost` stops it; before it runs out a full hold is success."""
        ruling: Ruling = "open"
        if self._since == -1:
            if reached:
                self._since = elapsed_s
        elif elapsed_s - self._since > HOLD_S:
            ruling = "success"
        elif lost:
            self._since = -1.0
        return "failure" if elapsed_s > GIVE_UP_S else ruling


class SpeedGoal:
    """Reach and hold a speed within 1 m/s, or match a slower vehicle less than 100 m ahead (`ACCEvalbySpeed`)."""

    def __init__(self, world: HighwayWorld, spec: dict[str, Any]) -> None:
        self._world = world
        ego = world.scene.ego
        self.target_mps = float(spec["speed"]) if "speed" in spec else float(ego.speed) + float(spec["rel_speed"])
        self._held = _Held()

    def rule(self, elapsed_s: float) -> Ruling:
        """See Goal."""
        ego = self._world.scene.ego
        front = self._world.scene.road.neighbour_vehicles(ego, ego.lane_index)[0]
        if front is not None and ego.lane_distance_to(front) > SIGHT_M:
            front = None
        off_target = abs(ego.speed - self.target_mps)
        if front is None or front.speed > self.target_mps:
            reached, lost = off_target < 1, off_target > 1
        elif front.speed < self.target_mps:
            off_front = abs(front.speed - ego.speed)
            near = abs(ego.lane_distance_to(front)) < SIGHT_M
            reached, lost = bool(off_front < 1 and near), off_front > 1
        else:  # equal speeds fall between LaMPilot's two cases
            reached = lost = False
        return self._held.judge(elapsed_s, reached=bool(reached), lost=bool(lost))


class DistanceGoal:
    """Reach and hold a distance to the vehicle ahead within 30 % (`ACCEvalbyDistance`).

    The vehicle is the one ahead at the start until its lane differs from the ego's; then whichever is ahead. Without
    any, LaMPilot starts the clock while the ego keeps its first speed, and would then fail with an exception on the
    missing vehicle; here the clock stops instead.
    """

    def __init__(self, world: HighwayWorld, spec: dict[str, Any]) -> None:
        self._world = world
        ego, road = world.scene.ego, world.scene.road
        self._front = road.neighbour_vehicles(ego, ego.lane_index)[0]
        if self._front is None or abs(ego.lane_distance_to(self._front)) >= SIGHT_M:
            raise ScenarioError(
                "This task is about the vehicle ahead, and there is none within 100 m.", hint="Choose another seed."
            )
        start = float(ego.lane_distance_to(self._front))
        self.target_m = float(spec["distance"]) if "distance" in spec else start + float(spec["rel_distance"])
        self._tolerance_m = 0.3 * self.target_m
        self._first_speed = float(ego.speed)
        self._held = _Held()

    def rule(self, elapsed_s: float) -> Ruling:
        """See Goal."""
        ego, road = self._world.scene.ego, self._world.scene.road
        if self._front is None or self._front.lane_index != ego.lane_index:
            self._front = road.neighbour_vehicles(ego, ego.lane_index)[0]
        if self._front is None:
            at_first_speed = math.isclose(ego.speed, self._first_speed, abs_tol=0.1)
            return self._held.judge(elapsed_s, reached=at_first_speed, lost=at_first_speed)
        distance = abs(ego.lane_distance_to(self._front))
        low, high = self.target_m - self._tolerance_m, self.target_m + self._tolerance_m
        return self._held.judge(
            elapsed_s, reached=bool(low < distance < high), lost=bool(distance < low or distance > high)
        )


def _lane_beside(world: HighwayWorld, direction: str) -> tuple[LaneId, Any]:
    """Lane to the left or right of the ego's start lane. Raises ScenarioError where there is none to drive on."""
    if direction not in ("left", "right"):
        raise ScenarioError(f"Goal direction must be 'left' or 'right', not {direction!r}.")
    ego, network = world.scene.ego, world.scene.road.network
    lane = world.perception().adjacent_lane(lane_id(ego.lane_index), -1 if direction == "left" else 1)
    if lane is None or not network.get_lane(lane).is_reachable_from(ego.position):
        raise ScenarioError(f"There is no lane to the {direction} of the ego.", hint="Choose another scenario.")
    return lane, network.get_lane(lane)


def _heading_error_rad(ego: Any, lane: Any) -> float:
    """Absolute heading difference to a lane where the ego is along it, not wrapped (as the origin compares it)."""
    return abs(float(ego.heading) - float(lane.heading_at(lane.local_coordinates(ego.position)[0])))


class LaneChangeGoal:
    """Be in the lane beside the start lane, heading within 5 degrees of it (`LaneChangeEval`)."""

    def __init__(self, world: HighwayWorld, spec: dict[str, Any]) -> None:
        self._world = world
        self._lane, self._geometry = _lane_beside(world, str(spec["direction"]))

    def rule(self, elapsed_s: float) -> Ruling:
        """See Goal. There is no time limit but the environment's."""
        del elapsed_s
        ego = self._world.scene.ego
        aligned = ego.lane_index == self._lane and _heading_error_rad(ego, self._geometry) < np.deg2rad(5)
        return "success" if aligned else "open"


class OvertakeGoal:
    """Be in the lane beside the start lane with the vehicle once ahead now more than 10 m behind (`OvertakeEval`)."""

    def __init__(self, world: HighwayWorld, spec: dict[str, Any]) -> None:
        self._world = world
        self._lane, self._geometry = _lane_beside(world, str(spec["direction"]))
        ego, road = world.scene.ego, world.scene.road
        self._front = road.neighbour_vehicles(ego, ego.lane_index)[0]
        if self._front is None or abs(ego.lane_distance_to(self._front)) >= SIGHT_M:
            raise ScenarioError("There is no vehicle within 100 m ahead to overtake.", hint="Choose another seed.")

    def rule(self, elapsed_s: float) -> Ruling:
        """See Goal. There is no time limit but the environment's."""
        del elapsed_s
        ego = self._world.scene.ego
        passed = ego.lane_distance_to(self._front, self._geometry) < -2 * ego.LENGTH
        return "success" if ego.lane_index == self._lane and passed else "open"


class PullOverGoal:
    """Stand (below 0.5 m/s) in the emergency lane (`PullOverEval`)."""

    def __init__(self, world: HighwayWorld, spec: dict[str, Any]) -> None:
        del spec
        self._world = world
        if not world.scene.emergency_lanes:
            raise ScenarioError("This road has no emergency lane to pull over to.")

    def rule(self, elapsed_s: float) -> Ruling:
        """See Goal. There is no time limit but the environment's."""
        del elapsed_s
        ego = self._world.scene.ego
        in_lane = lane_id(ego.lane_index) in self._world.scene.emergency_lanes
        return "success" if in_lane and abs(ego.speed) <= 0.5 else "open"


class RouteGoal:
    """Be in the wished exit lane of the intersection, heading within 0.1 degrees of it (`IntersectionEval`)."""

    def __init__(self, world: HighwayWorld, spec: dict[str, Any]) -> None:
        self._world = world
        self._lane = lane_id(tuple(spec["direction"]))
        if not world.perception().has_lane(self._lane):
            raise ScenarioError(f"Goal lane {self._lane} is not on this road.")
        self._geometry = world.scene.road.network.get_lane(self._lane)

    def rule(self, elapsed_s: float) -> Ruling:
        """See Goal. There is no time limit but the environment's."""
        del elapsed_s
        ego = self._world.scene.ego
        if ego.lane_index != self._lane:
            return "open"
        error = _heading_error_rad(ego, self._geometry)
        aligned = error < np.deg2rad(0.1) or abs(error - 2 * np.pi) <= 1e-3 + 1e-5 * 2 * np.pi
        return "success" if aligned else "open"


_GOALS: dict[str, type[Any]] = {
    "ACCEvalbySpeed": SpeedGoal,
    "ACCEvalbyDistance": DistanceGoal,
    "LaneChangeEval": LaneChangeGoal,
    "OvertakeEval": OvertakeGoal,
    "PullOverEval": PullOverGoal,
    "IntersectionEval": RouteGoal,
}


def make_goal(world: HighwayWorld, scenario: Scenario) -> Goal:
    """The scenario's goal, for a world just reset to it.

    Raises:
        ScenarioError: The goal is unknown or malformed, or cannot apply to this start (no vehicle ahead, no such lane).
    """
    kind = scenario.goal.get("type")
    if kind not in _GOALS:
        raise ScenarioError(
            f"Scenario {scenario.id!r} has the unknown goal type {kind!r}.", hint=f"Known: {', '.join(_GOALS)}."
        )
    try:
        return _GOALS[kind](world, scenario.goal)
    except (KeyError, TypeError, ValueError) as error:
        raise ScenarioError(f"Goal of scenario {scenario.id!r} is malformed: {scenario.goal}.") from error
