"""Whether what a text claims is what the program does."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from chauffeur.safety.alignment.claim import Claim
from chauffeur.safety.alignment.comparing import Mismatch
from chauffeur.safety.alignment.duties import Duties
from chauffeur.safety.alignment.facts import Effect, Facts, Surroundings
from chauffeur.safety.alignment.rates import Rates
from chauffeur.safety.alignment.ways import Ways


@dataclass(frozen=True, slots=True)
class Alignment:
    """How well a text describes a program.

    Attributes:
        aligned: Whether nothing was found that is wrong.
        score: 1 where every claim holds; the more claims fail, the less.
        mismatches: What is wrong, in the order of the text.
        claims: How many claims were compared.
    """

    aligned: bool
    score: float
    mismatches: tuple[Mismatch, ...]
    claims: int


def judge(
    text: str, facts: Facts, surroundings: Surroundings | None = None, effects: Sequence[Effect] = ()
) -> Alignment:
    """Compare a text with what its program does.

    Args:
        text: The thoughts R.
        facts: What reading finds in P.
        surroundings: Where the ego is; without it a plain target speed is neither faster nor slower.
        effects: What P did on copies of the scene, where it was run. They speak where reading is at a loss.
    """
    if not facts.readable:
        return Alignment(True, 1.0, (), 0)
    case = _Case(text, facts, surroundings or Surroundings(), effects)
    found = list(dict.fromkeys(case.mismatches()))
    told = sum(claim.firm for claim in case.claims)
    held = max(0, told - len(found))
    score = 1.0 if not found else held / (held + 2.0 * len(found))
    return Alignment(not found, score, tuple(found), told)


class _Case(Ways, Rates, Duties):
    """All comparisons of one text with one program."""

    def mismatches(self) -> Iterator[Mismatch]:
        for claim in self.claims:
            if claim.aside or (not claim.firm and self._outweighed(claim)):
                continue
            match claim.matter:
                case "lane" | "overtake" | "back" | "pull over":
                    yield from self.lane(claim)
                case "turn":
                    yield from self.turn(claim)
                case "stop":
                    yield from self.stop(claim)
                case "speed":
                    yield from self.speed(claim)
                case "gap":
                    yield from self.gap(claim)
                case "wait":
                    yield from self.wait(claim)
                case "check":
                    yield from self.check(claim)
                case "other speed" | "other gap" | "behind":
                    yield from self.condition(claim)
                case "stay" | "nothing":
                    yield from self.stay(claim)
        yield from self.order()
        yield from self.unclaimed()

    def _outweighed(self, claim: Claim) -> bool:
        """Whether something firm is said of the matter of a loose claim, or nothing is to be done at all."""
        lanes = {"lane", "overtake", "back", "pull over", "stay"}
        matters = lanes if claim.matter in lanes else {claim.matter, "nothing"}
        return bool(matters & self.firm) or "nothing" in self.firm
