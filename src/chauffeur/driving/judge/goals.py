"""Success conditions (DbLv1 `eval` mapping): LaMPilot's as its own evaluators judge them, and four of our own.

LaMPilot's are kept to the letter, oddities included, so that results compare with the published ones; what is odd
stands in the docstrings. Ours judge the scenes of `chauffeur bench scenes generate` that go beyond the original: steps
in a row, a change without a number, a step that need not be held, a refusal. Distances are centre to centre.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
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
CHANGE_HOLD_S = 3.0
"""A change without a number must last for longer than this."""
SPEED_STEP_MPS = 1.0
"""Least change of speed that counts as faster or slower."""
GAP_STEP_M, GAP_STEP_SHARE = 3.0, 0.1
"""Least change of the gap that counts as closer or further back: metres, or this share of the first gap if more."""


class Goal(Protocol):
    """A success condition, asked after every control period; without a time limit of its own, the world's ends it."""

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        """Rule on the present instant, `elapsed_s` after the task began."""
        ...


class HeldGoal:
    """A condition that must be held: success once it has held for long enough, failure when time runs out."""

    _since = -1.0

    def _judge(self, elapsed_s: float, *, reached: bool, lost: bool) -> Ruling:
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


class SpeedGoal(HeldGoal):
    """Reach and hold a speed within 1 m/s, or match a slower vehicle less than 100 m ahead (`ACCEvalbySpeed`)."""

    def __init__(self, road: RoadPerception, scenario: Scenario) -> None:
        start, spec = road.instant().speed_mps, scenario.goal
        self.target_mps = float(spec["speed"]) if "speed" in spec else start + float(spec["rel_speed"])

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
        return self._judge(elapsed_s, reached=reached, lost=lost)


def _lead_at_start(
    road: RoadPerception, otherwise: str = "This task is about the vehicle ahead, and there is none within 100 m."
) -> int:
    """Vehicle ahead within 100 m. Raises ScenarioError saying `otherwise`."""
    now = road.instant()
    if now.front is None or abs(now.gap_m) >= SIGHT_M:
        raise ScenarioError(otherwise, hint="Choose another seed.")
    return now.front


class DistanceGoal(HeldGoal):
    """Reach and hold a distance to the vehicle ahead within 30 % (`ACCEvalbyDistance`).

    The vehicle is the one ahead at the start until its lane differs from the ego's; then whichever is ahead. Without
    any, LaMPilot starts the clock while the ego keeps its first speed, and would then fail with an exception on the
    missing vehicle; here the clock stops instead.
    """

    def __init__(self, road: RoadPerception, scenario: Scenario) -> None:
        self._road = road
        self._front: int | None = _lead_at_start(road)
        now, spec = road.instant(), scenario.goal
        self.target_m = float(spec["distance"]) if "distance" in spec else now.gap_m + float(spec["rel_distance"])
        self._tolerance_m = 0.3 * self.target_m
        self._first_speed = now.speed_mps

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        if self._front is None or self._road.lane_of(self._front) != now.lane:
            self._front = now.front
        if self._front is None:
            at_first_speed = math.isclose(now.speed_mps, self._first_speed, abs_tol=0.1)
            return self._judge(elapsed_s, reached=at_first_speed, lost=at_first_speed)
        distance = abs(self._road.distance_along(EGO, self._front))
        low, high = self.target_m - self._tolerance_m, self.target_m + self._tolerance_m
        return self._judge(elapsed_s, reached=low < distance < high, lost=distance < low or distance > high)


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

    def __init__(self, road: RoadPerception, scenario: Scenario) -> None:
        self._road = road
        self._lane = _lane_beside(road, str(scenario.goal["direction"]))

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        del elapsed_s
        aligned = now.lane == self._lane and _heading_error_rad(now, self._road, self._lane) < np.deg2rad(5)
        return "success" if aligned else "open"


