"""Claims about what something waits for or depends on, and about what is left as it is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from chauffeur.safety.faithfulness import lexicon as words
from chauffeur.safety.faithfulness.amounts import speeds, waits
from chauffeur.safety.faithfulness.claim import Claim, clause_quantities
from chauffeur.safety.faithfulness.clauses import ExplainedClause
from chauffeur.safety.faithfulness.motions import motions, sides_of

_SKIPPED: Final = words.listed("skip skips skipping omit")
_WAITED: Final = words.listed("wait let lets allow")
_EVERYBODY: Final = words.listed("traffic everyone everybody others")
_YIELDING: Final = (
    "is safe enter", "give way", "gives way", "yield to", "yields to", "yielding to", "safe gap", "safe opening",
    "safe moment", "when safe", "if safe", "until safe", "safe to enter", "way is clear",
)  # fmt: skip
"""What only somebody says who looks whether a way is free."""
_LOOKED_AT: Final = words.listed(
    "lane lanes traffic gap crossing cross vehicles cars rear car check it them directions ways side"
)
_STRONG: Final = words.LOOKS - words.listed("make ensure ensures ask asks look looks looking")
"""Words that are looks by themselves."""
_LOOKING: Final = ("look both ways", "look for a", "sufficient gap")


def looks(clause: ExplainedClause) -> bool:
    """Whether a clause speaks of looking if a way is free."""
    if clause.has(_SKIPPED):
        return False
    if clause.has(_WAITED, _EVERYBODY) or clause.says(*_YIELDING):
        return True
    if "limit" in clause.words:
        return False
    return clause.has(words.LOOKS, words.SAFE) or clause.has(_STRONG, _LOOKED_AT) or clause.says(*_LOOKING)


_FREE: Final = words.listed("safe clear clears free vacant safely")
_WAYS: Final = words.listed(
    "lane it way gap nobody that both traffic them room junction they all crossing lanes road one opening moment clear "
    "safe side"
)
_NOBODY: Final = (
    "nobody", "no one", "no traffic", "none comes", "gap is available", "gap opens", "opens up", "room", "gap in",
    "sufficient gap", "safe gap", "traffic has gone",
)  # fmt: skip
_AHEAD: Final = words.listed("front ahead")
_BESIDE: Final = words.listed("lane side left right")
_ROOM: Final = words.listed("space room")
_LOOKED_FOR: Final = words.listed("safety safe clear free traffic lane")
_NOT_FREE: Final = ("not safe", "is not free", "not clear")
_OTHERS: Final = words.VEHICLES | {"it"}
_OURS: Final = words.listed("we i our us")
_THAN: Final = words.listed("slower faster below above exceeds under")
_LESS_MORE: Final = words.listed("less more")
_BEHIND: Final = words.listed("behind rear")
_NEARER: Final = words.listed("closer nearer farther further")
_DONE_FIRST: Final = frozenset({"after", "once", "when", "as soon as", "until", "while"})
"""Openers of what is itself done."""


def conditions(clause: ExplainedClause, base: Claim, *, crossing: bool) -> Iterator[Claim]:
    """What a clause claims that something waits for or depends on."""
    sides = sides_of(clause)
    free = clause.has(_FREE, _WAYS) or clause.has(words.LOOKS, _LOOKED_FOR)
    nobody = clause.says(*_NOBODY) and (clause.has(_BESIDE) or not clause.has(_AHEAD))
    roomy = "enough" in clause.words and clause.has(_ROOM)
    if (free or nobody or roomy) and not clause.says(*_NOT_FREE):
        yield replace(base, matter="check", sides=sides, denied=False)
    distances = tuple(q for q in clause_quantities(clause) if q.dimension == "distance")
    ours = clause.has(_OURS)
    others = clause.has(_OTHERS) and not ours
    said_speeds = tuple(q for q in clause_quantities(clause, "speed") if q.dimension == "speed")
    if others and (clause.has(_THAN) or (said_speeds and clause.has(_LESS_MORE))):
        yield replace(base, matter="other speed", quantities=said_speeds)
    elif distances:
        behind = clause.has(_BEHIND) and not ours
        yield replace(base, matter="behind" if behind else "other gap", quantities=distances)
    elif others and clause.has(_NEARER):
        yield replace(base, matter="other gap")
    yield from waits(clause, base)
    if clause.opener in _DONE_FIRST and not clause.negated:
        yield from (
            replace(claim, firm=clause.opener in ("after", "once"))
            for claim in motions(clause, base, sides, crossing=crossing)
            if claim.matter != "lane" or sides
        )
        if not others:
            yield from (replace(claim, firm=clause.opener == "after") for claim in speeds(clause, base))


_AS_OTHERS: Final = ("same speed as", "same lane as")
_KEEPING: Final = words.KEEPS | words.UNCHANGED
_THERE: Final = ("stay behind", "remain behind", "remains behind", "stays behind", "where we are")
_PRESENT: Final = words.listed("present current our same")
_USUAL: Final = words.listed("default usual same")
_NOTHING: Final = (
    "nothing", "no action", "no change", "no manoeuvre", "no lane change", "no lane changes", "as it is",
    "the way it is", "unchanged", "untouched", "same speed", "same lane", "not change", "no speed change",
    "left alone", "leave the target speed",
)  # fmt: skip
_LANES: Final = words.listed("lane lanes")
_HEADWAYS: Final = words.listed("headway gap distance")


def stays(clause: ExplainedClause, base: Claim) -> Iterator[Claim]:
    """What is said to be left as it is."""
    if clause.mood != "plan" or clause.says(*_AS_OTHERS):
        return
    base = replace(base, denied=False)
    if clause.has(_KEEPING) and ("lane" in clause.words or clause.says(*_THERE)):
        yield replace(base, matter="stay", sides=frozenset({1}))
    if clause.has(_KEEPING, words.SPEEDS, _PRESENT) and not clause_quantities(clause):
        yield replace(base, sides=frozenset({2}))
    if clause.has(words.KEEPS, words.GAPS, _USUAL):
        yield replace(base, sides=frozenset({3}))
    elif clause.says(*_NOTHING) and not any(q.dimension == "time" for q in clause_quantities(clause)):
        yield replace(base, sides=_about(clause))


def _about(clause: ExplainedClause) -> frozenset[int]:
    """What is said to stay: 1 the lane, 2 the speed, 3 the gap; nothing for all of it."""
    named = ((1, _LANES), (2, words.SPEEDS), (3, _HEADWAYS))
    return frozenset(matter for matter, said in named if clause.has(said))
