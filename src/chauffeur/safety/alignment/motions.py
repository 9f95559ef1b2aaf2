"""Claims about lanes, overtaking, ways over an intersection, and stopping, and the sides they name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from chauffeur.safety.alignment import wording as words
from chauffeur.safety.alignment.claim import Claim, clause_quantities
from chauffeur.safety.alignment.clauses import Clause


def motions(clause: Clause, base: Claim, sides: frozenset[int], *, crossing: bool, checking: bool) -> Iterator[Claim]:
    """What a clause claims of lanes, overtaking, turns and stops.

    Args:
        clause: The clause.
        base: A claim with what all claims of the clause share.
        sides: The sides it names.
        crossing: Whether the way leads over an intersection.
        checking: Whether the clause speaks of looking if a way is free.
    """
    said = set(clause.words)
    junction = crossing or bool(said & words.JUNCTIONS)
    if _pulls_over(clause):
        yield replace(base, matter="pull over", sides=sides)
    if _overtakes(clause):
        yield replace(base, matter="overtake", sides=sides)
        return
    if _returns(clause):
        yield replace(base, matter="back", sides=sides)
        return
    speeds = words.DOWN | words.SPEEDS | words.LOWER
    zero = bool(said & speeds) and any(q.value == 0.0 and q.dimension == "bare" for q in clause_quantities(clause))
    if (_stops(clause) or zero) and not clause.says("stop sign", "stop line", "stands for") and "behind" not in said:
        yield replace(base, matter="stop", exact=bool(said & words.KEEPS) or clause.says("for good"))
    if junction and "lane" not in said:
        if "straight" in said:
            yield replace(base, matter="turn", sides=frozenset({0}))
        elif not sides and "cross" in said and not clause.negated:
            yield replace(base, matter="turn", aside=True)
        elif sides and (said & words.TURNS or len(clause.words) <= 5):
            yield replace(base, matter="turn", sides=sides)
        return
    if checking and not said & (
        words.MOVES - {"make", "makes", "get", "gets", "over", "take", "takes", "target", "enter"}
    ):
        return
    edge = bool(said & {"leftmost", "rightmost"}) or clause.says("all the way")
    if sides and (said & words.MOVES or said & {"lane", "side"} or _count(clause) or len(clause.words) <= 6):
        yield replace(base, matter="lane", sides=sides, count=99 if edge else _count(clause))
    elif not sides and _changes_lanes(clause):
        yield replace(base, matter="lane", count=_count(clause))
    elif not sides and not clause.negated and _mentions_lane(clause):
        yield replace(base, matter="lane", aside=True)


def _mentions_lane(clause: Clause) -> bool:
    """Whether a change of lanes may be meant: `take it`, or just `change`."""
    return (clause.says("take it", "use it", "enter it") and "easy" not in clause.words) or clause.words == ("change",)


def _stops(clause: Clause) -> bool:
    """Whether it speaks of stopping; `stop asking` is another thing."""
    after = (*clause.words[1:], "")
    return any(
        word in words.STOPS and not next_.endswith("ing") for word, next_ in zip(clause.words, after, strict=True)
    )


def _changes_lanes(clause: Clause) -> bool:
    if clause.says("lane change", "lane changes", "another lane", "other lane", "neighbouring lane", "of this lane",
                   "leave the lane",
                   "change lanes", "switch lanes", "changing lanes",
                   "move over", "moves over", "moving over", "go over", "goes over", "swap lanes",
                   "pull out", "pulls out", "pulling out", "set the lane", "target lane"):  # fmt: skip
        return True
    if "limit" in clause.words or clause.says("our lane", "my lane", "this lane"):
        return False
    moves = words.MOVES - {
        "set",
        "sets",
        "get",
        "gets",
        "take",
        "use",
        "make",
        "over",
        "choose",
        "come",
        "leave",
        "bring",
        "brings",
        "put",
        "puts",
    }
    return "lane" in clause.words and clause.has(moves)


def _count(clause: Clause) -> int:
    for quantity in clause_quantities(clause):
        if quantity.dimension == "lanes":
            return round(quantity.value)
    return 0


def sides_of(clause: Clause) -> frozenset[int]:
    """Sides named in a clause, words like `is left over` apart."""
    found: set[int] = set()
    said = clause.words
    for index, word in enumerate(said):
        before = said[index - 1] if index else ""
        after = said[index + 1] if index + 1 < len(said) else ""
        if word in ("leftmost", "leftwards", "leftward"):
            found.add(-1)
        elif word in ("rightmost", "rightwards", "rightward"):
            found.add(1)
        elif word == "left" and after not in ("over", "of", "alone", "until", "behind", "unchanged", "as", "untouched"):
            remains = before in ("is", "are", "be", "none", "nothing", "lanes", "was", "one") or before.startswith("#")
            if not remains or after == "lane":
                found.add(-1)
        elif (word == "right" and before not in ("is", "that")) or (word == "right" and after == "lane"):
            found.add(1)
    return frozenset(found)


def _overtakes(clause: Clause) -> bool:
    if clause.says("overtake us", "overtakes us", "overtaking us", "pass us", "passes us", "passing us"):
        return False
    if clause.has(words.OVERTAKES):
        return True
    if clause.says("let", "lets", "so that") or clause.has(frozenset({"others", "crossing"})):
        return False
    if clause.has(words.PASSES):
        return not clause.says("have passed", "has passed", "passing lane", "time pass", "pass through")
    ways = ("get past", "getting past", "go past", "go by", "goes by", "get by", "go round", "go around",
            "accelerate past", "drive past", "get ahead of", "moves past", "move past")  # fmt: skip
    return clause.says(*ways) and not clause.has(words.SPEEDS)


def _returns(clause: Clause) -> bool:
    said = set(clause.words)
    if said & words.SPEEDS or said & {"autopilot", "none", "true", "false"}:
        return False
    if clause.says("old lane", "original lane", "former lane", "previous lane") and not said & words.KEEPS:
        return True
    if said & {"return", "returns", "returning"}:
        return not any(quantity.dimension == "speed" for quantity in clause_quantities(clause))
    if "back" not in said:
        return False
    index = clause.words.index("back")
    before = clause.words[max(0, index - 2) : index]
    return not set(before) & {
        "drop",
        "drops",
        "dropping",
        "fall",
        "falls",
        "falling",
        "hang",
        "us",
        "hold",
        "set",
    } and (
        (index == 0 and clause.words[1:2] != ("off",))
        or bool(set(before) & words.MOVES)
        or clause.words[index + 1 : index + 2] in (("in",), ("into",), ("to",), ("right",), ("left",))
    )


def _pulls_over(clause: Clause) -> bool:
    return clause.says("pull over", "pulls over", "pulling over", "emergency lane", "hard shoulder", "the shoulder")
