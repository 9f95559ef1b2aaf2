"""Claims about lanes, overtaking, ways over an intersection, and stopping, and the sides they name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from chauffeur.safety.faithfulness import lexicon as words
from chauffeur.safety.faithfulness.claim import Claim, clause_quantities
from chauffeur.safety.faithfulness.clauses import ExplainedClause

_SLOWING: Final = words.DOWN | words.SPEEDS | words.LOWER
_NO_STOPS: Final = ("stop sign", "stop line", "stands for")
_CHANGING: Final = words.MOVES - words.listed("make makes get gets over take takes target enter")
"""Words of a change of lanes beside those of a look."""
_OUTERMOST: Final = words.listed("leftmost rightmost")
_LANE_OR_SIDE: Final = words.listed("lane side")


def motions(
    clause: ExplainedClause, base: Claim, sides: frozenset[int], *, crossing: bool, checking: bool = False
) -> Iterator[Claim]:
    """What a clause claims of lanes, overtaking, turns and stops.

    Args:
        clause: The clause.
        base: A claim with what all claims of the clause share.
        sides: The sides it names.
        crossing: Whether the way leads over an intersection.
        checking: Whether the clause speaks of looking if a way is free.
    """
    said = set(clause.words)
    junction = crossing or clause.has(words.JUNCTIONS)
    if _pulls_over(clause):
        yield replace(base, matter="pull over", sides=sides)
    if _overtakes(clause):
        yield replace(base, matter="overtake", sides=sides)
        return
    if _returns(clause):
        yield replace(base, matter="back", sides=sides)
        return
    zero = clause.has(_SLOWING) and any(q.value == 0.0 and q.dimension == "bare" for q in clause_quantities(clause))
    if (_stops(clause) or zero) and not clause.says(*_NO_STOPS) and "behind" not in said:
        yield replace(base, matter="stop", exact=clause.has(words.KEEPS) or clause.says("for good"))
    if junction and "lane" not in said:
        if "straight" in said:
            yield replace(base, matter="turn", sides=frozenset({0}))
        elif not sides and "cross" in said and not clause.negated:
            yield replace(base, matter="turn", aside=True)
        elif sides and (clause.has(words.TURNS) or len(clause.words) <= 5):
            yield replace(base, matter="turn", sides=sides)
        return
    if checking and not clause.has(_CHANGING):
        return
    edge = clause.has(_OUTERMOST) or clause.says("all the way")
    moving = clause.has(words.MOVES) or clause.has(_LANE_OR_SIDE)
    if sides and (moving or _count(clause) or len(clause.words) <= 6):
        yield replace(base, matter="lane", sides=sides, count=99 if edge else _count(clause))
    elif not sides and _changes_lanes(clause):
        yield replace(base, matter="lane", count=_count(clause))
    elif not sides and not clause.negated and _mentions_lane(clause):
        yield replace(base, matter="lane", aside=True)


_ENTERING_IT: Final = ("take it", "use it", "enter it")


def _mentions_lane(clause: ExplainedClause) -> bool:
    """Whether a change of lanes may be meant: `take it`, or just `change`."""
    return (clause.says(*_ENTERING_IT) and "easy" not in clause.words) or clause.words == ("change",)


def _stops(clause: ExplainedClause) -> bool:
    """Whether it speaks of stopping; `stop asking` is another thing."""
    return any(
        word in words.STOPS and not any(following.endswith("ing") for following in clause.words[index + 1 : index + 2])
        for index, word in enumerate(clause.words)
    )


_LANE_CHANGES: Final = (
    "lane change", "lane changes", "another lane", "other lane", "neighbouring lane", "of this lane", "leave the lane",
    "change lanes", "switch lanes", "changing lanes", "move over", "moves over", "moving over", "go over", "goes over",
    "swap lanes", "pull out", "pulls out", "pulling out", "set the lane", "target lane",
)  # fmt: skip
_OWN_LANE: Final = ("our lane", "my lane", "this lane")
_MOVES_TO_A_LANE: Final = words.MOVES - words.listed(
    "set sets get gets take use make over choose come leave bring brings put puts"
)


def _changes_lanes(clause: ExplainedClause) -> bool:
    if clause.says(*_LANE_CHANGES):
        return True
    if "limit" in clause.words or clause.says(*_OWN_LANE):
        return False
    return "lane" in clause.words and clause.has(_MOVES_TO_A_LANE)


def _count(clause: ExplainedClause) -> int:
    for quantity in clause_quantities(clause):
        if quantity.dimension == "lanes":
            return round(quantity.value)
    return 0


_LEFTWARD: Final = words.listed("leftmost leftwards leftward")
_RIGHTWARD: Final = words.listed("rightmost rightwards rightward")
_LEFT_OVER: Final = words.listed("over of alone until behind unchanged as untouched")
"""What after `left` makes it what remains, or was left as it was."""
_REMAINS: Final = words.listed("is are be none nothing lanes was one")
"""The same before it."""
_CORRECT: Final = words.listed("is that")
"""What before `right` makes it what is correct."""


def sides_of(clause: ExplainedClause) -> frozenset[int]:
    """Sides named in a clause, words like `is left over` apart."""
    found: set[int] = set()
    said = clause.words
    for index, word in enumerate(said):
        before, after = said[max(0, index - 1) : index], said[index + 1 : index + 2]
        if word in _LEFTWARD:
            found.add(-1)
        elif word in _RIGHTWARD:
            found.add(1)
        elif word == "left" and _LEFT_OVER.isdisjoint(after):
            remains = any(one in _REMAINS or one.startswith("#") for one in before)
            if not remains or after == ("lane",):
                found.add(-1)
        elif word == "right" and (_CORRECT.isdisjoint(before) or after == ("lane",)):
            found.add(1)
    return frozenset(found)


_OVERTAKING_US: Final = ("overtake us", "overtakes us", "overtaking us", "pass us", "passes us", "passing us")
_LETTING: Final = ("let", "lets", "so that", "others", "crossing")
"""What makes it others who pass."""
_NO_PASSING: Final = ("have passed", "has passed", "passing lane", "time pass", "pass through")
_PAST: Final = (
    "get past", "getting past", "go past", "go by", "goes by", "get by", "go round", "go around", "accelerate past",
    "drive past", "get ahead of", "moves past", "move past",
)  # fmt: skip
_GONE_BY: Final = words.SPEEDS | {"limit"}
"""What a speed goes by: `we go by the limit`."""


def _overtakes(clause: ExplainedClause) -> bool:
    if clause.says(*_OVERTAKING_US):
        return False
    if clause.has(words.OVERTAKES):
        return True
    if clause.says(*_LETTING):
        return False
    if clause.has(words.PASSES):
        return not clause.says(*_NO_PASSING)
    return clause.says(*_PAST) and not clause.has(_GONE_BY)


_GIVEN_BACK: Final = words.SPEEDS | words.listed("autopilot none true false")
"""What is returned where no car goes back."""
_OLD_LANES: Final = ("old lane", "original lane", "former lane", "previous lane")
_RETURNS: Final = words.listed("return returns returning")
_BACKWARD: Final = words.listed("drop drops dropping fall falls falling hang us hold set")
"""What before `back` makes it away from the car ahead."""
_BACK_IN: Final = words.listed("in into to right left")


def _returns(clause: ExplainedClause) -> bool:
    if clause.has(_GIVEN_BACK):
        return False
    if clause.says(*_OLD_LANES) and not clause.has(words.KEEPS):
        return True
    if clause.has(_RETURNS):
        return not any(quantity.dimension == "speed" for quantity in clause_quantities(clause))
    if "back" not in clause.words:
        return False
    index = clause.words.index("back")
    before, after = clause.words[max(0, index - 2) : index], clause.words[index + 1 : index + 2]
    if not _BACKWARD.isdisjoint(before):
        return False
    return (index == 0 and after != ("off",)) or not words.MOVES.isdisjoint(before) or not _BACK_IN.isdisjoint(after)


_PULLING_OVER: Final = ("pull over", "pulls over", "pulling over", "emergency lane", "hard shoulder", "the shoulder")


def _pulls_over(clause: ExplainedClause) -> bool:
    return clause.says(*_PULLING_OVER)
