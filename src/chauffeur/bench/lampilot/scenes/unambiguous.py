"""Check that words say exactly one goal: they are read back by rules and by Chauffeur's own understanding.

Two readers that know nothing of how the words were made must agree with the meaning: plain rules here (sides, numbers,
units, whether a number is the new value or a difference) and `planners.onboard`, which must find exactly the goal and
nothing beside it. What fails is not used.
"""

from __future__ import annotations

import re
from typing import Any

from chauffeur.bench.lampilot.scenes.wishes import Named, SceneWish
from chauffeur.language import read_quantities
from chauffeur.language.quantities import mark_quantities
from chauffeur.language.tokens import plain, tokens_of
from chauffeur.planners.onboard.meaning import Amount, Manoeuvre, Meaning, Side
from chauffeur.planners.onboard.understand import meanings_said

MIN_WORDS, MAX_WORDS = 2, 14
"""Of LaMPilot's instructions (Tab. III)."""

_EXITS: dict[str, Side] = {"il1": "left", "il2": "straight", "il3": "right"}
_SIDE = re.compile(r"\b(left|right)\b")
_NOT_A_SIDE = re.compile(r"\b(?:right (?:now|away|here)|all right|alright)\b")
_DIFFERENCE_BEFORE = re.compile(
    r"\b(?:by|another|extra|add|adding|subtract|deduct|take|takes|knock|shave|lose|gain|shed|trim|pick up|put|put on"
    r"|scrub off|catch up|take off)(?: (?:by|about|another|an extra)){0,4} $"
)
_DIFFERENCE_BEHIND = re.compile(
    r"^#\d+ (?:of (?:extra|speed)|more|less|closer|nearer|further|farther|faster|slower|shorter|smaller|tighter|longer"
    r"|bigger|wider|higher|lower|off|extra)\b"
)
_FOUR_WAY = re.compile(r"\bfour-way\b", re.IGNORECASE)
"""A number that counts nothing the car is to do."""


def words_of(text: str) -> int:
    """Length as LaMPilot counts it: pieces between spaces."""
    return len(text.split())


def fault_of(text: str, wish: SceneWish, max_words: int = MAX_WORDS) -> str:
    """Reason why words do not say exactly this wish, short enough for counting; empty if they do."""
    if not MIN_WORDS <= words_of(text) <= max_words:
        return "length"
    if len(wish.means) == 1:
        return fault_of_goal(text, wish.means[0], wish.change)
    return _fault_of_steps(text, wish)


def fault_of_goal(text: str, goal: dict[str, Any], change: int = 0) -> str:
    """Reason why words do not say exactly this one goal; empty if they do.

    Args:
        text: The words.
        goal: Condition of one kind.
        change: Whether the scene needs more (+1) or less (-1) of the speed or gap for it; 0 when that is not known.
    """
    expected = meaning_of(goal)
    if expected is None:
        return "no such goal"
    by_rule = _rules(text, goal, expected)
    if by_rule:
        return by_rule
    meanings = meanings_said(text)
    if len(meanings) != 1:
        return "more than one wish" if meanings else "not understood"
    found = meanings[0]
    if found.change * change < 0:
        return "says more where less is needed, or less for more"
    return _differs(found, expected)


def _fault_of_steps(text: str, wish: SceneWish) -> str:
    if not wish.means:
        return ""
    found, wanted = meanings_said(text), [meaning_of(goal) for goal in wish.means]
    if not found:
        return "not understood"
    if len(found) != len(wanted):
        return "other number of steps"
    for one, expected in zip(found, wanted, strict=True):
        if expected is None:
            return "no such goal"
        fault = _differs(one, expected)
        if fault:
            return fault
    named = sorted(value.si for _, value in wish.slots if isinstance(value, Named))
    said = sorted(q.value for q in read_quantities(text) if q.dimension in ("speed", "distance"))
    return "" if _same(said, named) else "number or unit"


