"""A referee for free drives: judges what the planner says it understood, by LaMPilot's success conditions.

An official sample brings its own goal, and that alone decides there. Where a scenario has none, the goal is read from
the plan's intent and numbers; it then shows whether the car did what was understood, not whether that was what the
person meant. Wishes that LaMPilot has no condition for (a style, two things in a row) are driven without a goal.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from chauffeur.bench.lampilot.referee import LampilotReferee
from chauffeur.concept import Plan, Scenario, ScenarioError
from chauffeur.drive.episode import Referee
from chauffeur.worlds.base import World
from chauffeur.worlds.highway import HighwayWorld

_EXITS = {"left": ["il1", "o1", 0], "straight": ["il2", "o2", 0], "right": ["il3", "o3", 0]}


def goal_understood(plan: Plan) -> dict[str, Any]:
    """LaMPilot goal for a plan's intent; empty where none fits."""
    manoeuvre, _, detail = plan.intent.partition(".")
    settings = dict(plan.settings)
    if manoeuvre in ("overtake", "lane") and detail in ("left", "right"):
        return {"type": "OvertakeEval" if manoeuvre == "overtake" else "LaneChangeEval", "direction": detail}
    if manoeuvre == "turn" and detail in _EXITS:
        return {"type": "IntersectionEval", "direction": _EXITS[detail]}
    if plan.intent == "pull_over":
        return {"type": "PullOverEval"}
    if manoeuvre == "speed" and "target_speed_mps" in settings:
        return {"type": "ACCEvalbySpeed", "speed": settings["target_speed_mps"]}
    if manoeuvre == "gap" and "gap_m" in settings:
        return {"type": "ACCEvalbyDistance", "distance": settings["gap_m"]}
    return {}


def referee_for(world: World, scenario: Scenario, plan: Plan) -> Referee | None:
    """Judge of a trip: by the scenario's own goal, else by what was understood, else none.

    Raises:
        ScenarioError: The scenario's own goal cannot be judged.
    """
    if not isinstance(world, HighwayWorld):
        return None
    if scenario.goal:
        return LampilotReferee(world, scenario)
    goal = goal_understood(plan)
    if not goal:
        return None
    try:
        return LampilotReferee(world, replace(scenario, goal=goal))
    except ScenarioError:
        return None  # e.g. a gap wish with nobody ahead: the drive itself still shows what the car does
