"""Claims about speeds, gaps, headways and times, with their numbers and which way they change."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from chauffeur.language.quantities import Quantity
from chauffeur.safety.faithfulness import lexicon as words
from chauffeur.safety.faithfulness.claim import Claim, clause_quantities
from chauffeur.safety.faithfulness.clauses import ExplainedClause

_AT_LIMIT: Final = words.listed("drive match use exactly at go copy set")
_ALLOWED: Final = words.listed("limit permitted allowed")
_OVER: Final = words.listed("above over")
_UNDER: Final = words.listed("below under")
_NO_SPEED: Final = words.KEEPS | words.UNCHANGED | {"limit", "nothing"}
_AT_MOST: Final = ("faster than", "above", "exceed", "over", "more than")
_NO_FASTER: Final = ("no faster than", "not faster than")


def speeds(clause: ExplainedClause, base: Claim) -> Iterator[Claim]:
    """What a clause claims of the speed."""
    numbers = tuple(q for q in clause_quantities(clause, "speed") if q.dimension == "speed")
    shares = tuple(q for q in clause_quantities(clause) if q.dimension == "share")
    sign = _speed_sign(clause)
    limit = "limit" in clause.words
    if not numbers and limit and clause.has(_AT_LIMIT) and not _relative(clause) and not clause.negated:
        yield replace(base, matter="speed", at_limit=True)
        return
    if numbers and clause.has(_ALLOWED, _OVER | _UNDER):
        yield replace(base, matter="speed", at_limit=True, sign=1 if clause.has(_OVER) else -1, quantities=numbers)
        return
    if (
        not numbers
        and not sign
        and "plus" in clause.words
        and any(q.dimension == "bare" for q in clause_quantities(clause))
    ):
        yield replace(base, matter="speed", aside=True)
        return
    if "divided" in clause.words:
        return
    if not numbers and not sign:
        if clause.has(words.SPEEDS) and not clause.has(_NO_SPEED):
            yield replace(base, matter="speed", quantities=shares)
        return
    exact = bool(numbers) and _led_to(clause.words) and not _relative(clause) and all(q.value >= 0.0 for q in numbers)
    if limit and _relative(clause):
        sign = 0
    if numbers and clause.negated and clause.says(*_AT_MOST):
        base = replace(base, denied=False)
    if clause.negated or clause.says(*_NO_FASTER):
        sign = 0
    yield replace(base, matter="speed", sign=sign, quantities=numbers + shares, exact=exact)


_LEADS: Final = frozenset({"to", "at", "exactly", "becomes", "speed", "target", "be", "is"})


_STEPS: Final = tuple((word,) for word in ("higher", "lower", "more", "less", "faster", "slower", "above", "below"))
"""What after a number makes it a step: `the target is 5 m/s higher`."""


_ABOUT: Final = words.listed("about around roughly only some")
_SPEED_OR_TARGET: Final = words.SPEEDS | {"target"}


def _led_to(said: tuple[str, ...]) -> bool:
    """Whether a number is where a speed is to get (`to 20`, `at 20`, `a speed of 20`), and no step on the way."""
    for index, word in enumerate(said):
        if word.startswith("#"):
            before = [one for one in said[:index] if one not in _ABOUT][-2:]
            if said[index + 1 : index + 2] in _STEPS:
                continue
            if before and (before[-1] in _LEADS or (before[-1] == "of" and before[0] in _SPEED_OR_TARGET)):
                return True
    return False


_BESIDE: Final = words.listed(
    "by plus minus subtract add than above below under over off faster slower relative difference"
)
_ONTO: Final = ("down to", "up to")


def _relative(clause: ExplainedClause) -> bool:
    return clause.has(_BESIDE) and not clause.says(*_ONTO)


_NOT_OURS: Final = (words.VEHICLES - {"driver"}) | words.listed(
    "lane lanes traffic sign side road roads limit distance hard"
)


_FASTER_OR_SLOWER: Final = words.UP | words.DOWN
_HOW_HARD: Final = words.listed("braking acceleration deceleration")
_COMPARED: Final = words.VEHICLES | words.listed("it him them others")
_SPEEDING_UP: Final = ("speed up", "speeds up", "speeding up", "pick up", "picks up", "catch up")
_SLOWING_DOWN: Final = ("ease off", "come down", "comes down", "less speed")
_BETWEEN: Final = words.GAPS - {"following"}
_TAKEN_OFF: Final = re.compile(r"\b(?:take|takes|taking|knock|shave) #\d+ off")


def _speed_sign(clause: ExplainedClause) -> int:
    """+1 for faster, -1 for slower, 0 where neither is said of the ego's own speed."""
    said = clause.words
    votes = 0
    for index, word in enumerate(said):
        rest = said[index + 1 : index + 4]
        if word not in _FASTER_OR_SLOWER or not _NOT_OURS.isdisjoint(rest[:1]):
            continue
        if word in _HOW_HARD and rest[:1] == ("of",):
            continue  # how hard others or we would brake
        if "than" in rest and not _COMPARED.isdisjoint(said[index + 1 : index + 8]):
            continue
        votes += 1 if word in words.UP else -1
    if not votes:
        if clause.says(*_SPEEDING_UP):
            return 1
        if clause.has(words.SPEEDS) and not clause.has(_BETWEEN):
            # The gain of a controller raises nothing.
            raising = words.RAISE - {"gain"} if clause.says("gain of") else words.RAISE
            votes = clause.has(raising) - clause.has(words.LOWER)
        if _TAKEN_OFF.search(" ".join(said)) or clause.says(*_SLOWING_DOWN):
            return -1
    return (votes > 0) - (votes < 0)


