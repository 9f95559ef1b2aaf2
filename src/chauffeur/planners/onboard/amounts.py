"""How a quantity counts: as the new value or as a difference, as a target or as a bound."""

from __future__ import annotations

import re

from chauffeur.language.quantities import Quantity
from chauffeur.planners.onboard.clauses import Clause
from chauffeur.planners.onboard.meaning import Amount, Bound, Change, Dimension, Frame

_LESS = r"(?:less|closer|nearer|shorter|lower|smaller|tighter|slower|narrower|fewer|down|below|under)"
_MORE = (
    r"(?:more|further|farther|higher|longer|greater|larger|bigger|wider|faster|quicker|extra|additional|up|above|over)"
)
_AFTER_LESS = re.compile(rf"^(?: (?:any|much|to be))? {_LESS}\b(?! (?:the )?speedlimit)")
_AFTER_MORE = re.compile(rf"^(?: (?:any|much|to be))? {_MORE}\b(?! (?:the )?speedlimit)")
_AWAY = re.compile(r"^ (?:further )?(?:back|away|off|apart)\b")
_RESTING = re.compile(r"\b(?:keep|stay|hold|remain|maintain|follow|leave|sit|set|drive)\w*\b")
_BY = re.compile(r"\b(?:by|another|additional|extra|an extra)(?: (?:about|around|roughly|some|another|an?))* $")
_TO = re.compile(
    r"\b(?:to|of|at|within|until|is|be|doing|do|down to|up to)(?: (?:about|around|roughly|exactly|be|a|just|some))* $"
)
_ABOUT = r"(?: (?:about|around))? $"
_NOT = r"\b(?:not|never|no) (?:\w+ ){0,4}?"
_BOUNDS: tuple[tuple[re.Pattern[str], Bound], ...] = (
    (
        re.compile(
            rf"{_NOT}(?:(?:faster|quicker|higher|more|further|farther|longer) than|exceed\w*|above|over|past){_ABOUT}"
        ),
        "at_most",
    ),
    (re.compile(rf"{_NOT}(?:(?:slower|less|closer|nearer|lower|shorter) than|below|under){_ABOUT}"), "at_least"),
    (
        re.compile(
            r"\b(?:at most|up to a maximum of|maximum(?: of)?|max(?: of)?|under|below|(?:slower|less|closer) than"
            rf"|within|capp?e?d? (?:\w+ ){{0,2}}at|limit (?:\w+ ){{0,2}}?to|without exceeding){_ABOUT}"
        ),
        "at_most",
    ),
    (
        re.compile(
            r"\b(?:at least|minimum(?: of)?|min(?: of)?|(?:faster|more|further|farther) than|above|over)" + _ABOUT
        ),
        "at_least",
    ),
)
"""The first that matches right before a number says whether it is a bound; negated forms come first."""
_OVER_LIMIT = re.compile(
    r"^ (?P<how>over|above|under|below|faster than|slower than|less than|more than) (?:the )?(?:speedlimit|limit|sign)"
)
_NUDGE = re.compile(r"\b(?:add|subtract|deduct|knock|shave|take off|gain|scrub|shed)\w*\b")
_FACTORS = (
    (re.compile(r"\b(?:by|in) half\b|\bhalf(?: of)?(?: (?:the|this|that|your|our|my|as))?\b|\bhalv\w+\b"), 0.5),
    (re.compile(r"\b(?:double|twice|doubling)\b"), 2.0),
    (re.compile(r"\b(?:triple|tripling|treble)\b"), 3.0),
)
_QUARTER = re.compile(r"\bby a quarter\b|\ba quarter\b")
_SMALL: dict[Dimension, float] = {"speed": 10.0, "distance": 30.0, "time": 0.0, "bare": 12.0}
"""Largest number, per dimension, that "slow down five metres a second" takes as a difference without a "by"."""


def amount_of(
    clause: Clause, wanted: tuple[Dimension, ...], change: Change, *, verb: bool, factors: bool = True
) -> tuple[Amount, Change] | None:
    """The clause's quantity of one of the wanted dimensions, and the direction of change it says or inherits.

    Args:
        clause: Where to look.
        wanted: Dimensions in order of preference.
        change: Direction the rest of the clause asks for.
        verb: Whether a word of change ("slow down", "increase") governs the quantity.
        factors: Whether "half" and "twice" count.
    """
    for dimension in wanted:
        held = [(at, quantity) for at, quantity in clause.quantities if quantity.dimension == dimension]
        if held:
            return _framed(clause.text, _chosen(clause.text, held), change, verb=verb)
    for pattern, factor in _FACTORS if factors else ():
        said = pattern.search(clause.text)
        if said is not None:
            return Amount(factor, "share", "factor", "exact", said[0]), 1 if factor > 1 else -1
    quarter = _QUARTER.search(clause.text) if factors and change else None
    if quarter is not None:
        return Amount(1.0 + 0.25 * change, "share", "factor", "exact", quarter[0]), change
    return None


def _chosen(text: str, held: list[tuple[int, Quantity]]) -> tuple[int, Quantity]:
    """Of several quantities of one kind the new value: in "from 20 to 25" the second, else the first."""
    if len(held) > 1 and (re.search(r"\bfrom(?: \w+)? #\d+ (?:\w+ )?to #", text) or re.search(r"\bnot #", text)):
        return held[-1]
    return held[0]


def _framed(text: str, item: tuple[int, Quantity], change: Change, *, verb: bool) -> tuple[Amount, Change]:
    at, quantity = item
    before, after = text[:at], re.sub(r"^#\d+", "", text[at:])
    value, dimension = quantity.value, quantity.dimension
    over = _OVER_LIMIT.match(after)
    if over is not None:
        sign: Change = 1 if over["how"] in ("over", "above", "faster than", "more than") else -1
        return Amount(sign * value, dimension, "over_limit", "exact", quantity.said), sign
    bound: Bound | None = next((bound for pattern, bound in _BOUNDS if pattern.search(before)), None)
    if bound is not None:
        return Amount(value, dimension, "absolute", bound, quantity.said), 0
    frame, sign = _frame(before, after, quantity, change, verb=verb)
    if dimension == "share":
        return _share(value, frame, sign, quantity.said)
    return Amount(value, dimension, frame, "exact", quantity.said), sign


def _frame(before: str, after: str, quantity: Quantity, change: Change, *, verb: bool) -> tuple[Frame, Change]:
    trailing = _trailing(after, quantity.inner)
    if trailing:
        return "relative", trailing
    if quantity.dimension == "distance" and _AWAY.match(after) and not _RESTING.search(before):
        return "relative", 1
    if _BY.search(before) or _NUDGE.search(before):
        return "relative", change
    if _TO.search(before):
        return "absolute", change
    small = quantity.value <= _SMALL.get(quantity.dimension, 0.0)
    if verb and change and (small or quantity.dimension == "share"):
        return "relative", change
    return "absolute", change


def _trailing(after: str, inner: str) -> Change:
    """Direction a comparative right behind the number gives: "15 metres closer", "10 more metres"."""
    if inner in ("less", "fewer") or _AFTER_LESS.match(after):
        return -1
    if inner in ("more", "extra", "additional", "further") or _AFTER_MORE.match(after):
        return 1
    return 0


def _share(value: float, frame: Frame, sign: Change, said: str) -> tuple[Amount, Change]:
    """Percentages and multiples: "by 20 percent" changes by a fifth, "to 80 percent" and "1.5 times" multiply."""
    if frame == "relative" and sign:
        value = max(0.0, 1.0 + sign * value)
    return Amount(value, "share", "factor", "exact", said), sign
