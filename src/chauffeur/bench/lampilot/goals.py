"""LaMPilot's success conditions (DbLv1 `eval` mapping), as its own evaluators judge them.

They are kept to the letter, oddities included, so that results compare with the published ones; what is odd stands in
the docstrings. Distances are centre to centre.
"""

from __future__ import annotations

import math
from typing import Any, Literal, Protocol

import numpy as np

from chauffeur.concept import LaneId, Scenario, ScenarioError
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway import Instant, RoadPerception
from chauffeur.worlds.highway.network import lane_id

Ruling = Literal["open", "success", "failure"]

HOLD_S = 5.0
"""A speed or a distance must be held for longer than this."""
GIVE_UP_S = 60.0
"""Speed and distance tasks fail after this."""
SIGHT_M = 100.0
"""A vehicle further ahead than this does not count."""
_PASSED_M = 10.0
"""Two car lengths: how far behind an overtaken vehicle must be."""


class Goal(Protocol):
    """A success condition, asked after every control period."""

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
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

    def left_s(self, elapsed_s: float) -> float:
        """Least time until it may be success."""
        return max(0.0, HOLD_S - (0.0 if self._since == -1 else elapsed_s - self._since))


class SpeedGoal:
    """Reach and hold a speed within 1 m/s, or match a slower vehicle less than 100 m ahead (`ACCEvalbySpeed`)."""

    def __init__(self, road: RoadPerception, spec: dict[str, Any]) -> None:
        start = road.instant().speed_mps
        self.target_mps = float(spec["speed"]) if "speed" in spec else start + float(spec["rel_speed"])
        self._held = _Held()

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        alone = now.front is None or now.gap_m > SIGHT_M
        off_target = abs(now.speed_mps - self.target_mps)
        if alone or now.front_speed_mps > self.target_mps:
            reached, lost = off_target < 1, off_target > 1
        elif now.front_speed_mps < self.target_mps:
            off_front = abs(now.front_speed_mps - now.speed_mps)
            reached, lost = off_front < 1 and abs(now.gap_m) < SIGHT_M, off_front > 1
        else:  # equal speeds fall between LaMPilot's two cases
            reached = lost = False
        return self._held.judge(elapsed_s, reached=reached, lost=lost)

    def left_s(self, elapsed_s: float) -> float:
        """Least time until it may be success."""
        return self._held.left_s(elapsed_s)


def _lead_at_start(road: RoadPerception, otherwise: str) -> int:
    """Vehicle ahead within 100 m. Raises ScenarioError saying `otherwise`."""
    now = road.instant()
    if now.front is None or abs(now.gap_m) >= SIGHT_M:
        raise ScenarioError(otherwise, hint="Choose another seed.")
    return now.front


class DistanceGoal:
    """Reach and hold a distance to the vehicle ahead within 30 % (`ACCEvalbyDistance`).

    The vehicle is the one ahead at the start until its lane differs from the ego's; then whichever is ahead. Without
    any, LaMPilot starts the clock while the ego keeps its first speed, and would then fail with an exception on the
    missing vehicle; here the clock stops instead.
    """

    def __init__(self, road: RoadPerception, spec: dict[str, Any]) -> None:
        self._road = road
        self._front: int | None = _lead_at_start(
            road, "This task is about the vehicle ahead, and there is none within 100 m."
        )
        now = road.instant()
        self.target_m = float(spec["distance"]) if "distance" in spec else now.gap_m + float(spec["rel_distance"])
        self._tolerance_m = 0.3 * self.target_m
        self._first_speed = now.speed_mps
        self._held = _Held()

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        if self._front is None or self._road.lane_of(self._front) != now.lane:
            self._front = now.front
        if self._front is None:
            at_first_speed = math.isclose(now.speed_mps, self._first_speed, abs_tol=0.1)
            return self._held.judge(elapsed_s, reached=at_first_speed, lost=at_first_speed)
        distance = abs(self._road.distance_along(EGO, self._front))
        low, high = self.target_m - self._tolerance_m, self.target_m + self._tolerance_m
        return self._held.judge(elapsed_s, reached=low < distance < high, lost=distance < low or distance > high)

    def left_s(self, elapsed_s: float) -> float:
        """Least time until it may be success."""
        return self._held.left_s(elapsed_s)