_BEHIND_IT: Final = ("following distance", "behind the car", "behind the vehicle")
_HOLDS: Final = words.listed("keep keeps keeping hold holds")
_IN_SECONDS: Final = ("time gap", "second rule", "s behind")
_RULED: Final = words.listed("minimum allowed")
_BY_THEN: Final = re.compile(r"\b(?:in|after|within) #\d+|\bfor #0\b")
_NO_GAP: Final = words.listed("wait waits after ahead")
_TICKS: Final = words.listed("tick ticks period")
_USUAL: Final = words.listed("default usual")


def gaps(clause: ExplainedClause, base: Claim) -> Iterator[Claim]:
    """What it claims of the gap to the vehicle ahead, or the headway."""
    about = clause.has(_BETWEEN) or clause.says(*_BEHIND_IT) or (clause.has(_HOLDS) and "ahead" in clause.words)
    headway = "headway" in clause.words or clause.says(*_IN_SECONDS)
    sign = _gap_sign(clause)
    if clause.has(_RULED):
        return
    unit = "time" if headway else "distance"
    said = clause_quantities(clause, unit) if about or headway else clause_quantities(clause)
    numbers = tuple(q for q in said if q.dimension in ("distance", "time"))
    if not headway and _BY_THEN.search(" ".join(clause.words)):
        numbers = tuple(q for q in numbers if q.dimension == "distance")  # when, or how long; not how far apart
    if clause.says("at a distance of") and clause.has(words.MOVES):
        yield replace(base, matter="other gap", quantities=numbers)
        return
    if not about and not headway and not sign:
        numbers = tuple(q for q in numbers if q.dimension == "distance")
        if numbers and not clause.has(_NO_GAP):
            yield replace(base, matter="gap", quantities=numbers, firm=False)
        return
    if not numbers and not sign:
        return
    if clause.has(_TICKS) or clause.has(words.KEEPS, _USUAL):
        return
    yield replace(base, matter="gap", sign=0 if clause.negated else sign, quantities=numbers)


_WIDENING: Final = (
    "drop back", "fall back", "falling back", "back off", "hang back", "drops back", "falls back", "dropping back",
    "leave more", "more room", "more space", "more distance", "farther behind", "further behind",
)  # fmt: skip
_CLOSING: Final = (
    "close up", "tighten up", "catch up", "closing in", "close in", "more closely", "get closer", "drive closer",
    "move closer",
)  # fmt: skip
_WIDER: Final = words.WIDER - words.listed("more extra open opens")
_OPENED: Final = ("open the gap", "opens the gap", "open up the gap")


def _gap_sign(clause: ExplainedClause) -> int:
    if clause.says(*_WIDENING):
        return 1
    if clause.says(*_CLOSING):
        return -1
    if not clause.has(words.GAPS):
        return 0
    return (clause.has(_WIDER) or clause.says(*_OPENED)) - clause.has(words.CLOSER)


_NO_WAITS: Final = words.listed("headway gap distance tick ticks behind every minimum allowed")


def waits(clause: ExplainedClause, base: Claim) -> Iterator[Claim]:
    """What it claims of time that passes."""
    if clause.has(_NO_WAITS):
        return
    numbers = tuple(_time(q) for q in clause_quantities(clause) if q.dimension == "time" or _is_minutes(q))
    if numbers:
        yield replace(base, matter="wait", quantities=numbers)


def _is_minutes(quantity: Quantity) -> bool:
    return quantity.dimension == "other" and quantity.said.split()[-1].startswith("min")


def _time(quantity: Quantity) -> Quantity:
    return replace(quantity, value=60.0 * quantity.value, dimension="time") if _is_minutes(quantity) else quantity
