"""A claim: something that a text says of what is done, in a fixed form."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal

from chauffeur.language.quantities import Quantity
from chauffeur.safety.faithfulness import lexicon as words
from chauffeur.safety.faithfulness.clauses import ExplainedClause

Matter = Literal[
    "lane", "overtake", "back", "turn", "stop", "pull over", "speed", "gap", "wait", "check", "other speed",
    "other gap", "behind", "stay", "nothing",
]  # fmt: skip
"""What a claim is about. `check` is looking whether a way is free; `other speed`, `other gap`, `behind` are things that
something is said to depend on; `stay` and `nothing` deny what is not done."""


@dataclass(frozen=True, slots=True)
class Claim:
    """A claim.

    Attributes:
        matter: What it is about.
        sentence: The sentence of the text.
        order: Its place among the claims in time, as the text tells it.
        firm: Whether the text says that it is done.
        denied: Whether the text says that it is not done.
        sides: -1 left, 0 straight, +1 right; empty where none is named. Of `stay` and `nothing`: what is left alone,
            1 the lane, 2 the speed, 3 the gap; empty for everything.
        sign: Of a speed or a gap: -1 less, +1 more, 0 not said.
        quantities: Numbers said with it.
        count: Lanes to cross; 0 where it is not said.
        told: Whether the text tells its place in time in words (`first`, `then`, `after`).
        exact: Whether its number is what is driven at, not a difference. Of a stop: whether the car is to stay there.
        aside: Whether it is only mentioned; nothing is held against it.
        at_limit: Of a speed: whether it is that of the limit.
    """

    matter: Matter
    sentence: str
    order: float
    firm: bool = True
    denied: bool = False
    sides: frozenset[int] = frozenset()
    sign: int = 0
    quantities: tuple[Quantity, ...] = ()
    count: int = 0
    told: bool = False
    exact: bool = False
    aside: bool = False
    at_limit: bool = False


_FACTORS: Final = frozenset({"gain", "factor", "coefficient", "weight"})
"""What measures nothing."""
_VAGUE: Final = frozenset({"few", "couple", "several", "some"})


def clause_quantities(
    clause: ExplainedClause, bare: Literal["", "speed", "distance", "time"] = ""
) -> tuple[Quantity, ...]:
    """Numbers said in a clause; one without a unit counts as what the clause is about."""
    found: list[Quantity] = []
    for index, word in enumerate(clause.words):
        if word.startswith("#"):
            quantity = clause.quantities[int(word[1:])]
            before = clause.words[max(0, index - 1) : index]
            if (before in (("from",), ("than",)) and clause.says("to")) or _VAGUE.intersection(quantity.said.split()):
                continue
            measured = _FACTORS.isdisjoint(clause.words[max(0, index - 2) : index])
            if quantity.dimension == "bare" and (not measured or "divided" in clause.words):
                continue
            if quantity.dimension == "bare" and bare:
                fits = bare != "speed" or clause.has(words.SPEEDS)
                quantity = replace(quantity, dimension=bare) if fits else quantity
            found.append(quantity)
    return tuple(found)
