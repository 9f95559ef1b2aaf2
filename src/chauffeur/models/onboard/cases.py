"""Cases: a scene, what is wished in it as a program, and the proof that the program does it there.

A case has no words yet. It is drawn so that the wish makes sense at the first instant of the scene; its program is
linked and driven, and only what it does becomes training data. A wish that the road does not allow is a case as well:
its answer is a refusal with the reason that linking gave.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any, Final

import numpy as np
from pydantic import TypeAdapter

from chauffeur.bench.lampilot.rehearse import unhurried_sandbox
from chauffeur.bench.lampilot.scenes.feasible import start_of
from chauffeur.bench.lampilot.scenes.kinds import KINDS
from chauffeur.concept import LAMPILOT_LIMITS, Scenario, ScenarioError, Situation
from chauffeur.describe import describe
from chauffeur.models.onboard.skill_judge import judge
from chauffeur.planners.onboard.dialect import SKILLS, UNITS, DialectStep, Number, StepCondition, write
from chauffeur.planners.onboard.link import link
from chauffeur.planners.onboard.options import Declined
from chauffeur.planners.onboard.personal import Leaning
from chauffeur.worlds.highway import HighwayWorld

Generator = np.random.Generator

HIGHWAYS: Final = (
    "dec_abs_dis",
    "inc_abs_dis",
    "dec_abs_speed",
    "left_lc",
    "right_lc",
    "left_overtake",
    "pull_over",
    "ask_side",
)
CROSSING: Final = "turn_left"
CROSSING_SHARE: Final = 0.22
IMPOSSIBLE_SHARE: Final = 0.3
"""Share of draws that are kept although the road does not allow them."""
SEVERAL_SHARE: Final = 0.15
CONDITION_SHARE: Final = 0.08
WAIT_SHARE: Final = 0.03
MANNER_SHARE: Final = 0.05
FACTORS: Final = (0.5, 0.6, 0.75, 0.8, 0.9, 1.1, 1.2, 1.25, 1.5, 2.0)

WEIGHTS: Final[dict[str, float]] = {
    **dict.fromkeys(SKILLS, 1.0),
    **dict.fromkeys(("drive_at", "faster_by", "slower_by", "gap_of", "closer_by", "further_by"), 5.0),
    **dict.fromkeys(("lane_left", "lane_right", "overtake_left", "overtake_right", "pull_over"), 4.0),
    **dict.fromkeys(("faster", "slower", "further", "closer"), 3.0),
    **dict.fromkeys(("hurry", "relax", "gently", "carefully"), 6.0),
    **dict.fromkeys(("sportily", "economically", "overtake"), 4.0),
    **dict.fromkeys(("a_bit_faster", "a_bit_slower", "much_faster", "much_slower", "let_in", "stop_here"), 2.0),
}
"""Weight of drawing a skill on a highway, before what does not fit is left out."""
CROSSING_WEIGHTS: Final[dict[str, float]] = {
    **dict.fromkeys(("turn_left", "turn_right", "go_straight"), 6.0),
    **dict.fromkeys(
        ("slower", "a_bit_slower", "gently", "carefully", "hurry", "stop_here", "drive_at", "lane_left"), 0.4
    ),
}


@dataclass(frozen=True, slots=True)
class Case:
    """A case.

    Attributes:
        index: Its number in the data set.
        scenario: Scene, without a goal.
        situation: What C says of its first instant.
        steps: What is wished.
        refusal: Why it is not possible here; empty when it is, and then it was driven and did it.
    """

    index: int
    scenario: dict[str, Any]
    situation: Situation
    steps: tuple[DialectStep, ...]
    refusal: str


def make_case(job: tuple[int, int]) -> dict[str, Any]:
    """A case as a JSON row, or why none came of a draw: `{"left_out": ...}`.

    Args:
        job: (Seed of the data set, number of the draw).
    """
    seed, index = job
    rng = np.random.default_rng([seed, 17, index])
    crossing = rng.random() < CROSSING_SHARE
    kind = CROSSING if crossing else HIGHWAYS[int(rng.integers(len(HIGHWAYS)))]
    scenario = Scenario(
        id=f"case-{index}", world="highway", config=KINDS[kind].road(rng), goal={}, seed=int(rng.integers(2**31))
    )
    world = HighwayWorld()
    start = start_of(world, scenario)
    if isinstance(start, str):
        return {"left_out": start}
    situation = describe(start).situation
    steps = _draw(situation, crossing, rng)
    if steps is None:
        return {"left_out": "nothing to wish for"}
    linked = link(steps, situation, LAMPILOT_LIMITS, lambda _: Leaning())
    row = {
        "index": index,
        "scenario": asdict(scenario),
        "situation": asdict(situation),
        "steps": [asdict(s) for s in steps],
    }
    if isinstance(linked, Declined):
        return row | {"refusal": linked.words} if rng.random() < IMPOSSIBLE_SHARE else {"left_out": "not possible here"}
    try:
        verdict = judge(world, scenario, steps, write(steps), linked, unhurried_sandbox())
    except ScenarioError as error:
        return {"left_out": error.message[:60]}
    return row | {"refusal": ""} if verdict.done else {"left_out": verdict.why}


def case_of(row: dict[str, Any]) -> Case:
    """A stored row as a case."""
    return _stored_cases().validate_python(row)


@cache
def _stored_cases() -> TypeAdapter[Case]:
    return TypeAdapter(Case)


def _draw(situation: Situation, crossing: bool, rng: Generator) -> tuple[DialectStep, ...] | None:
    count = 1 if rng.random() > SEVERAL_SHARE else 2 if rng.random() < 0.8 else 3
    steps: list[DialectStep] = []
    for _ in range(12):
        step = _draw_step(situation, crossing, rng)
        if step is not None and all(_apart(step, other) for other in steps):
            steps.append(step)
        if len(steps) == count:
            return tuple(steps)
    return None


def _apart(step: DialectStep, other: DialectStep) -> bool:
    """True if two steps of a wish are about different things; styles and keeping end a wish by themselves."""
    kinds = {SKILLS[step.skill].meaning.manoeuvre, SKILLS[other.skill].meaning.manoeuvre}
    return len(kinds) == 2 and not kinds & {"style", "keep", "resume", "turn", "stop", "follow", "yield"}


def _draw_step(situation: Situation, crossing: bool, rng: Generator) -> DialectStep | None:
    weights = CROSSING_WEIGHTS if crossing else WEIGHTS
    names = list(weights)
    share = np.array([weights[name] for name in names])
    name = names[int(rng.choice(len(names), p=share / share.sum()))]
    takes = SKILLS[name].takes
    number = None if takes is None else _DRAWERS.get(name, _no_number)(situation, rng)
    if takes is not None and number is None:
        return None
    manner = ""
    if name in _WITH_MANNER and rng.random() < MANNER_SHARE:
        manner = "gently" if rng.random() < 0.5 else "quickly"
    wait = Number(float(rng.integers(3, 31))) if rng.random() < WAIT_SHARE and not crossing else None
    condition = None
    if wait is None and not crossing and rng.random() < CONDITION_SHARE:
        condition = _draw_condition(situation, name, rng)
    return DialectStep(name, number, manner, wait, condition)


_WITH_MANNER = frozenset(
    ("drive_at", "slower", "faster", "closer", "further", "lane_left", "lane_right", "overtake_left", "overtake_right",
     "pull_over", "turn_left", "turn_right", "go_straight", "stop_here", "slower_by", "faster_by")
)  # fmt: skip


def _draw_condition(situation: Situation, skill: str, rng: Generator) -> StepCondition | None:
    how = "if" if rng.random() < 0.5 else "once"
    front = situation.front
    if skill in ("lane_left", "overtake_left", "lanes_left"):
        return StepCondition(how, "clear_left")
    if skill in ("lane_right", "overtake_right", "lanes_right"):
        return StepCondition(how, "clear_right")
    if front is None:
        return None
    if rng.random() < 0.4:
        number = _measure(rng, front.speed_mps * float(rng.uniform(0.8, 1.2)), "speed")
        return StepCondition(how, "lead_slower_than", number)
    number = _measure(rng, front.distance_m * float(rng.uniform(0.7, 1.3)), "distance")
    return StepCondition(how, "lead_closer_than" if rng.random() < 0.6 else "lead_further_than", number)


def _measure(rng: Generator, si: float, kind: str) -> Number:
    """About a value, as people name it: a whole number of a usual unit, mostly a round one."""
    units = [""] * 5 + (
        ["mph", "mph", "mph", "kmh", "kmh"] if kind == "speed" else ["feet", "feet", "yards", "car_lengths"]
    )
    unit = units[int(rng.integers(len(units)))]
    value = si / (UNITS[unit][1] if unit else 1.0)
    step = 5.0 if value > 20 and rng.random() < 0.5 else 1.0
    value = max(1.0, step * round(value / step))
    if value < 12 and rng.random() < 0.06:
        value += 0.5
    return Number(value, unit)


Drawer = Callable[[Situation, Generator], "Number | None"]


def _speed_to(low: float, high: float) -> Drawer:
    def draw(situation: Situation, rng: Generator) -> Number | None:
        del situation
        return _measure(rng, float(rng.uniform(low, high)), "speed")

    return draw


def _set_speed(situation: Situation, rng: Generator) -> Number | None:
    top = situation.speed_limit_mps + 5.0
    return _measure(rng, float(rng.uniform(min(6.0, situation.speed_mps), top)), "speed")


def _speed_by(sign: int) -> Drawer:
    def draw(situation: Situation, rng: Generator) -> Number | None:
        room = situation.speed_limit_mps + 6.0 - situation.speed_mps if sign > 0 else situation.speed_mps - 5.0
        return None if room < 1.5 else _measure(rng, float(rng.uniform(1.0, min(room, 14.0))), "speed")

    return draw


def _gap_to(low: float, high: float) -> Drawer:
    def draw(situation: Situation, rng: Generator) -> Number | None:
        return None if situation.front is None else _measure(rng, float(rng.uniform(low, high)), "distance")

    return draw


def _gap_by(sign: int) -> Drawer:
    def draw(situation: Situation, rng: Generator) -> Number | None:
        if situation.front is None:
            return None
        room = 80.0 - situation.front.distance_m if sign > 0 else situation.front.distance_m - 12.0
        return None if room < 3.0 else _measure(rng, float(rng.uniform(2.0, min(room, 40.0))), "distance")

    return draw


def _seconds(situation: Situation, rng: Generator) -> Number | None:
    del situation
    return Number(float(rng.choice((1.0, 1.5, 2.0, 2.5, 3.0))))


def _factor(situation: Situation, rng: Generator) -> Number | None:
    del situation
    return Number(float(rng.choice(FACTORS)))


def _lanes(situation: Situation, rng: Generator) -> Number | None:
    del situation
    return Number(float(rng.integers(2, 4)))


def _no_number(situation: Situation, rng: Generator) -> Number | None:
    del situation, rng
    return None


_DRAWERS: Final[dict[str, Drawer]] = {
    "drive_at": _set_speed,
    "faster_by": _speed_by(1),
    "slower_by": _speed_by(-1),
    "at_most": _set_speed,
    "at_least": _set_speed,
    "over_limit_by": _speed_to(1.0, 5.0),
    "under_limit_by": _speed_to(1.0, 8.0),
    "speed_times": _factor,
    "gap_of": _gap_to(12.0, 78.0),
    "closer_by": _gap_by(-1),
    "further_by": _gap_by(1),
    "gap_of_seconds": _seconds,
    "gap_at_least": _gap_to(12.0, 70.0),
    "gap_at_most": _gap_to(20.0, 80.0),
    "gap_times": _factor,
    "lanes_left": _lanes,
    "lanes_right": _lanes,
}
