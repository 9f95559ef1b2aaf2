"""The expert's program for a goal, and variants of it.

A program is closed-loop and the same for all samples of a family: what it knows of a sample is the goal (LaMPilot's
`eval` mapping: what kind, and its number or side); everything else it learns from the driving APIs while it drives.
What all samples of a family share it knows, too: the layout of LaMPilot's crossing, the vehicle model, the ruler.

Three things make the programs better drivers than plain use of the APIs:

* LaMPilot's autopilot follows the intelligent driver model, which can be solved for the target speed: with the shortest
  headway, `set_target_speed(v / (1 - a/30 - (wanted gap / gap)^2)^(1/4))` brings any acceleration a up to 5 m/s2, so
  speeds are changed at once and then kept, with little variance.
* LaMPilot's time to collision counts cars in every lane, and is read ten times a second. A car that passes, or is
  passed, brings it to some value from 0 to 0.1 s just before the two are level; which one is a matter of the phase
  between the pass and the clock. The programs change their speed a little beforehand, so that a pass comes at the end
  of a period: 85 points or more instead of 60 on average. It is the metric that is served by this, not a passenger.
* At the crossing they stop at the sign (below 1 m/s, lawfully, although no score asks for it) and go once the braking
  that `is_safe_enter` foresees of the next car says that there is time; from the turn on they keep above 6 m/s, below
  which LaMPilot's vehicle model is numerically unstable and its heading never settles.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from string import Template
from typing import Any, Final

import numpy as np

from chauffeur.concept import ScenarioError
from chauffeur.planners.onboard.exemplars import texts
from chauffeur.planners.onboard.exemplars.crossing import CROSSING

PROGRAMS = ("distance", "speed", "lane", "overtake", "pull_over", "cross")
_SHARED = "chauffeur.planners.onboard.exemplars"


def filled(name: str, values: Mapping[str, str]) -> str:
    """A program's text. Raises KeyError for an unknown program or a value that is missing."""
    return Template(_texts()[name]).substitute(values)


def open_names(name: str) -> frozenset[str]:
    """Names of the values a program's text asks for."""
    return frozenset(Template(_texts()[name]).get_identifiers())


@cache
def _texts() -> Mapping[str, str]:
    own = texts.read_texts("chauffeur.bench.lampilot.expert", PROGRAMS[:-1], _SHARED)
    return {**own, **texts.read_texts(_SHARED, ("crossing",), _SHARED)}


_NUMBERS: Final[dict[str, Any]] = json.loads(Path(__file__).with_name("numbers.json").read_text(encoding="utf-8"))

TUNED: Final[dict[str, dict[str, float]]] = {
    **_NUMBERS["tuned"],
    **{side: CROSSING[side] | {"END": -1e5} for side in CROSSING},
}
"""By style: `closer` and `wider` keep a distance, `slow` and `speed` a speed; then the manoeuvres and the turns."""

SPREAD: Final[dict[str, dict[str, tuple[float, float]]]] = {
    style: {name: (low, high) for name, (low, high) in row.items()} for style, row in _NUMBERS["spread"].items()
}
"""From where to where a number goes in variants."""

EXPERT: Final = "expert-v1"
"""Changes whenever a program or a number of it does."""

_TURNS: Final = {"o1": "left", "o2": "straight", "o3": "right"}
"""Exits of the intersection, seen by the ego that comes from the south."""


def expert_program(goal: Mapping[str, Any], changed: Mapping[str, float] | None = None) -> str:
    """Text of the program for a goal.

    Args:
        goal: A DbLv1 `eval` mapping.
        changed: Numbers in the place of the tuned ones (`numbers.TUNED`); those the program does not have are ignored.

    Raises:
        ScenarioError: There is no program for such a goal, or it is malformed.
    """
    style, text, words = _what(goal)
    return filled(text, words | _written(TUNED[style] | dict(changed or {})))


def variants(goal: Mapping[str, Any], count: int, seed: int) -> list[str]:
    """The program for a goal and others like it with other numbers (speeds, margins, phases), the program itself first.

    They all differ. The same goal, count and seed give the same texts; a smaller count gives the first of them.

    Raises:
        ScenarioError: As `expert_program`.
    """
    style, text, words = _what(goal)
    rng = np.random.default_rng([seed, sum(style.encode())])
    out = [filled(text, words | _written(TUNED[style]))]
    while len(out) < count:
        variant = filled(text, words | _written(_drawn(style, rng)))
        if variant not in out:
            out.append(variant)
    return out


def _drawn(style: str, rng: np.random.Generator) -> dict[str, float]:
    """Numbers near the tuned ones: about half of those that may vary do."""
    numbers = dict(TUNED[style])
    for name, (low, high) in SPREAD[style].items():
        chance, value = rng.random(), rng.uniform(low, high)
        if chance < 0.5:
            numbers[name] = round(float(value), 3)
    return numbers


def _written(numbers: Mapping[str, float]) -> dict[str, str]:
    return {name: repr(float(value)) for name, value in numbers.items()}


def _what(goal: Mapping[str, Any]) -> tuple[str, str, dict[str, str]]:
    """(which numbers, which text, words of the goal) for a goal."""
    kind = goal.get("type")
    try:
        if kind == "ACCEvalbyDistance":
            change = float(goal["rel_distance"]) if "rel_distance" in goal else None
            wider = change > 0.0 if change is not None else float(goal["distance"]) > _WIDE_M
            wanted = f"start + {change!r}" if change is not None else repr(float(goal["distance"]))
            return ("wider" if wider else "closer"), "distance", {"GOAL": wanted}
        if kind == "ACCEvalbySpeed":
            if "speed" in goal:
                speed = float(goal["speed"])
                return ("slow" if speed < _SLOW_MPS else "speed"), "speed", {"GOAL": repr(speed)}
            return "speed", "speed", {"GOAL": f"start + {float(goal['rel_speed'])!r}"}
        if kind in ("LaneChangeEval", "OvertakeEval"):
            name = "lane" if kind == "LaneChangeEval" else "overtake"
            side = str(goal["direction"])
            if side in ("left", "right"):
                return name, name, {"SIDE": side}
        if kind == "PullOverEval":
            return "pull_over", "pull_over", {}
        if kind == "IntersectionEval":
            turn = _TURNS[goal["direction"][1]]
            return turn, ("cross" if turn == "straight" else "turn"), {"TURN": f"turn_{turn}"}
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise ScenarioError(f"Goal {dict(goal)} is malformed.") from error
    raise ScenarioError(f"The expert has no program for the goal {dict(goal)}.")


_WIDE_M: Final = 40.0
"""A wanted gap beyond this mostly asks for dropping back."""
_SLOW_MPS: Final = 20.0
"""A wanted speed below this is far below that of all traffic."""
