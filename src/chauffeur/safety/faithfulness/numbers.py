"""The numbers of a program, by what they measure, to hold the numbers of a text against."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from chauffeur.concept.units import M_PER_CAR_LENGTH
from chauffeur.language.quantities import Quantity
from chauffeur.safety.faithfulness.facts import Facts, FactSurroundings
from chauffeur.safety.faithfulness.values import Term, in_order

USUAL_HEADWAY_S: Final = 1.5
"""What the car keeps until a program sets another."""

_SAME_SPEED_MPS: Final = 0.4
"""A change of less is none."""
_CLOSE_SPEED_MPS: Final = 0.26
"""How far a speed may be off for having been rounded in another unit (half a mph)."""
_CLOSE_SHARE: Final = 0.012
_CLOSE_TIME_S: Final = 0.06
_CLOSE_DISTANCE_M: Final = 0.3


class Numbers:
    """What a program's numbers mean where it is."""

    def __init__(self, facts: Facts, where: FactSurroundings) -> None:
        self._facts = facts
        self._where = where
        self._speeds = [event for _, event in facts.of("speed")]
        self._headways = [event for _, event in facts.of("headway")]
        self._steered = [event for _, event in facts.of("gap")]
        gaps = [mark for mark in facts.marks if mark.base == "gap"]
        self._gaps = gaps
        lines = [event.line for event in self._steered] or [mark.line for mark in gaps]
        self.gap_line = lines[0] if lines else None
        self.unknown_speed = any(event.open for event in self._speeds)
        # Speed by the speed of the vehicle ahead: a gap is kept.
        self.of_others = bool(self._speeds) and all(term.base == "other" for e in self._speeds for term in e.terms)
        self.follows = bool(self._steered) or (bool(gaps) and self.of_others)

    # Signs -----------------------------------------------------------------------------------------------------

    def signs(self) -> set[int]:
        """Ways in which the speeds wished for differ from the present one: -1, 0, +1; empty where it is not known."""
        found: set[int] = set()
        for term in self._wanted():
            sign = self.sign(term)
            if sign is None:
                return set()
            found.add(sign)
        return found

    def _wanted(self) -> list[Term]:
        """The speeds wanted for themselves; those wanted for the sake of others only where there are no such."""
        terms: list[Term] = []
        for event in self._speeds:
            alternatives = in_order(event.terms)
            free = [term for term in alternatives if not term.bound]
            # A slower vehicle ahead is followed for the time being.
            free = [term for term in free if term.base != "other"] or free
            terms += free if free or event.open else alternatives
        own = [term for term in terms if not term.factor or term.base == "limit"]
        return own or terms

    def sign(self, term: Term) -> int | None:
        """Whether a speed is more (+1) or less (-1) than the present one; None where it is not known."""
        speed = self.speed(term)
        now = self._where.speed_mps
        if term.base == "ego" and term.factor == 1.0:
            off = term.offset
        elif term.base == "ego" and now is None:
            return _sign(term.factor - 1.0, 0.01)
        elif speed is None or now is None:
            return None
        else:
            off = speed - now
        return _sign(off, _SAME_SPEED_MPS)

    def speed(self, term: Term) -> float | None:
        """A speed in m/s, where what it counts from is known."""
        if not term.factor:
            return term.offset
        base = {"ego": self._where.speed_mps, "limit": self._where.limit_mps, "other": self._where.other_mps}.get(
            term.base
        )
        return None if base is None else term.factor * base + term.offset

    def gap_signs(self) -> set[int]:
        """Ways in which the gap wished for differs from the present one."""
        found: set[int] = set()
        now = self._where.gap_m
        for event in self._steered:
            for term in event.terms:
                gap = self._gap(term)
                if term.base == "gap":
                    found.add(_sign(term.offset if term.factor == 1.0 else term.factor - 1.0, 0.01))
                elif gap is not None and now is not None:
                    found.add(_sign(gap - now, 0.5))
        if found:
            return found
        for event in self._headways:
            for term in event.terms:
                if not term.factor:
                    found.add(_sign(term.offset - USUAL_HEADWAY_S, 0.01))
                elif term.base == "per speed" and now is not None:
                    found.add(_sign(term.offset - now, 0.5))
                elif term.base == "headway":
                    found.add(_sign(term.offset if term.factor == 1.0 else term.factor - 1.0, 0.01))
                else:
                    return set()
        if not self._headways:
            if now is None:
                return set()
            found = {_sign(mark.value - now, 0.5) for mark in self._gaps}
        return found

    def _gap(self, term: Term) -> float | None:
        """A gap in m, where what it counts from is known."""
        if not term.factor:
            return term.offset
        base = {"gap": self._where.gap_m, "ego": self._where.speed_mps}.get(term.base)
        return None if base is None else term.factor * base + term.offset

    # Numbers ---------------------------------------------------------------------------------------------------

    def supports(self, quantity: Quantity, *, exact: bool = False) -> bool:
        """Whether a number of the text is one of the program's, or one of the situation."""
        value = abs(quantity.value)
        match quantity.dimension:
            case "speed":
                known = [*self._speed_numbers(exact=exact)]
                turning = any(True for _ in self._facts.of("turn"))
                if self.unknown_speed and (turning or not self._wanted()):
                    known += self._facts.literals
                if all(term.factor for term in self._wanted()):
                    known += [mark.value for mark in self._facts.marks if mark.base == "ego" and mark.compared]
                if not exact:
                    known += [mark.value for mark in self._facts.marks if mark.base in ("other", "ego")]
                    known += [
                        one for one in (self._where.speed_mps, self._where.limit_mps, self._where.other_mps) if one
                    ]
                return _near(value, known, _CLOSE_SPEED_MPS)
            case "distance":
                return _near(value, [*self._distances()], _CLOSE_DISTANCE_M)
            case "time":
                return _near(value, [*self._times()], _CLOSE_TIME_S)
            case "share":
                return self._share(value)
            case _:
                return True

    def beside_limit(self) -> list[float]:
        """How far the speeds wanted are from the limit, m/s; empty where none counts from the limit."""
        return [term.offset for term in self._wanted() if term.base == "limit" and term.factor == 1.0]

    @property
    def by_limit(self) -> bool:
        """Whether the limit is all that the speed is set by."""
        return bool(self._wanted()) and all(term.base == "limit" for term in self._wanted())

    def matches(self, term: Term, quantity: Quantity) -> bool:
        """Whether a speed is a number of the text."""
        speed = None if term.base == "other" else self.speed(term)
        values = [abs(term.offset)] if speed is None else [abs(term.offset), speed]
        return quantity.dimension == "speed" and _near(quantity.value, values, _CLOSE_SPEED_MPS)

    def told(self, dimension: str) -> str:
        """The program's own numbers of a kind, in words; empty where there are none."""
        match dimension:
            case "speed":
                known, unit = [term.offset for e in self._speeds for term in in_order(e.terms) if term.offset], "m/s"
            case "distance":
                known, unit = [mark.value for mark in self._gaps], "m"
            case "time":
                known = [t.offset for e in self._headways for t in in_order(e.terms)] + list(self._facts.spans_s)
                unit = "s"
            case _:
                return ""
        shown = [f"{value:.4g} {unit}" for value in dict.fromkeys(round(abs(one), 3) for one in known)]
        return " and ".join(shown[:3])

    def _speed_numbers(self, *, exact: bool) -> Iterator[float]:
        for event in self._speeds:
            others_only = all(term.base == "other" for term in event.terms)
            for term in event.terms:
                speed = self.speed(term) if others_only or term.base != "other" else None
                if speed is not None:
                    yield speed
                if term.factor and not exact:
                    yield abs(term.offset)
                if not exact and speed is not None:
                    yield from (abs(speed - one) for one in (self._where.speed_mps, self._where.limit_mps) if one)
                if term.base == "limit":
                    yield self._where.limit_mps or 0.0

    def _distances(self) -> Iterator[float]:
        bases = {"past", "behind", "sign"} if self._steered else {"gap", "past", "behind", "sign"}
        yield from (abs(mark.value) for mark in self._facts.marks if mark.base in bases)
        for event in self._steered:
            for term in event.terms:
                gap = self._gap(term)
                yield from (abs(one) for one in (gap, term.offset) if one)
                if gap is not None and self._where.gap_m is not None:
                    yield abs(gap - self._where.gap_m)
        for event in self._headways:
            for term in event.terms:
                if term.base == "per speed":
                    yield term.offset
                elif not term.factor and self._where.speed_mps is not None:
                    yield term.offset * self._where.speed_mps
                    yield term.offset * self._where.speed_mps + M_PER_CAR_LENGTH
        for known in (self._where.gap_m, self._where.sign_m):
            if known is not None:
                yield known

    def _times(self) -> Iterator[float]:
        yield from self._facts.spans_s
        yield 0.1  # the control period
        yield from (term.factor for event in self._steered for term in event.terms if term.base == "ego")
        for event in self._facts.events:
            for term in event.terms:
                if event.deed in ("headway", "wait") and not term.factor:
                    yield term.offset
                if event.deed == "headway" and term.base == "per speed" and self._where.speed_mps:
                    yield term.offset / self._where.speed_mps
        yield USUAL_HEADWAY_S
        speed, gap = self._where.speed_mps, self._where.gap_m
        if speed and gap:
            yield gap / speed

    def _share(self, value: float) -> bool:
        factors = [term.factor for event in (*self._speeds, *self._steered) for term in event.terms if term.factor]
        if not any(factor != 1.0 for factor in factors):
            return True
        return any(abs(value - one) < 0.02 for f in factors for one in (f, abs(1.0 - f), 1.0 / f))


def _near(value: float, known: list[float], slack: float) -> bool:
    return any(abs(value - one) <= max(slack, _CLOSE_SHARE * abs(one)) for one in known)


def _sign(off: float, slack: float) -> int:
    return (off >= slack) - (off <= -slack)
