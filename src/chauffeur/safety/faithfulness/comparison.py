"""A text and its program side by side: what every comparison of the two goes by, and what it may find."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from chauffeur.concept import Mismatch
from chauffeur.language.quantities import Quantity
from chauffeur.safety.faithfulness.claim import Claim
from chauffeur.safety.faithfulness.claims import claims_of, describes
from chauffeur.safety.faithfulness.facts import Effect, Event, Facts, FactSurroundings
from chauffeur.safety.faithfulness.numbers import Numbers

_MAX_CHARS: Final = 20_000
"""Of a text; nobody reads more, and what follows is not compared."""

_ALONE: Final = re.compile(
    r"\b(?:that(?:'s| is) (?:all|it)\b|nothing (?:else|but|more)|only [\w\s]{3,40} changes|is left alone)",
    re.IGNORECASE,
)
"""Words by which a text says that it has told everything."""

_PASSING: Final = re.compile(r"\b(?:over|under)tak\w+|\bpass(?:ing|es|ed)?\b|\bpast\b", re.IGNORECASE)
"""An overtaking has a speed of its own."""

_SPEED: Final = re.compile(r"\b(?:speed|pace|velocity)\b", re.IGNORECASE)

DRIVEN_SPEED_MPS: Final = 1.0
"""How far a driven speed may be off one that is told."""

SIDE_WORDS: Final = {-2: "round", -1: "left", 0: "straight on", 1: "right", 2: "round"}
"""Quarter turns to the right, and lanes, in words; half a turn is one whichever way it was driven."""


class Comparison:
    """A text with its claims, and a program with its facts.

    Attributes:
        claims: What the text claims.
        firm, told: Matters that it claims firmly, and at all.
        facts: What reading finds in the program.
        moves, turns, speeds: Its events of those kinds, with their places.
        numbers: Its numbers.
        effects: What it did where it was run without failing.
        crossing: Whether its way leads over an intersection.
        alone: Whether the text says that it has told everything.
        describes: Whether it tells deeds at all.
        says_limit, says_speed, says_passing: Whether it speaks of the limit, of speed, of passing somebody.
    """

    def __init__(self, text: str, facts: Facts, where: FactSurroundings, effects: Sequence[Effect]) -> None:
        text = text[:_MAX_CHARS]
        self.facts = facts
        self.effects = tuple(effect for effect in effects if not effect.failed)
        self.crossing = where.crossing or any(True for _ in facts.of("turn", "go"))
        self.claims = claims_of(text, crossing=self.crossing)
        self.firm = {claim.matter for claim in self.claims if claim.firm and not claim.denied}
        self.told = {claim.matter for claim in self.claims if not claim.denied}
        self.numbers = Numbers(facts, where)
        self.moves = [(p, e) for p, e in facts.of("lane") if e.sides - {0} or not e.sides]
        self.turns = list(facts.of("turn"))
        self.speeds = list(facts.of("speed"))
        self.alone = _ALONE.search(text) is not None
        self.describes = describes(text)
        self.says_limit = "limit" in text.lower()
        self.says_speed = _SPEED.search(text) is not None
        self.says_passing = _PASSING.search(text) is not None

    def is_stop(self, event: Event) -> bool:
        """Whether a wish is for standing still."""
        return not event.reference and any(not t.factor and abs(t.offset) < 0.05 and not t.bound for t in event.terms)

    def driven_sides(self) -> frozenset[int]:
        """Sides to which lanes were changed where the program was run."""
        left = any(effect.leftmost < 0 for effect in self.effects)
        right = any(effect.rightmost > 0 for effect in self.effects)
        return frozenset(side for side, gone in ((-1, left), (1, right)) if gone)

    def wrong_number(self, claim: Claim, quantity: Quantity, line: int | None) -> Mismatch:
        """A number of the text that is none of the program's."""
        known = self.numbers.told(quantity.dimension)
        instead = f"it has {known}" if known else "it has no such number"
        return Mismatch("wrong-number", claim.sentence, f"{instead}, not {quantity.said}", line)


def moving(sides: frozenset[int]) -> str:
    """A change of lanes in words."""
    named = [SIDE_WORDS[side] for side in sorted(sides - {0})]
    return f"changes lanes to the {' or '.join(named)}" if named else "changes lanes"


def turning(sides: frozenset[int]) -> str:
    """A way over an intersection in words."""
    named = ["goes straight on" if side == 0 else f"turns {SIDE_WORDS[side]}" for side in sorted(sides)]
    return " or ".join(named)


def sign_of(off_mps: float) -> int:
    """Whether a speed rose (+1) or fell (-1) by more than a little."""
    return (off_mps >= DRIVEN_SPEED_MPS) - (off_mps <= -DRIVEN_SPEED_MPS)


def faster(signs: set[int]) -> str:
    """Ways in which a speed differs, in words."""
    return "faster and slower" if {-1, 1} <= signs else "faster" if 1 in signs else "slower"
