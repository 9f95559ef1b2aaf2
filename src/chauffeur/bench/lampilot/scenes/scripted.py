"""Programs that ought to solve a goal: who proves a scene feasible."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from chauffeur.bench.lampilot.expert import EXPERT, expert_program
from chauffeur.bench.lampilot.scenes.unambiguous import meaning_of
from chauffeur.concept import LAMPILOT_LIMITS, ScenarioError, Situation
from chauffeur.planners.onboard.choose import Choice, choose
from chauffeur.planners.onboard.exemplars import program_of
from chauffeur.planners.onboard.meaning import Meaning
from chauffeur.planners.onboard.personal import Leaning

EXEMPLARS = "onboard-exemplars-v1"
SOLVERS = (EXPERT, EXEMPLARS)
"""Solvers that prove scenes feasible, in the order in which they try."""


@dataclass(frozen=True, slots=True)
class ScriptedAttempt:
    """A program that ought to solve a goal, and whose it is."""

    by: str
    source: str


def programs_for(goal: dict[str, Any], situation: Situation) -> tuple[ScriptedAttempt, ...]:
    """Programs that may solve the goal, best first; a scene is feasible when one of them does.

    The scripted expert knows the goal alone, and LaMPilot's goals only. After it come the exemplar programs of
    `planners.onboard`, given the goal as a meaning and the situation at the start: they do the other goals, and keep
    scenes that only the expert happens to fail in.
    """
    out: list[ScriptedAttempt] = []
    with suppress(ScenarioError):  # none of LaMPilot's goals
        out.append(ScriptedAttempt(EXPERT, expert_program(goal)))
    return (*out, *(ScriptedAttempt(EXEMPLARS, source) for source in _exemplars(goal, situation)))


def _exemplars(goal: dict[str, Any], situation: Situation) -> tuple[str, ...]:
    if goal["type"] == "SequenceEval" and "distance" in goal["steps"][0] and len(goal["steps"]) > 1:
        return _gap_first(goal, situation)
    out: list[str] = []
    for meanings in _ways(goal):
        choice = choose(meanings, situation, LAMPILOT_LIMITS, _no_leaning)
        if isinstance(choice, Choice):
            out.append(program_of([step.filled for step in choice.steps]))
    return tuple(dict.fromkeys(out))


_REACH_GAP = """\
def reach_gap():
    # Close up to a gap and go on to the next thing.
    ego = get_ego_vehicle()
    set_desired_time_headway(0.2)
    for _ in range(500):
        lead = detect_front_vehicle_in(get_lane_of(ego), 200.0)
        if lead is None or get_distance_between_vehicles(lead, ego) < {gap}:
            break
        set_target_speed(get_speed_of(lead) + 4.0)
        yield autopilot()


{rest}

def in_this_order():
    # One after the other.
    yield from reach_gap()
    yield from {function}()
"""
"""The exemplar for a gap keeps it for ever; before another step it only has to be reached."""
_FUNCTION = re.compile(r"^def (\w+)\(\):$", re.MULTILINE)


def _gap_first(goal: dict[str, Any], situation: Situation) -> tuple[str, ...]:
    """Programs for a gap to be closed and then other steps."""
    gap = 1.2 * float(goal["steps"][0]["distance"])
    rest = goal["steps"][1:]
    after = rest[0] if len(rest) == 1 else goal | {"steps": rest}
    return tuple(
        _REACH_GAP.format(gap=round(gap, 1), rest=program, function=_FUNCTION.findall(program)[-1])
        for program in _exemplars(after, situation)
    )


def _no_leaning(family: str) -> Leaning:
    del family
    return Leaning()


def _ways(goal: dict[str, Any]) -> list[tuple[Meaning, ...]]:
    """Meanings that fulfil a goal."""
    if goal["type"] == "SequenceEval":
        steps = [meaning_of(step) for step in goal["steps"]]
        return [tuple(step for step in steps if step is not None)] if None not in steps else []
    meaning = meaning_of(goal)
    if meaning is None:
        return []
    ways = [(meaning,)]
    if goal["type"] == "ChangeEval" and meaning.manoeuvre == "speed" and meaning.change > 0:
        # Held up by a lead vehicle: closing up, or getting past.
        ways += [(Meaning("style", variant="hurry"),), (Meaning("overtake"),)]
    if goal["type"] == "OvertakeEval":
        ways.append((replace(meaning, manner="swift"),))
    return ways
