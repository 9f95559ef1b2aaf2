"""What a free drive is judged by: the reading of the words; where that is unsure or finds nothing, the plan's acts."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Final

from chauffeur.concept import JudgedBy, Parameters, Plan, Program
from chauffeur.concept.utterance import Act, Direction, Measure, Side, Style, Utterance, Verb
from chauffeur.driving.judge.acts import can_be_judged, wanted
from chauffeur.language.meaning.reader import read
from chauffeur.safety.constant_calls import read_program

SURE: Final = 0.5
"""Below this a reading is more likely wrong than right, and nothing is judged by it."""
_VERBS: Final[Mapping[str, Verb]] = {
    "turn": "turn", "way": "turn", "straight": "straight", "lane": "lane", "over": "lane", "overtake": "pass",
    "pull_over": "pull_over", "stop": "stop", "park": "park", "go_to": "goto", "speed": "speed", "style": "speed",
    "gap": "gap", "follow": "follow", "yield": "yield", "wait": "wait", "keep": "keep", "resume": "speed", "on": "go",
}  # fmt: skip
"""First word of a part of `Plan.intent`, and the act it is."""
_CALLS: Final[Mapping[str, Act]] = {
    "turn_left_at_next_intersection": Act("turn", side="left"),
    "turn_right_at_next_intersection": Act("turn", side="right"),
    "go_straight_at_next_intersection": Act("straight"),
    "change_lane_left": Act("lane", side="left"),
    "change_lane_right": Act("lane", side="right"),
    "stop": Act("stop"),
}
_MEASURES: Final[Mapping[str, Measure]] = {"cap": "at_most", "floor": "at_least"}
_DIRECTIONS: Final[Mapping[str, tuple[Direction, Direction]]] = {"speed": ("slower", "faster"), "gap": ("less", "more")}
_SIGNS: Final = {"decrease": 0, "down": 0, "closer": 0, "increase": 1, "up": 1, "wider": 1}
_STYLES: Final[Mapping[str, Style]] = {
    "hurry": "hurry", "relax": "relaxed", "careful": "careful", "comfort": "gentle", "eco": "economical",
    "sporty": "sporty",
}  # fmt: skip


@lru_cache(maxsize=64)
def heard(wish: str) -> Utterance:
    """The reading of words, kept: it is asked for before, in and after a drive."""
    return read(wish)


def acts_for(plan: Plan, wish: str) -> tuple[tuple[Act, ...], JudgedBy]:
    """Acts to judge a drive by, and whose they are; none where nothing is known by which one can be judged."""
    reading = heard(wish)
    asked = wanted(reading.acts)
    if reading.sure >= SURE and any(can_be_judged(act) for act in asked):
        return asked, "reading"
    claimed = wanted(plan.acts) or acts_of(plan)
    return (claimed if any(can_be_judged(act) for act in claimed) else ()), "plan"


def acts_of(plan: Plan) -> tuple[Act, ...]:
    """What a plan does that does not say so in acts: by its intent, or else by its program's calls and its route."""
    if plan.intent:
        tags = [tag.replace(".", " ", 1).partition(" ") for tag in plan.intent.split("+") if tag]
        numbers = dict(plan.settings)
        return tuple(act for kind, _, detail in tags if (act := _of_tag(kind, detail, numbers)) is not None)
    if isinstance(plan.policy, Program):
        calls = (_CALLS.get(use.name) for use in read_program(plan.policy.source).uses)
        return tuple(dict.fromkeys(act for act in calls if act is not None))
    if isinstance(plan.policy, Parameters):
        route: dict[str, Act] = {
            "left": Act("turn", side="left"), "right": Act("turn", side="right"), "straight": Act("straight"),
        }  # fmt: skip
        stands = not plan.policy.route and plan.policy.target_speed_mps <= 0.0
        found = Act("stop") if stands else route.get(plan.policy.route)
        return () if found is None else (found,)
    return ()


def _of_tag(kind: str, detail: str, numbers: Mapping[str, float]) -> Act | None:
    """An act of a part of an intent; of a number, as the plan sets it."""
    verb = _VERBS.get(kind)
    if verb is None:
        return None
    side: Side | None = "left" if detail == "left" else "right" if detail == "right" else None
    match verb:
        case "turn" if detail == "straight":
            return Act("straight")
        case "speed" if kind == "style":
            return Act("speed", style=_STYLES.get(detail, "normal"))
        case "lane" if detail in ("keep", "return"):
            return Act("keep") if detail == "keep" else Act("lane", to="original")
        case "speed" | "gap":
            sign = next((sign for mark, sign in _SIGNS.items() if mark in detail), None)
            direction = None if sign is None else _DIRECTIONS[verb][sign]
            numbered = numbers.keys() & ({"target_speed_mps"} if verb == "speed" else {"gap_m", "time_headway_s"})
            return Act(verb, measure=_MEASURES.get(detail), direction=direction) if numbered or direction else None
        case _:
            return Act(verb, side=side)