def _lane_beside(road: RoadPerception, direction: str) -> LaneId:
    """Lane to the left or right of the ego's start lane. Raises ScenarioError where there is none to drive on."""
    if direction not in ("left", "right"):
        raise ScenarioError(f"Goal direction must be 'left' or 'right', not {direction!r}.")
    lane = road.adjacent_lane(road.lane_of(EGO), -1 if direction == "left" else 1)
    if lane is None or not road.reachable(lane):
        raise ScenarioError(f"There is no lane to the {direction} of the ego.", hint="Choose another scenario.")
    return lane


def _heading_error_rad(now: Instant, road: RoadPerception, lane: LaneId) -> float:
    """Absolute heading difference to a lane where the ego is along it, not wrapped (as the origin compares it)."""
    return abs(now.heading_rad - road.lane_heading(lane))


class LaneChangeGoal:
    """Be in the lane beside the start lane, heading within 5 degrees of it (`LaneChangeEval`)."""

    def __init__(self, road: RoadPerception, spec: dict[str, Any]) -> None:
        self._road = road
        self._lane = _lane_beside(road, str(spec["direction"]))

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        """See Goal. There is no time limit but the environment's."""
        del elapsed_s
        aligned = now.lane == self._lane and _heading_error_rad(now, self._road, self._lane) < np.deg2rad(5)
        return "success" if aligned else "open"


class OvertakeGoal:
    """Be in the lane beside the start lane with the vehicle once ahead now more than 10 m behind (`OvertakeEval`)."""

    def __init__(self, road: RoadPerception, spec: dict[str, Any]) -> None:
        self._road = road
        self._lane = _lane_beside(road, str(spec["direction"]))
        self._front = _lead_at_start(road, "There is no vehicle within 100 m ahead to overtake.")

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        """See Goal. There is no time limit but the environment's."""
        del elapsed_s
        if now.lane != self._lane:
            return "open"
        return "success" if self._road.distance_on(self._lane, self._front) < -_PASSED_M else "open"


class PullOverGoal:
    """Stand (below 0.5 m/s) in the emergency lane (`PullOverEval`)."""

    def __init__(self, road: RoadPerception, spec: dict[str, Any]) -> None:
        del spec
        self._lanes = road.emergency_lanes
        if not self._lanes:
            raise ScenarioError("This road has no emergency lane to pull over to.")

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        """See Goal. There is no time limit but the environment's."""
        del elapsed_s
        return "success" if now.lane in self._lanes and abs(now.speed_mps) <= 0.5 else "open"


class RouteGoal:
    """Be in the wished exit lane of the intersection, heading within 0.1 degrees of it (`IntersectionEval`)."""

    def __init__(self, road: RoadPerception, spec: dict[str, Any]) -> None:
        self._road = road
        start, end, index = spec["direction"]
        self._lane = lane_id((str(start), str(end), int(index)))
        if not road.has_lane(self._lane):
            raise ScenarioError(f"Goal lane {self._lane} is not on this road.")

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        """See Goal. There is no time limit but the environment's."""
        del elapsed_s
        if now.lane != self._lane:
            return "open"
        error = _heading_error_rad(now, self._road, self._lane)
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


def make_goal(road: RoadPerception, scenario: Scenario) -> Goal:
    """The scenario's goal, on a road just reset to it.

    Raises:
        ScenarioError: The goal is unknown or malformed, or cannot apply to this start (no vehicle ahead, no such lane).
    """
    kind = scenario.goal.get("type")
    if kind not in _GOALS:
        raise ScenarioError(
            f"Scenario {scenario.id!r} has the unknown goal type {kind!r}.", hint=f"Known: {', '.join(_GOALS)}."
        )
    try:
        return _GOALS[kind](road, scenario.goal)
    except (KeyError, TypeError, ValueError) as error:
        raise ScenarioError(f"Goal of scenario {scenario.id!r} is malformed: {scenario.goal}.") from error
