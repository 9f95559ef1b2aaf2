"""Comparing the speeds, gaps and times of a text with those of its program."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from chauffeur.concept import Mismatch
from chauffeur.language.quantities import Quantity
from chauffeur.safety.faithfulness.claim import Claim
from chauffeur.safety.faithfulness.comparison import (
    DRIVEN_SPEED_MPS,
    Comparison,
    faster,
    sign_of,
)

_CLOSE_TO_LIMIT_MPS: Final = 0.3


class Rates(Comparison):
    """Speeds, gaps and times."""

    def speed(self, claim: Claim) -> Iterator[Mismatch]:
        """A claim about the speed."""
        if claim.denied:
            return
        speeds = [event for _, event in self.speeds]
        if not speeds:
            if claim.firm and self._needs_a_speed(claim):
                yield Mismatch("not-done", claim.sentence, "it sets no speed")
            return
        if claim.at_limit and (beside := self.numbers.beside_limit()):
            yield from self._beside_limit(claim, beside, speeds[0].line)
            return
        sign = 0 if claim.at_limit else claim.sign
        signs = self.numbers.signs() or self._driven_signs()
        line = next((event.line for event in speeds if event.terms), speeds[0].line)
        if sign and signs and sign not in signs and 0 not in signs:
            yield Mismatch("wrong-sign", claim.sentence, "it drives " + faster(signs), line)
            return
        if sign and signs == {0} and not self.numbers.unknown_speed:
            said = [q for one in self.claims if one.matter == "speed" and one.firm for q in one.quantities]
            if not any(self.numbers.supports(q, exact=True) for q in said if q.dimension == "speed"):
                yield Mismatch("not-done", claim.sentence, "it keeps its speed", line)
            return
        if self.numbers.follows and not claim.exact:
            return  # it goes by the gap: a speed told is an example of what comes of that
        for quantity in claim.quantities:
            if not self.numbers.supports(quantity, exact=claim.exact) and not self._driven_at(quantity):
                yield self.wrong_number(claim, quantity, line)
                return

    def _needs_a_speed(self, claim: Claim) -> bool:
        """Whether a claim cannot hold in a program that sets no speed; the autopilot brakes for a sign by itself."""
        if self.crossing:
            return bool(claim.sign) and (claim.exact or not self.turns)
        foreign = any(not self.numbers.supports(one) for one in claim.quantities)
        return (not self.numbers.follows and bool(claim.sign or foreign)) or bool(claim.sign and claim.exact)

    def _beside_limit(self, claim: Claim, beside_mps: list[float], line: int | None) -> Iterator[Mismatch]:
        """Of a speed that is told by the limit, in a program that goes by it."""
        told = [claim.sign * abs(one.value) for one in claim.quantities if one.dimension == "speed"] or [0.0]
        if all(abs(one - own) > _CLOSE_TO_LIMIT_MPS for one in told for own in beside_mps):
            kind = "wrong-sign" if all(told[0] * own < 0.0 for own in beside_mps) else "wrong-number"
            known = " or ".join(f"{own:+.4g} m/s" for own in dict.fromkeys(beside_mps))
            yield Mismatch(kind, claim.sentence, f"it drives at the limit {known}", line)

    def _driven_signs(self) -> set[int]:
        """Which way the speed changed where the program was run."""
        return {sign_of(effect.speeds_mps[1] - effect.speeds_mps[0]) for effect in self.effects}

    def _driven_at(self, quantity: Quantity) -> bool:
        """Whether the runs of a program whose numbers cannot be read ended at a speed that is told."""
        return (
            quantity.dimension == "speed"
            and self.numbers.unknown_speed
            and any(abs(effect.speeds_mps[1] - quantity.value) < DRIVEN_SPEED_MPS for effect in self.effects)
        )

    def gap(self, claim: Claim) -> Iterator[Mismatch]:
        """A claim about the gap or the headway."""
        if claim.denied:
            return
        headways = [event for _, event in self.facts.of("headway")]
        about = bool(headways) or self.numbers.follows
        line = headways[0].line if headways else self.numbers.gap_line
        if not about:
            # Who gets slower leaves more room, and who gets faster closes up.
            if claim.firm and (claim.quantities or (claim.sign and -claim.sign not in self.numbers.signs())):
                yield Mismatch("not-done", claim.sentence, "it does nothing about the gap")
            return
        signs = self.numbers.gap_signs()
        if claim.sign and signs and claim.sign not in signs and 0 not in signs:
            way = "a larger" if 1 in signs else "a smaller"
            yield Mismatch("wrong-sign", claim.sentence, f"it wants {way} gap", line)
            return
        for quantity in claim.quantities:
            if not self.numbers.supports(quantity):
                yield self.wrong_number(claim, quantity, line)
                return

    def wait(self, claim: Claim) -> Iterator[Mismatch]:
        """A claim about time that passes."""
        if claim.denied or not claim.firm:
            return
        for quantity in claim.quantities:
            if not self.numbers.supports(quantity):
                yield self.wrong_number(claim, quantity, None)
                return
