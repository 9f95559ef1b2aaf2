"""Feasibility of a scene: not spoilt at the start, not fulfilled by itself, solved by the expert."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from chauffeur.bench.lampilot.rehearse import unhurried_sandbox
from chauffeur.bench.lampilot.scenes.scripted import programs_for
from chauffeur.concept import Observation, SandboxError, Scenario, ScenarioError
from chauffeur.describe import describe
from chauffeur.driving.episode import drive_program, drive_without_program
from chauffeur.driving.judge.goals import GIVE_UP_S, Goal, make_goal
from chauffeur.driving.judge.lampilot import GoalJudge
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.network import lane_id

MAX_EPISODE_S = 130.0
"""No goal takes longer: 60 s at most a step, and the roads end before that."""
_EMPTY_WISHES = ("ACCEvalbySpeed", "ACCEvalbyDistance", "ChangeEval")
"""Goals that a car may fulfil by driving on as it is."""


@dataclass(frozen=True, slots=True)
class FeasibilityVerdict:
    """Verdict on a scene.

    Attributes:
        feasible: The expert solves it without a collision, and it asks for something.
        why: Why not, in a few words for counting; empty when it is.
        ticks: Control periods the expert took, 0 when it was not driven.
        by: Which of `scripted.SOLVERS` solved it.
    """

    feasible: bool
    why: str = ""
    ticks: int = 0
    by: str = ""


class GoalReferee(GoalJudge):
    """Judge of a goal alone, without scores: what `drive` needs of a referee, and no more."""

    def __init__(self, world: HighwayWorld, goal: Goal) -> None:
        super().__init__(world.perception(), goal)
        self._ticks = 0
        self._crashed = False

    def observe(self) -> None:
        """Look at the instant after a control period."""
        self._ticks += 1
        now = self._road.instant()
        self._crashed = now.crashed
        self._ruling = self._goal.rule(self._ticks / 10, now)

    @property
    def success(self) -> bool:
        """True if the goal is reached and nothing was hit in that instant."""
        return self._ruling == "success" and not self._crashed


def start_of(world: HighwayWorld, scenario: Scenario) -> Observation | str:
    """The first instant of a scene, or why it is spoilt already."""
    try:
        start = world.reset(scenario)
    except ScenarioError:
        return "the road cannot be set up"
    if start.ego.crashed or start.off_road or start.ended:
        return "starts in a crash"
    ego = scenario.config.get("ego_vehicle")
    if start.ego.lane is None or (ego is not None and lane_id(ego["start_lane_index"]) != start.ego.lane):
        return "starts in another lane"
    return start


def feasible(scenario: Scenario) -> FeasibilityVerdict:
    """Judge a scene whose goal is to be driven.

    Raises:
        SandboxError: The sandbox failed; it says nothing about the scene.
    """
    world = HighwayWorld()
    start = start_of(world, scenario)
    if isinstance(start, str):
        return FeasibilityVerdict(False, start)
    try:
        goal = make_goal(world.perception(), scenario)
    except ScenarioError as error:
        return FeasibilityVerdict(False, error.message)
    programs = programs_for(scenario.goal, describe(start).situation)
    if not programs:
        return FeasibilityVerdict(False, "the expert has no program for it")
    if scenario.goal["type"] in _EMPTY_WISHES:
        idle = drive_without_program(world, GoalReferee(world, goal), GIVE_UP_S + 1.0, record=False)
        if idle.outcome == "success":
            return FeasibilityVerdict(False, "fulfilled without doing anything")
    why = ""
    for attempt in programs:
        world.reset(scenario)
        solved, why, ticks = _drive(world, scenario, attempt.source)
        if solved:
            return FeasibilityVerdict(True, ticks=ticks, by=attempt.by)
    return FeasibilityVerdict(False, why)


def _drive(world: HighwayWorld, scenario: Scenario, source: str) -> tuple[bool, str, int]:
    referee = GoalReferee(world, make_goal(world.perception(), scenario))
    episode = drive_program(world, source, referee, MAX_EPISODE_S, record=False, sandbox=unhurried_sandbox())
    if episode.causes.infra_failed:
        raise SandboxError(f"The sandbox failed in scene {scenario.id!r}: {episode.causes.detail}", retryable=True)
    if episode.causes.policy_failed:
        return False, "the expert's program failed", episode.ticks
    if episode.outcome == "success":
        return True, "", episode.ticks
    return False, _WORDS.get(episode.outcome, f"the expert ends in {episode.outcome}"), episode.ticks


_WORDS = {
    "collision": "the expert collides",
    "off_road": "the expert leaves the road",
    "failure": "the expert runs out of time",
    "timeout": "the expert runs out of road",
}


def impossible(scenario: Scenario, wish: dict[str, Any]) -> bool:
    """True if the world itself cannot judge a wish in a scene: no such lane, no lead vehicle, no shoulder.

    Raises:
        ScenarioError: The scene cannot be set up.
    """
    world = HighwayWorld()
    wanted = replace(scenario, goal=wish)
    world.reset(wanted)
    try:
        make_goal(world.perception(), wanted)
    except ScenarioError:
        return True
    return False
