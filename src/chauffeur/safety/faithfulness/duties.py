"""Comparing what a text says something depends on, what it leaves alone, and its order, with its program."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from chauffeur.concept import Mismatch
from chauffeur.safety.faithfulness.claim import Claim
from chauffeur.safety.faithfulness.comparison import (
    Comparison,
    faster,
    moving,
    turning,
)
from chauffeur.safety.faithfulness.facts import Event
from chauffeur.safety.faithfulness.numbers import USUAL_HEADWAY_S
from chauffeur.safety.faithfulness.values import Term

_SAME_S: Final = 0.01
_KEPT: Final = Term("headway", 1.0, 0.0)
"""The headway that is set already."""


class Duties(Comparison):
    """Checks, conditions, what is left alone or not mentioned, and order."""

    def check(self, claim: Claim) -> Iterator[Mismatch]:
        """A claim that it is asked whether a way is free."""
        if not claim.firm or claim.denied:
            return
        leaving = [event for _, event in self.facts.of("go")]
        if self.crossing and (leaving or self.turns):
            if not any(tag.startswith("safe") for event in self.facts.events for tag in event.depends):
                line = leaving[0].line if leaving else None
                yield Mismatch("missing-condition", claim.sentence, "it never asks whether the way is free", line)
            return
        moves = [event for _, event in self.moves]
        if not moves:
            if not any(tag.startswith("safe") for event in self.facts.events for tag in event.depends):
                yield Mismatch("missing-condition", claim.sentence, "it never asks whether a lane is free")
            return
        unchecked = [event for event in moves if not event.checked]
        named = [event for event in unchecked if claim.sides and event.sides & claim.sides]
        if len(unchecked) == len(moves) or named:
            event = (named or unchecked)[0]
            yield Mismatch(
                "missing-condition", claim.sentence, "it changes lanes without asking whether it may", event.line
            )

    def condition(self, claim: Claim) -> Iterator[Mismatch]:
        """A claim that something depends on other vehicles."""
        if claim.denied or not claim.firm:
            return
        tags = {
            "other speed": {"other speed"},
            "other gap": {"gap", "past", "behind", "sign"},
            "behind": {"behind", "rear", "past"},
        }
        wanted = tags[claim.matter]
        marked = any(mark.base in wanted for mark in self.facts.marks)
        if not marked and not any(wanted & event.depends for event in self.facts.events):
            thing = {"other speed": "the speed of another vehicle", "other gap": "the gap", "behind": "who is behind"}
            yield Mismatch("missing-condition", claim.sentence, f"nothing in it depends on {thing[claim.matter]}")
            return
        for quantity in claim.quantities:
            if not self.numbers.supports(quantity):
                yield self.wrong_number(claim, quantity, None)
                return

    def stay(self, claim: Claim) -> Iterator[Mismatch]:
        """A claim that something is left as it is."""
        lanes = {"lane", "overtake", "back", "pull over", "turn"}
        about = claim.sides  # 1 the lane, 2 the speed, 3 the gap
        everything = not about
        if (everything or 1 in about) and self.moves and not lanes & self.firm:
            yield Mismatch("not-claimed", claim.sentence, f"it {moving(self.moves[0][1].sides)}", self.moves[0][1].line)
        if (everything or 2 in about) and not self.firm & {"speed", "stop", "pull over", "overtake"}:
            signs = self.numbers.signs()
            if signs and 0 not in signs and not self.numbers.follows:
                yield Mismatch("not-claimed", claim.sentence, "it drives " + faster(signs), self.speeds[0][1].line)
        if 3 in about and "gap" not in self.firm and (changed := self._headways_changed()):
            yield Mismatch("not-claimed", claim.sentence, "it sets another headway", changed[0].line)
        if everything and self.turns and not lanes & self.firm:
            yield Mismatch(
                "not-claimed", claim.sentence, f"it {turning(self.turns[0][1].sides)}", self.turns[0][1].line
            )

    def unclaimed(self) -> Iterator[Mismatch]:
        """What the program does and the text does not mention."""
        told = self.told
        if not self.describes:
            return
        lanes = {"lane", "overtake", "back", "pull over"}
        if self.moves and not told & (lanes | {"turn"}):
            event = self.moves[0][1]
            yield Mismatch("not-claimed", "", f"it {moving(event.sides)}", event.line)
        if self.turns and not told & (lanes | {"turn"}):
            yield Mismatch("not-claimed", "", f"it {turning(self.turns[0][1].sides)}", self.turns[0][1].line)
        backs = [event for _, event in self.moves if event.back]
        stays_there = "back" not in told and len(self._sides_told()) < 2 and told & {"stay", "lane", "overtake"}
        if backs and stays_there:
            yield Mismatch("not-claimed", "", "it goes back to its lane afterwards", backs[0].line)
        stops = [event for _, event in self.speeds if self.is_stop(event)]
        if stops and not self.crossing and not told & {"stop", "pull over"} and not self._says_zero():
            yield Mismatch("not-claimed", "", "it stops", stops[0].line)
        leaving = [event for _, event in self.facts.of("go")]
        if leaving and told and not told & {"turn", "lane", "check", "back"}:
            yield Mismatch("not-claimed", "", "it drives on over the intersection", leaving[0].line)
        signs = self.numbers.signs()
        also = {"speed", "stop", "pull over"}
        also |= set() if self.alone else {"overtake", "gap", "turn", "other speed"}
        quiet = not told & also and not (self.numbers.by_limit and self.says_limit)
        quiet = quiet and not (self.moves and self.says_passing) and not (self.numbers.of_others and self.says_speed)
        if signs and 0 not in signs and quiet and not self.numbers.follows:
            yield Mismatch("not-claimed", "", "it drives " + faster(signs), self.speeds[0][1].line)
        if self.alone and "gap" not in told and (changed := self._headways_changed()):
            yield Mismatch("not-claimed", "", "it sets another headway", changed[0].line)

    def _headways_changed(self) -> list[Event]:
        """Where the program sets another headway than the one that is kept without it."""
        return [
            event
            for _, event in self.facts.of("headway")
            if any(t != _KEPT and (t.factor or abs(t.offset - USUAL_HEADWAY_S) > _SAME_S) for t in event.terms)
        ]

    def _sides_told(self) -> frozenset[int]:
        return frozenset(s for c in self.claims if c.matter in ("lane", "overtake", "back") for s in c.sides)

    def _says_zero(self) -> bool:
        return any(q.value == 0.0 for claim in self.claims for q in claim.quantities)

    def order(self) -> Iterator[Mismatch]:
        """Two things that the text tells in another order than the program does them."""
        timed = [claim for claim in self.claims if claim.firm and not claim.denied]
        for one in timed:
            for other in timed:
                if not one.order < other.order or one.matter == other.matter or not (one.told or other.told):
                    continue
                first, second = self._places(one), self._places(other)
                if first and second and min(first) > max(second):
                    later = self.facts.events[min(first)]
                    yield Mismatch(
                        "wrong-order", other.sentence, "it does that first, and the other thing later", later.line
                    )
                    return

    def _places(self, claim: Claim) -> list[int]:
        """Where in the program that is done which a claim tells."""
        match claim.matter:
            case "lane" | "pull over":
                return [p for p, e in self.moves if not claim.sides or e.sides & claim.sides]
            case "overtake":
                return [p for p, e in self.moves if not e.back]
            case "back":
                return [p for p, e in self.moves if e.back]
            case "stop":
                return [p for p, e in self.speeds if self.is_stop(e)]
            case "speed":
                return self._speed_places(claim)
            case "gap":
                return [p for p, _ in self.facts.of("headway")]
            case "wait":
                spans = [q.value for q in claim.quantities]
                return [
                    p
                    for p, e in self.facts.of("wait")
                    if e.times == 1 and any(abs(t.offset - s) < 0.06 for t in e.terms for s in spans)
                ]
            case _:
                return []

    def _speed_places(self, claim: Claim) -> list[int]:
        """Where a speed is set that a claim tells: by its number, a plain one first, or by its sign."""
        speeds = [(place, event) for place, event in self.speeds if not self.is_stop(event)]
        if not claim.quantities:
            return [p for p, e in speeds if claim.sign and any(self.numbers.sign(t) == claim.sign for t in e.terms)]
        told = [
            (place, term)
            for place, event in speeds
            for term in event.terms
            if any(self.numbers.matches(term, quantity) for quantity in claim.quantities)
        ]
        return [place for place, term in told if not term.factor] or [place for place, _ in told]
