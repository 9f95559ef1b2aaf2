"""Claims about speeds, gaps, headways and times, with their numbers and which way they change."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from chauffeur.language.quantities import Quantity
from chauffeur.safety.alignment import wording as words
from chauffeur.safety.alignment.claim import Claim, clause_quantities
from chauffeur.safety.alignment.clauses import Clause


def speeds(clause: Clause, base: Claim) -> Iterator[Claim]:
    """What a clause claims of the speed."""
    numbers = tuple(q for q in clause_quantities(clause, "speed") if q.dimension == "speed")
    shares = tuple(q for q in clause_quantities(clause) if q.dimension == "share")
    sign = _speed_sign(clause)
    said = set(clause.words)
    if not numbers and "limit" in said and said & _AT_LIMIT and not _relative(clause) and not clause.negated:
        yield replace(base, matter="speed", at_limit=True)
        return
    if numbers and said & {"limit", "permitted", "allowed"} and said & {"above", "over", "below", "under"}:
        way = 1 if said & {"above", "over"} else -1
        yield replace(base, matter="speed", at_limit=True, sign=way, quantities=numbers)
        return
    if not numbers and not sign and "plus" in said and any(q.dimension == "bare" for q in clause_quantities(clause)):
        yield replace(base, matter="speed", aside=True)
        return
    if "divided" in said:
        return
    if not numbers and not sign:
        if said & words.SPEEDS and not said & (words.KEEPS | words.UNCHANGED | {"limit", "nothing"}):
            yield replace(base, matter="speed", quantities=shares)
        return
    exact = bool(numbers) and _led_to(clause.words) and not _relative(clause) and all(q.value >= 0.0 for q in numbers)
    if "limit" in said and _relative(clause):
        sign = 0
    if numbers and clause.negated and clause.says("faster than", "above", "exceed", "over", "more than"):
        base, sign = replace(base, denied=False), 0
    yield replace(base, matter="speed", sign=0 if clause.negated else sign, quantities=numbers + shares, exact=exact)


_LEADS: Final = frozenset({"to", "at", "exactly", "becomes", "speed", "target", "be", "is"})


_STEPS: Final = tuple((word,) for word in ("higher", "lower", "more", "less", "faster", "slower", "above", "below"))
"""What after a number makes it a step: `the target is 5 m/s higher`."""


def _led_to(said: tuple[str, ...]) -> bool:
    """Whether a number is where a speed is to get (`to 20`, `at 20`, `a speed of 20`), and no step on the way."""
    for index, word in enumerate(said):
        if word.startswith("#"):
            before = [one for one in said[:index] if one not in ("about", "around", "roughly", "only", "some")][-2:]
            if said[index + 1 : index + 2] in _STEPS:
                continue
            if before and (before[-1] in _LEADS or (before[-1] == "of" and before[0] in words.SPEEDS | {"target"})):
                return True
    return False


_AT_LIMIT: Final = frozenset({"drive", "match", "use", "exactly", "at", "go", "copy", "set"})


def _relative(clause: Clause) -> bool:
    said = set(clause.words)
    return bool(
        said
        & {
            "by",
            "plus",
            "minus",
            "subtract",
            "add",
            "than",
            "above",
            "below",
            "under",
            "over",
            "off",
            "faster",
            "slower",
            "relative",
            "difference",
        }
    ) and not clause.says("down to", "up to")


_NOT_OURS: Final = words.VEHICLES | words.listed("lane lanes traffic sign side down road roads limit distance hard")


def _speed_sign(clause: Clause) -> int:
    """+1 for faster, -1 for slower, 0 where neither is said of the ego's own speed."""
    said = clause.words
    votes = 0
    for index, word in enumerate(said):
        after = said[index + 1] if index + 1 < len(said) else ""
        if word not in words.UP | words.DOWN or after in _NOT_OURS - {"down", "driver"}:
            continue
        rest = said[index + 1 : index + 4]
        if word in ("braking", "acceleration", "deceleration") and after == "of":
            continue  # how hard others or we would brake
        if "than" in rest and set(said[index + 1 : index + 8]) & (words.VEHICLES | {"it", "him", "them", "others"}):
            continue
        votes += 1 if word in words.UP else -1
    if not votes:
        if clause.says("speed up", "speeds up", "speeding up", "pick up", "picks up", "catch up"):
            return 1
        if clause.has(words.SPEEDS) and not clause.has(words.GAPS - {"following"}):
            votes += clause.has(words.RAISE) - clause.has(words.LOWER)
        text = " ".join(said)
        if re.search(r"\b(?:take|takes|taking|knock|shave) #\d+ off", text):
            votes = -1
        if clause.says("ease off", "come down", "comes down", "less speed"):
            votes = -1
    return (votes > 0) - (votes < 0)