class OvertakeGoal:
    """Be in the lane beside the start lane with the vehicle once ahead now more than 10 m behind (`OvertakeEval`)."""

    def __init__(self, road: RoadPerception, scenario: Scenario) -> None:
        self._road = road
        self._lane = _lane_beside(road, str(scenario.goal["direction"]))
        self._front = _lead_at_start(road, "There is no vehicle within 100 m ahead to overtake.")

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        del elapsed_s
        if now.lane != self._lane:
            return "open"
        return "success" if self._road.distance_on(self._lane, self._front) < -_PASSED_M else "open"


class PullOverGoal:
    """Stand (below 0.5 m/s) in the emergency lane (`PullOverEval`)."""

    def __init__(self, road: RoadPerception, scenario: Scenario) -> None:
        del scenario
        self._lanes = road.emergency_lanes
        if not self._lanes:
            raise ScenarioError("This road has no emergency lane to pull over to.")

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        del elapsed_s
        return "success" if now.lane in self._lanes and abs(now.speed_mps) <= 0.5 else "open"


class RouteGoal:
    """Be in the wished exit lane of the intersection, heading within 0.1 degrees of it (`IntersectionEval`)."""

    def __init__(self, road: RoadPerception, scenario: Scenario) -> None:
        self._road = road
        start, end, index = scenario.goal["direction"]
        self._lane = lane_id((str(start), str(end), int(index)))
        if not road.has_lane(self._lane):
            raise ScenarioError(f"Goal lane {self._lane} is not on this road.")

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        del elapsed_s
        if now.lane != self._lane:
            return "open"
        error = _heading_error_rad(now, self._road, self._lane)
        aligned = error < np.deg2rad(0.1) or abs(error - 2 * np.pi) <= 1e-3 + 1e-5 * 2 * np.pi
        return "success" if aligned else "open"


class SequenceGoal:
    """Several goals one after the other (`SequenceEval`, key `steps`: their `eval` mappings in order).

    Each step's goal is set up in the instant in which the one before succeeded, so that "the lane on the right" and
    "10 m closer" mean what they mean then. A step that cannot be judged yet (no lead vehicle) is tried again; each has
    60 s.
    """

    def __init__(self, road: RoadPerception, scenario: Scenario) -> None:
        steps = scenario.goal["steps"]
        if not steps or not all(isinstance(step, dict) for step in steps):
            raise ScenarioError(f"Goal of scenario {scenario.id!r} needs `steps`, a list of goals.")
        self._road = road
        self._scenario = scenario
        self._waiting: list[dict[str, Any]] = [dict(step) for step in steps]
        self._begun_s = 0.0
        self._goal: Goal | None = self._set_up(self._waiting.pop(0))

    def _set_up(self, step: dict[str, Any]) -> Goal:
        return make_goal(self._road, replace(self._scenario, goal=step))

    def _next(self) -> None:
        """Set up the step that waits; left waiting while it cannot be judged here."""
        try:
            self._goal = self._set_up(self._waiting[0])
        except ScenarioError:
            self._goal = None
        else:
            self._waiting.pop(0)

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        since = elapsed_s - self._begun_s
        if self._goal is None:
            self._next()
        if self._goal is None:
            return "failure" if since > GIVE_UP_S else "open"
        ruling = self._goal.rule(since, now)
        if ruling == "success" and self._waiting:
            self._begun_s = elapsed_s
            self._next()
            return "open"
        # A lane change or an overtaking has no limit of its own; within a sequence it has the same 60 s.
        return "failure" if ruling == "open" and since > GIVE_UP_S else ruling


