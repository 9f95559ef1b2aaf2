"""Comparing where a text says the car goes with where its program goes: lanes, turns, stops."""

from __future__ import annotations

from collections.abc import Iterator

from chauffeur.concept import Mismatch
from chauffeur.safety.faithfulness.claim import Claim
from chauffeur.safety.faithfulness.comparison import (
    Comparison,
    moving,
    turning,
)
from chauffeur.safety.faithfulness.facts import Event


class Ways(Comparison):
    """Lanes, turns and stops."""

    def lane(self, claim: Claim) -> Iterator[Mismatch]:
        """A claim about lanes, overtaking, going back or pulling over."""
        if claim.denied:
            yield from self._denied_lane(claim)
            return
        if not self.moves:
            if (claim.matter == "back" and self.crossing) or (not claim.firm and self.firm):
                return
            yield Mismatch("not-done", claim.sentence, "it never changes lanes")
            return
        sides = frozenset(side for _, event in self.moves for side in event.sides) - {0}
        known = all(event.sides for _, event in self.moves)
        if not known and (driven := self.driven_sides()):
            sides, known = driven, True
        first = self.moves[0][1]
        if claim.matter == "back":
            if not claim.firm and self.firm:
                return
            named = bool(claim.sides & sides)
            if known and not named and not any(event.back for _, event in self.moves) and len(sides) < 2:
                yield Mismatch("not-done", claim.sentence, "it never goes back to a lane it was in", first.line)
                return
            returning = [event for _, event in self.moves if event.back]
            told = frozenset(side for event in returning for side in event.sides) - {0}
            if claim.sides and told and not claim.sides & told:
                yield self._other_side(claim, told, returning[0])
            return
        if claim.matter == "pull over" and not claim.sides:
            if known and 1 not in sides:
                yield self._other_side(claim, sides, first)
            return
        out = frozenset(side for _, event in self.moves if not event.back for side in event.sides) - {0}
        if out and (claim.matter == "overtake" or "back" in self.told):
            sides = out
        if known and claim.sides and not claim.sides & sides:
            yield self._other_side(claim, sides, first)
        elif known and claim.matter == "lane" and claim.count:
            yield from self._lane_count(claim)

    def _lane_count(self, claim: Claim) -> Iterator[Mismatch]:
        moves = [event for _, event in self.moves if not claim.sides or event.sides & claim.sides]
        if not moves or any(event.times == 0 or event.times > 4 for event in moves):
            return
        most = sum(event.times for event in moves)
        if claim.count == 99:
            return
        if claim.count not in (1, most):
            lanes = "1 lane" if most == 1 else f"{most} lanes"
            yield Mismatch("wrong-number", claim.sentence, f"it crosses {lanes} at most", moves[0].line)

    def _denied_lane(self, claim: Claim) -> Iterator[Mismatch]:
        positive = any(
            one.matter in ("lane", "overtake", "back", "pull over") and not one.denied and one.firm
            for one in self.claims
        )
        for _, event in self.moves:
            if claim.matter == "back":
                wrong = event.back
            elif claim.sides:
                wrong = bool(event.sides) and event.sides <= claim.sides
            else:
                wrong = not positive and claim.matter in ("lane", "overtake")
            if wrong:
                yield Mismatch("not-claimed", claim.sentence, f"it {moving(event.sides)}", event.line)
                return

    def _other_side(self, claim: Claim, sides: frozenset[int], event: Event) -> Mismatch:
        return Mismatch("wrong-side", claim.sentence, f"it {moving(sides)}", event.line)

    def turn(self, claim: Claim) -> Iterator[Mismatch]:
        """A claim about the way over an intersection."""
        done = frozenset(side for _, event in self.turns for side in event.sides)
        if claim.denied:
            if claim.sides and claim.sides <= done and len(claim.sides) == 1:
                yield Mismatch("not-claimed", claim.sentence, f"it {turning(done)}", self.turns[0][1].line)
            return
        if not self.turns:
            if self.moves and claim.sides & {s for _, e in self.moves for s in e.sides}:
                return
            yield Mismatch("not-done", claim.sentence, "it chooses no way over the intersection")
        elif claim.sides and not claim.sides & done:
            yield Mismatch("wrong-side", claim.sentence, f"it {turning(done)}", self.turns[0][1].line)

    def stop(self, claim: Claim) -> Iterator[Mismatch]:
        """A claim about stopping."""
        stops = [event for _, event in self.speeds if self.is_stop(event)]
        if claim.denied:
            positive = any(one.matter in ("stop", "pull over") and not one.denied for one in self.claims)
            if stops and not positive:
                yield Mismatch("not-claimed", claim.sentence, "it stops", stops[0].line)
            return
        if claim.exact and stops:
            last = max(place for place, event in self.speeds if self.is_stop(event))
            for place, event in self.speeds:
                if place > last and not event.reference and any(t.offset > 1.0 and not t.bound for t in event.terms):
                    yield Mismatch("not-claimed", claim.sentence, "it drives on afterwards", event.line)
                    return
        if stops or self.crossing or not claim.firm or any(effect.stood for effect in self.effects):
            return
        if any(not event.terms for _, event in self.speeds):
            return
        yield Mismatch("not-done", claim.sentence, "it never stops")
