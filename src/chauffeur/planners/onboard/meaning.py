"""The meaning of a wish as a value: programs are chosen by it and never by the similarity of sentences.

"Drive faster" and "drive slower" are 0.9 alike to a sentence encoder; here they differ in `change`, which no rule
may lose on the way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from chauffeur.language.quantities import Dimension

Manoeuvre = Literal[
    "speed", "gap", "lane", "overtake", "pull_over", "stop", "turn", "style", "keep", "resume", "follow", "yield"
]
"""`follow`: stay behind the lead vehicle; `yield`: let somebody in or by; `keep`: change nothing."""

Side = Literal["left", "right", "straight"]
Change = Literal[-1, 0, 1]
Frame = Literal["absolute", "relative", "factor", "over_limit"]
"""Meaning of an amount: as the new value, as a difference, as a multiple, or as a difference to the speed limit."""

Bound = Literal["exact", "at_most", "at_least"]

BIT, PLAIN, MUCH = 0.35, 0.6, 1.0
"""Degrees in words, the same scale as `Feedback.strength`."""


@dataclass(frozen=True, slots=True)
class Amount:
    """A quantity the person named.

    Attributes:
        value: SI value (m/s, m, s), or the plain number for `share` and `lanes`.
        dimension: `speed`, `distance`, `time`, `lanes` or `share`.
        frame: How it counts.
        bound: Whether it is a target or a limit.
        said: The words it came from.
    """

    value: float
    dimension: Dimension
    frame: Frame = "absolute"
    bound: Bound = "exact"
    said: str = ""


@dataclass(frozen=True, slots=True)
class Meaning:
    """One thing to do.

    Attributes:
        manoeuvre: What kind of thing.
        direction: Side, where it has one.
        change: +1 more speed or a larger gap, -1 less; 0 no direction said, or hold what is.
        amount: Quantity named, if any.
        degree: Strength in words when no quantity is named.
        variant: Refines the manoeuvre: `hold`, `limit`, `match`, `max`, `edge` (leftmost, rightmost), `middle`,
            `return`, `no overtaking`, or the name of a style.
        condition: `safe` where a lane is to be clear first; else empty.
        manner: `gentle`, `swift`, or empty.
    """

    manoeuvre: Manoeuvre
    direction: Side | None = None
    change: Change = 0
    amount: Amount | None = None
    degree: float = PLAIN
    variant: str = ""
    condition: str = ""
    manner: str = ""

    @property
    def family(self) -> str:
        """Short tag, e.g. `speed.increase`, `overtake.left`, `style.hurry`."""
        if self.manoeuvre in ("speed", "gap"):
            return f"{self.manoeuvre}.{self._how()}"
        if self.manoeuvre == "lane" and self.variant == "hold":
            return "lane.keep"
        if self.manoeuvre == "style":
            return f"style.{self.variant}"
        if self.direction is not None:
            return f"{self.manoeuvre}.{self.direction}"
        return self.manoeuvre

    def _how(self) -> str:
        if self.variant in ("limit", "match", "max", "hold"):
            return self.variant
        if self.amount is not None and self.amount.bound != "exact":
            return "cap" if self.amount.bound == "at_most" else "floor"
        if self.amount is not None and self.amount.frame == "absolute":
            return "time" if self.amount.dimension == "time" else "set"
        return {1: "increase", -1: "decrease", 0: "hold"}[self.change]