def gaps(clause: Clause, base: Claim) -> Iterator[Claim]:
    """What it claims of the gap to the vehicle ahead, or the headway."""
    said = set(clause.words)
    about = bool(said & (words.GAPS - {"following"})) or clause.says(
        "following distance", "behind the car", "behind the vehicle"
    )
    about = about or (bool(said & words.KEEPS & words.listed("keep keeps keeping hold holds")) and "ahead" in said)
    headway = bool(said & {"headway"}) or clause.says("time gap", "second rule", "s behind")
    sign = _gap_sign(clause)
    if said & {"minimum", "allowed"}:
        return
    unit = "time" if headway else "distance"
    bare = unit if about or headway else ""
    numbers = tuple(q for q in clause_quantities(clause, bare) if q.dimension in ("distance", "time"))
    if not headway and clause.says("in #0", "after #0", "within #0", "for #0"):
        numbers = tuple(q for q in numbers if q.dimension == "distance")  # when, or how long; not how far apart
    if clause.says("at a distance of") and said & words.MOVES:
        yield replace(base, matter="other gap", quantities=numbers)
        return
    if not about and not headway and not sign:
        numbers = tuple(q for q in numbers if q.dimension == "distance")
        if numbers and not said & {"wait", "waits", "after", "ahead"}:
            yield replace(base, matter="gap", quantities=numbers, firm=False)
        return
    if not numbers and not sign:
        return
    if said & {"tick", "ticks", "period"} or (said & words.KEEPS and said & {"default", "usual"}):
        return
    yield replace(base, matter="gap", sign=0 if clause.negated else sign, quantities=numbers)


def _gap_sign(clause: Clause) -> int:
    said = set(clause.words)
    if clause.says("drop back", "fall back", "falling back", "back off", "hang back", "drops back", "falls back",
                   "dropping back", "leave more", "more room", "more space", "more distance", "farther behind",
                   "further behind", "fall back further"):  # fmt: skip
        return 1
    if clause.says("close up", "tighten up", "catch up", "closing in", "close in", "more closely", "get closer",
                   "drive closer", "move closer"):  # fmt: skip
        return -1
    if not said & words.GAPS:
        return 0
    up = bool(said & (words.WIDER - {"more", "extra", "open", "opens"})) or clause.says(
        "open the gap", "opens the gap", "open up the gap"
    )
    down = bool(said & words.CLOSER)
    return up - down


def waits(clause: Clause, base: Claim) -> Iterator[Claim]:
    """What it claims of time that passes."""
    said = set(clause.words)
    if said & {"headway", "gap", "distance", "tick", "ticks", "behind", "every", "minimum", "allowed"} or clause.says(
        "time gap"
    ):
        return
    numbers = tuple(_time(q) for q in clause_quantities(clause) if q.dimension == "time" or _is_minutes(q))
    if numbers:
        yield replace(base, matter="wait", quantities=numbers)


def _is_minutes(quantity: Quantity) -> bool:
    return quantity.dimension == "other" and quantity.said.split()[-1].startswith("min")


def _time(quantity: Quantity) -> Quantity:
    return replace(quantity, value=60.0 * quantity.value, dimension="time") if _is_minutes(quantity) else quantity