def meaning_of(goal: dict[str, Any]) -> Meaning | None:
    """A goal as a meaning of `planners.onboard`; None for a goal that is not one thing to do."""
    kind = goal.get("type")
    if kind == "ACCEvalbySpeed" or (kind == "ReachEval" and goal.keys() & {"speed", "rel_speed"}):
        return _quantified("speed", goal, "speed", "rel_speed")
    if kind in ("ACCEvalbyDistance", "ReachEval"):
        return _quantified("gap", goal, "distance", "rel_distance")
    if kind == "LaneChangeEval":
        return Meaning("lane", direction=goal["direction"])
    if kind == "OvertakeEval":
        return Meaning("overtake", direction=goal.get("direction"))
    if kind == "PullOverEval":
        return Meaning("pull_over")
    if kind == "IntersectionEval":
        return Meaning("turn", direction=_EXITS[str(goal["direction"][0])])
    if kind == "ChangeEval":
        return Meaning("speed" if goal["quantity"] == "speed" else "gap", change=goal["change"])
    return None


def _quantified(manoeuvre: Manoeuvre, goal: dict[str, Any], absolute: str, relative: str) -> Meaning:
    dimension = "speed" if manoeuvre == "speed" else "distance"
    if absolute in goal:
        return Meaning(manoeuvre, amount=Amount(float(goal[absolute]), dimension))
    value = float(goal[relative])
    return Meaning(manoeuvre, change=1 if value > 0 else -1, amount=Amount(abs(value), dimension, "relative"))


def sides_in(text: str) -> set[str]:
    """Left and right as directions; "right now" is none."""
    return set(_SIDE.findall(_NOT_A_SIDE.sub(" ", plain(text))))


def _rules(text: str, goal: dict[str, Any], expected: Meaning) -> str:
    quantities = [q for q in read_quantities(_FOUR_WAY.sub("", text)) if q.dimension != "lanes"]
    if expected.amount is None:
        if any(q.dimension != "other" for q in quantities):
            return "a number too many"
    else:
        if len(quantities) != 1:
            return "number or unit"
        if quantities[0].dimension != expected.amount.dimension:
            return "number or unit"
        if not _same([quantities[0].value], [expected.amount.value]):
            return "number or unit"
        if _says_difference(text) != (expected.amount.frame == "relative"):
            return "absolute or relative"
    said = sides_in(text)
    wanted: set[str] = {expected.direction} if expected.direction in ("left", "right") else set()
    if goal["type"] == "PullOverEval":
        wanted = said & {"right"}  # the emergency lane is on the right
    if goal["type"] == "IntersectionEval" and expected.direction == "straight" and said == {"left", "right"}:
        wanted = said  # "neither left nor right"
    return "" if said == wanted else "side"


def _says_difference(text: str) -> bool:
    """True if the number is a difference ("by 10", "10 closer") and not the new value ("to 10")."""
    marked, found = mark_quantities(tokens_of(text))
    line = " ".join(marked)
    at = line.find("#")
    if at < 0:
        return False
    if found[0].inner:  # "10 more meters"
        return True
    return bool(_DIFFERENCE_BEFORE.search(line[:at]) or _DIFFERENCE_BEHIND.match(line[at:]))


def _differs(found: Meaning, expected: Meaning) -> str:
    """Difference between the meaning found in the words and the one expected; empty for none."""
    if found.manoeuvre != expected.manoeuvre:
        return f"read as {found.family}"
    if found.variant not in ("", "hint", "return"):
        return f"read as {found.family} {found.variant}"
    if expected.direction is not None and found.direction != expected.direction:
        return "read with another side"
    if expected.amount is None:
        if found.amount is not None and found.amount.dimension != "lanes":
            return "read with a number"
        return "" if found.change == expected.change else "read with another sign"
    if found.amount is None:
        return "read without its number"
    if found.amount.bound != "exact" or found.amount.frame != expected.amount.frame:
        return f"read as {found.amount.bound} {found.amount.frame}"
    if not _same([found.amount.value], [expected.amount.value]):
        return "read with another number"
    if expected.change and found.change != expected.change:
        return "read with another sign"
    return ""


def _same(a: list[float], b: list[float]) -> bool:
    return len(a) == len(b) and all(abs(x - y) <= 1e-6 + 1e-6 * abs(y) for x, y in zip(a, b, strict=True))
