"""Whether what a text claims is what the program does."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from chauffeur.concept import Faithfulness, Mismatch
from chauffeur.safety.faithfulness.claim import Claim
from chauffeur.safety.faithfulness.comparison import Comparison
from chauffeur.safety.faithfulness.driven import Driven
from chauffeur.safety.faithfulness.duties import Duties
from chauffeur.safety.faithfulness.facts import Effect, Facts, FactSurroundings
from chauffeur.safety.faithfulness.rates import Rates
from chauffeur.safety.faithfulness.ways import Ways


def judge(
    text: str, facts: Facts, surroundings: FactSurroundings | None = None, effects: Sequence[Effect] = ()
) -> Faithfulness:
    """Compare a text with what its program does.

    Args:
        text: The thoughts R.
        facts: What reading finds in P.
        surroundings: Where the ego is; without it a plain target speed is neither faster nor slower.
        effects: What P did on copies of the scene, where it was run. They speak where reading is at a loss.
    """
    if not facts.readable:
        return Faithfulness(True, 1.0, (), 0)
    case = _Case(text, facts, surroundings or FactSurroundings(), effects)
    return _weighed(case, case.mismatches())


def judge_drive(text: str, facts: Facts, surroundings: FactSurroundings, effect: Effect) -> Faithfulness:
    """Compare a text with what happened when its program drove.

    What reading the program finds by itself counts only where the drive shows it too.

    Args:
        text: The thoughts R.
        facts: What reading finds in P.
        surroundings: Where the ego was when the drive began.
        effect: What happened.
    """
    read = judge(text, facts, surroundings)
    resolved = judge(text, facts, surroundings, [effect])
    driven = Driven(text, facts, surroundings, [effect])
    seen = list(driven.mismatches())
    about = {(one.kind, one.sentence) for one in (*read.mismatches, *seen)}
    return _weighed(driven, [*(one for one in resolved.mismatches if (one.kind, one.sentence) not in about), *seen])


def _weighed(case: Comparison, mismatches: Iterable[Mismatch]) -> Faithfulness:
    found = tuple(dict.fromkeys(mismatches))
    told = sum(claim.firm for claim in case.claims)
    held = max(0, told - len(found))
    score = 1.0 if not found else held / (held + 2.0 * len(found))
    return Faithfulness(not found, score, found, told)


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
        matters = lanes if claim.matter in lanes else {claim.matter}
        return bool((matters | {"nothing"}) & self.firm)