class ChangeGoal:
    """Faster, slower, closer or further back, by an amount that was not named (`ChangeEval`).

    Keys: `quantity` is `speed` or `distance` (to the vehicle that was ahead at the start, centre to centre), `change`
    is +1 or -1. The change must last for more than 3 s; 60 s without it is failure.
    """

    def __init__(self, road: RoadPerception, scenario: Scenario) -> None:
        spec = scenario.goal
        self._seen = _Quantity(road, str(spec["quantity"]))
        self._start = self._seen.of(road.instant())
        share = abs(GAP_STEP_SHARE * self._start)
        self._least = SPEED_STEP_MPS if spec["quantity"] == "speed" else max(GAP_STEP_M, share)
        self._change = int(spec["change"])
        if self._change not in (-1, 1):
            raise ScenarioError(f"A change is +1 or -1, not {self._change}.")
        self._since_s = -1.0

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        value = self._seen.of(now)
        # A vehicle overtaken is followed neither from further back nor from closer.
        if (value - self._start) * self._change < self._least or (value < 0 and self._seen.gap):
            self._since_s = -1.0
        elif self._since_s < 0:
            self._since_s = elapsed_s
        elif elapsed_s - self._since_s > CHANGE_HOLD_S:
            return "success"
        return "failure" if elapsed_s > GIVE_UP_S else "open"


class ReachGoal:
    """Reach a speed or a distance, without having to hold it (`ReachEval`): a step before another.

    One key: `speed`, `rel_speed` (m/s; within 1 m/s), `distance` or `rel_distance` (m, centre to centre to the vehicle
    ahead at the start; within 30 %).
    """

    def __init__(self, road: RoadPerception, scenario: Scenario) -> None:
        spec = scenario.goal
        quantity = "distance" if "distance" in spec or "rel_distance" in spec else "speed"
        self._seen = _Quantity(road, quantity)
        start = self._seen.of(road.instant())
        self._target = float(spec[quantity]) if quantity in spec else start + float(spec[f"rel_{quantity}"])
        self._within = 1.0 if quantity == "speed" else 0.3 * self._target

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        if abs(self._seen.of(now) - self._target) < self._within:
            return "success"
        return "failure" if elapsed_s > GIVE_UP_S else "open"


class _Quantity:
    """Speed, or distance to the vehicle that was ahead at the start. Raises ScenarioError where there was none."""

    def __init__(self, road: RoadPerception, name: str) -> None:
        if name not in ("speed", "distance"):
            raise ScenarioError(f"A goal is about `speed` or `distance`, not {name!r}.")
        self._road = road
        self.gap = name == "distance"
        self._lead = _lead_at_start(road) if self.gap else EGO

    def of(self, now: Instant) -> float:
        """Its value at an instant: m/s, or m centre to centre, negative behind us."""
        return self._road.distance_along(EGO, self._lead) if self.gap else now.speed_mps


def answered_rightly(goal: Mapping[str, Any], *, refused: bool, success: bool) -> bool:
    """True if an item was handled rightly: its goal reached, or a wish that must not be driven declined.

    Args:
        goal: What it is judged by. Where that is `RefuseEval`, asking back and refusing both leave the car as it is:
            either counts for either.
        refused: The planner or the checks declined the wish (not: the program was unusable, or the endpoint failed).
        success: The goal was reached.
    """
    return refused if goal.get("type") == "RefuseEval" else success


class RefuseGoal:
    """A wish that must not be driven (`RefuseEval`): driving it is an immediate failure.

    A refusal never reaches a goal; `answered_rightly` is its judge.
    """

    def __init__(self, road: RoadPerception, scenario: Scenario) -> None:
        del road, scenario

    def rule(self, elapsed_s: float, now: Instant) -> Ruling:
        del elapsed_s, now
        return "failure"


_GOALS: dict[str, type[Any]] = {
    "ACCEvalbySpeed": SpeedGoal,
    "ACCEvalbyDistance": DistanceGoal,
    "LaneChangeEval": LaneChangeGoal,
    "OvertakeEval": OvertakeGoal,
    "PullOverEval": PullOverGoal,
    "IntersectionEval": RouteGoal,
    "SequenceEval": SequenceGoal,
    "ChangeEval": ChangeGoal,
    "ReachEval": ReachGoal,
    "RefuseEval": RefuseGoal,
}
"""LaMPilot's six, and ours."""


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
        return _GOALS[kind](road, scenario)
    except (KeyError, TypeError, ValueError) as error:
        raise ScenarioError(f"Goal of scenario {scenario.id!r} is malformed: {scenario.goal}.") from error
