"""A text with its claims beside a program with its facts: what every comparison of the two goes by."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from chauffeur.safety.faithfulness.claims import Matter, claims_of, plain_words
from chauffeur.safety.faithfulness.facts import Effect, Facts, FactSurroundings
from chauffeur.safety.faithfulness.numbers import Numbers

DRIVEN_SPEED_MPS: Final = 1.0
"""Tolerance of a driven speed against one that is told."""
_ALONE: Final = re.compile(
    r"\bthat(?:'s| is) (?:all|it)\b|\bnothing (?:else|but|more)\b|\bonly [\w\s]{3,40} changes\b", re.IGNORECASE
)
"""Words by which a text says that it has told everything."""
_MENTIONS: Final[dict[Matter, re.Pattern[str]]] = {
    "speed": re.compile(r"\b(?:speed|pace|limit|m/s|km/h|mph|pass(?:ing)?)\b", re.IGNORECASE),
    "stop": re.compile(r"\b(?:stop|halt|stand|zero\b|0 m/s)", re.IGNORECASE),
    "back": re.compile(r"\b(?:back|return)\b", re.IGNORECASE),
    "turn": re.compile(r"\b(?:left|right|straight|across)\b", re.IGNORECASE),
}
"""Words beside which a deed counts as mentioned, however it was read."""
_SIDE_WORDS: Final = {-2: "round", -1: "left", 0: "straight on", 1: "right", 2: "round"}
"""Quarter turns to the right, and lanes, in words; half a turn is one whichever way it was driven."""


class Comparison:
    """A text with its claims, and a program with its facts.

    Attributes:
        facts, numbers: What reading finds in the program, and its numbers.
        moves, turns, speeds: Its deeds of those kinds, with their places.
        effects: What it did where it was run without failing.
        driven_sides, driven_signs: Sides to which lanes, and ways in which the speed, changed there.
        crossing: Whether its way leads over an intersection.
        claims: What the text claims.
        firm, told: Matters that it claims firmly, and at all.
        mentions: What it has words of, whether or not they were read as acts.
        alone: Whether it says that it has told everything.
        unsure: Whether some of what it plans was not read with certainty.
    """

    def __init__(self, text: str, facts: Facts, where: FactSurroundings, effects: Sequence[Effect] = ()) -> None:
        self.facts = facts
        self.numbers = Numbers(facts, where)
        self.moves = [(p, deed) for p, deed in facts.of("lane") if deed.sides != frozenset({0})]
        self.turns, self.speeds = facts.of("turn"), facts.of("speed")
        self.effects = tuple(effect for effect in effects if not effect.failed)
        self.driven_sides = frozenset(side for effect in self.effects for side in effect.sides)
        self.driven_signs = {sign_of(effect.speeds_mps[1] - effect.speeds_mps[0]) for effect in self.effects}
        self.crossing = where.crossing or bool(facts.of("turn", "go"))
        self.claims = claims_of(text, crossing=self.crossing)
        self.firm = {claim.matter for claim in self.claims if claim.firm and not claim.denied}
        self.told = {claim.matter for claim in self.claims if not claim.denied and not claim.aside}
        said = plain_words(text)
        self.mentions = {matter for matter, words in _MENTIONS.items() if words.search(said)}
        self.alone = _ALONE.search(text) is not None
        self.unsure = any(claim.unsure for claim in self.claims)


def moving(sides: frozenset[int], *, driven: bool = False) -> str:
    """A change of lanes in words: what a program does or, of one `driven`, what was done."""
    named = [_SIDE_WORDS[side] for side in sorted(sides - {0})]
    changes = "changed lanes" if driven else "changes lanes"
    return f"{changes} to the {' or '.join(named)}" if named else changes


def turning(sides: frozenset[int], *, driven: bool = False) -> str:
    """A way over an intersection in words: what a program does or, of one `driven`, what was done."""
    on, turns = ("went straight on", "turned") if driven else ("goes straight on", "turns")
    return " or ".join(on if side == 0 else f"{turns} {_SIDE_WORDS[side]}" for side in sorted(sides))


def sign_of(off_mps: float) -> int:
    """Sign of a change of speed; 0 for a small one."""
    return (off_mps >= DRIVEN_SPEED_MPS) - (off_mps <= -DRIVEN_SPEED_MPS)


def faster(signs: set[int]) -> str:
    """Ways in which a speed differs, in words."""
    return "faster and slower" if {-1, 1} <= signs else "faster" if 1 in signs else "slower"
