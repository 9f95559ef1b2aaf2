"""Comparing what a text says with what happened in a drive.

A drive that was ended early says nothing of what had not happened by then, and traffic holds up what a program wishes:
a claim counts as not done only if nothing of it was seen.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from chauffeur.concept import Mismatch
from chauffeur.safety.faithfulness.claim import Claim
from chauffeur.safety.faithfulness.comparison import DRIVEN_SPEED_MPS, SIDE_WORDS, Comparison, turning
from chauffeur.safety.faithfulness.facts import Effect

_LANES: Final = frozenset({"lane", "overtake", "back", "pull over"})
_WORTH_MPS: Final = 2.0
"""A speed that is to change by less is not looked for in a drive."""
_WORTH_M: Final = 2.0
"""The same of a gap."""


class Driven(Comparison):
    """A text with its claims, and what happened."""

    def mismatches(self) -> Iterator[Mismatch]:
        """Where the two disagree; nothing where the program failed on the way."""
        for effect in self.effects:
            claims = [claim for claim in self.claims if claim.firm and not claim.aside]
            if self.crossing:
                yield from self._turned(claims, effect)
            else:
                yield from self._changed_lanes(claims, effect)
            for claim in claims:
                match claim.matter:
                    case "stop":
                        yield from self._stood(claim, effect)
                    case "speed" if claim.sign and not claim.denied and not effect.cut:
                        yield from self._drove(claim, effect)
                    case "gap" if claim.sign and not claim.denied and not effect.cut:
                        yield from self._followed(claim, effect)
                    case _:
                        pass

    def _changed_lanes(self, claims: list[Claim], effect: Effect) -> Iterator[Mismatch]:
        gone = self.driven_sides()
        told = [claim for claim in claims if claim.matter in _LANES and not claim.denied]
        if not told:
            denied = [claim for claim in claims if claim.matter == "stay" or claim.matter in _LANES]
            if gone and self.describes and (denied or not self.told & _LANES):
                yield Mismatch("not-claimed", denied[0].sentence if denied else "", f"it {_changed(gone)}")
            return
        if not gone:
            if not effect.cut:
                yield Mismatch("not-done", told[0].sentence, "it did not change lanes in this drive")
            return
        named = frozenset(side for claim in self.claims if claim.matter in _LANES for side in claim.sides)
        anywhere = any(not claim.sides or claim.matter != "lane" for claim in told)
        if not anywhere and gone - named:
            yield Mismatch("wrong-side", told[0].sentence, f"it {_changed(gone - named)}")
        elif not effect.cut:
            missed = next((claim for claim in told if claim.sides and not claim.sides & gone), None)
            if missed is not None:
                yield Mismatch("not-done", missed.sentence, f"in this drive it only {_changed(gone)}")
        ahead = effect.gaps_m[1]
        passing = next((claim for claim in told if claim.matter == "overtake"), None)
        if passing is not None and ahead is not None and ahead > 0.0 and not effect.cut:
            yield Mismatch("not-done", passing.sentence, "the vehicle ahead was never passed in this drive")

    def _turned(self, claims: list[Claim], effect: Effect) -> Iterator[Mismatch]:
        told = [one for one in claims if one.matter == "turn" and one.sides and not one.denied]
        claim = told[0] if told else None
        if claim is None or len(told) > 1 or effect.turned in claim.sides:
            return  # of several turns, the heading at the end tells none
        if effect.turned:
            yield Mismatch("wrong-side", claim.sentence, f"in this drive it {turning(frozenset({effect.turned}))}")
        elif not effect.cut:
            yield Mismatch("not-done", claim.sentence, "it did not come to turn in this drive")

    def _stood(self, claim: Claim, effect: Effect) -> Iterator[Mismatch]:
        if claim.denied and effect.stood:
            yield Mismatch("not-claimed", claim.sentence, "it stood still on the way")
        elif not claim.denied and not effect.stood and not effect.cut:
            yield Mismatch("not-done", claim.sentence, "it did not come to a stop in this drive")

    def _drove(self, claim: Claim, effect: Effect) -> Iterator[Mismatch]:
        start = effect.speeds_mps[0]
        wanted = [speed for _, event in self.speeds for term in event.terms if (speed := self.numbers.speed(term))]
        if wanted and all(abs(speed - start) < _WORTH_MPS for speed in wanted):
            return
        low, high = effect.extremes_mps
        if claim.sign == 1:
            if high < start + DRIVEN_SPEED_MPS:
                yield Mismatch("not-done", claim.sentence, f"it was never faster than {high:.1f} m/s in this drive")
        elif low > start - DRIVEN_SPEED_MPS:
            yield Mismatch("not-done", claim.sentence, f"it was never slower than {low:.1f} m/s in this drive")

    def _followed(self, claim: Claim, effect: Effect) -> Iterator[Mismatch]:
        before, after = effect.gaps_m
        if before is None or after is None or after < 0.0:
            return
        if claim.sign * (after - before) < -_WORTH_M:
            change = f"the gap went from {before:.0f} m to {after:.0f} m in this drive"
            yield Mismatch("wrong-sign", claim.sentence, change)


def _changed(sides: frozenset[int]) -> str:
    return f"changed lanes to the {' and '.join(SIDE_WORDS[side] for side in sorted(sides))}"
