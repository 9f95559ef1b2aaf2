"""The papers' rule-based baseline: lists of substrings, each with a fixed answer (Talk2Drive's baseline condition).

It is kept as a baseline to compare with, faults included: it looks for substrings, is blind to "not", to case and to
word borders, and knows no numbers. "Do not speed up" makes it faster, "Is that right?" changes lanes, "It is breakfast
time" contains "fast". Its original controls a vehicle by scripts with fixed numbers; here the same rules write programs
over the driving APIs with the same numbers, 40, 50 and 30 km/h on a highway and 20, 30 and 15 km/h at an intersection.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from string import Template

from chauffeur.concept import Plan, PlanRequest, Program
from chauffeur.concept.units import MPS_PER_KMH
from chauffeur.planners.base import no_argument, planned
from chauffeur.planners.onboard.exemplars.texts import programs

VERSION = "keyword-v1"


@dataclass(frozen=True, slots=True)
class _Rule:
    """Any of the substrings in the text means the intent."""

    substrings: tuple[str, ...]
    intent: str


_HIGHWAY = (
    _Rule(("left",), "lane.left"),
    _Rule(("right",), "lane.right"),
    _Rule(("fast", "speed up", "hurry", "accelerate", "quick", "rush", "late"), "speed.increase"),
    _Rule(("slow", "brake", "decelerate", "careful", "sick"), "speed.decrease"),
)
_INTERSECTION = (
    _Rule(("stop", "yield"), "stop"),
    _Rule(("turn right", "right turn"), "turn.right"),
    _Rule(("turn", "left"), "turn.left"),
    _Rule(("straight",), "turn.straight"),
    _Rule(("fast", "speed up", "hurry", "accelerate", "quick", "rush", "late"), "speed.increase"),
    _Rule(("slow", "brake", "decelerate", "careful", "sick"), "speed.decrease"),
)
"""First rule that matches wins."""

_SPEEDS_KMH = {
    "highway": {"speed.increase": 50.0, "speed.decrease": 30.0, "": 40.0},
    "intersection": {"speed.increase": 30.0, "speed.decrease": 15.0, "": 20.0},
}

_TURN_APIS = {
    "turn.left": "turn_left_at_next_intersection",
    "turn.right": "turn_right_at_next_intersection",
    "turn.straight": "go_straight_at_next_intersection",
}


class KeywordPlanner:
    """Baseline planner: substring rules with fixed numbers."""

    @classmethod
    def from_spec(cls, argument: str) -> KeywordPlanner:
        """The planner named `keyword`. Raises ConfigError for an argument: it has no variants."""
        no_argument("keyword", argument)
        return cls()

    @property
    def id(self) -> str:
        """Registry name."""
        return "keyword"

    @property
    def model(self) -> str:
        """Rule set with its version."""
        return VERSION

    async def plan(self, request: PlanRequest) -> Plan:
        """One plan by the first rule whose substring occurs; without one the speed stays what the scenario sets."""
        begun = time.perf_counter()
        text = request.instruction.text
        world = "intersection" if request.context.situation.world == "intersection" else "highway"
        intent, found = keyword_intent(text, world)
        speeds = _SPEEDS_KMH[world]
        speed = speeds.get(intent, speeds[""]) * MPS_PER_KMH
        settings = (("target_speed_mps", 0.0 if intent == "stop" else round(speed, 2)),)
        if found:
            thoughts = f'The words contain "{found}", and the rule for it is {intent}.'
        else:
            thoughts = f"No rule matches; the fixed speed for this road is {speed:.2f} m/s."
        return planned(self, thoughts, Program(_program(intent, speed)), begun, intent=intent, settings=settings)


def keyword_intent(text: str, world: str) -> tuple[str, str]:
    """Intent of the first rule that matches and the substring that did; empty strings when none does."""
    for rule in _INTERSECTION if world == "intersection" else _HIGHWAY:
        for substring in rule.substrings:
            if substring in text:
                return rule.intent, substring
    return "", ""


def _program(intent: str, speed_mps: float) -> str:
    kind, _, side = intent.partition(".")
    text = programs("chauffeur.planners", "keyword")[kind if kind in ("turn", "lane", "stop") else "speed"]
    return Template(text).substitute(speed=f"{speed_mps:.2f}", side=side, api=_TURN_APIS.get(intent, ""))
