"""The numbers of a program where the ego is, to hold the numbers of a text against."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from chauffeur.concept.units import M_PER_CAR_LENGTH
from chauffeur.language.quantities import Quantity
from chauffeur.safety.faithfulness.facts import PERIOD_S, Facts, FactSurroundings, Term

USUAL_HEADWAY_S: Final = 1.5
"""Default headway, until a program sets another."""

_SAME_SPEED_MPS: Final = 0.4
"""A change of less is none."""
_SAME_GAP_M: Final = 0.5
_CLOSE_SHARE: Final = 0.012
_CLOSE: Final = {"speed": 0.26, "distance": 0.3, "time": 0.06, "share": 0.02}
"""Tolerance for rounding in another unit: half a mph, half a foot."""
NOW: Final = Term("ego", 1.0, 0.0)
"""The speed that is driven already."""


class Numbers:
    """Numbers of a program, evaluated where the ego is."""

    def __init__(self, facts: Facts, where: FactSurroundings) -> None:
        self._facts, self._where = facts, where
        self._speeds = [deed for _, deed in facts.of("speed")]
        self._headways = [deed for _, deed in facts.of("headway")]
        self._gaps = [deed for _, deed in facts.of("gap")]
        others = bool(self._speeds) and all(t.base == "other" for deed in self._speeds for t in deed.terms)
        self.follows = bool(self._gaps) or (others and any(base == "gap" for base, _ in facts.marks))
        self.unknown_speed = any(not deed.terms for deed in self._speeds)

    def wanted(self) -> list[Term]:
        """The speeds wanted for themselves; those for the sake of others or of bounds only where there are no such."""
        terms: list[Term] = []
        for deed in self._speeds:
            free = [term for term in deed.terms if not term.bound]
            free = [term for term in free if term.base != "other"] or free
            free = [term for term in free if term != NOW] or free  # what a ramp begins with
            terms += free or (deed.terms if len(self._speeds) == 1 else ())
        return [term for term in terms if not term.factor or term.base == "limit"] or terms

    def signs(self) -> set[int]:
        """Ways in which the speeds wished for differ from the present one; empty where it is not known."""
        now = self._where.speed_mps
        found = {self.sign(term) for term in self.wanted()}
        if not found and now is not None:
            bounds = [deed.bounds for deed in self._speeds if not deed.aimed]
            found = {_sign(low - now, _SAME_SPEED_MPS) for low, high in bounds if (low - now) * (high - now) > 0.0}
        return set() if None in found else {sign for sign in found if sign is not None}

    def sign(self, term: Term) -> int | None:
        """Sign of a speed against the present one; None where it is not known."""
        speed, now = self._where.worth(term), self._where.speed_mps
        if term.base == "ego" and (term.factor == 1.0 or now is None):
            return _sign(term.offset, _SAME_SPEED_MPS) if term.factor == 1.0 else _sign(term.factor - 1.0, 0.01)
        return None if speed is None or now is None else _sign(speed - now, _SAME_SPEED_MPS)

    def gap_signs(self) -> set[int]:
        """Ways in which the gap wished for differs from the present one; empty where it is not known."""
        now = self._where.gap_m
        found: set[int] = set()
        for deed in self._gaps:
            for term in deed.terms:
                gap = self._where.worth(term)
                if term.base == "gap":
                    found.add(_sign(term.offset or term.factor - 1.0, 0.01))
                elif gap is not None and now is not None:
                    found.add(_sign(gap - now, _SAME_GAP_M))
        for deed in self._headways if not found else ():
            for term in deed.terms:
                if not term.factor:
                    found.add(_sign(term.offset - USUAL_HEADWAY_S, 0.01))
                elif term.base == "per speed" and now is not None:
                    found.add(_sign(term.offset - now, _SAME_GAP_M))
        if not found and not self._headways and now is not None:
            found = {_sign(value - now, _SAME_GAP_M) for base, value in self._facts.marks if base == "gap"}
        return found

    def speeds_mps(self) -> list[float]:
        """The speeds it wants, where they are known."""
        found = [self._where.worth(term) for deed in self._speeds for term in deed.terms]
        return [speed for speed in found if speed is not None]

    def places(self, quantity: Quantity) -> list[int]:
        """Places in the program that set a speed, or let a time pass, that a text tells."""
        if quantity.dimension not in ("speed", "time"):
            return []
        kind = "speed" if quantity.dimension == "speed" else "wait"
        slack, now = _CLOSE[quantity.dimension], self._where.speed_mps
        if kind == "speed" and now is not None and abs(quantity.value - now) <= slack:
            return []  # told of the situation, too
        runs = [
            (place, deed)
            for place, deed in self._facts.of(kind)
            if not deed.stops and (kind == "speed" or deed.times == 1)
        ]
        worth = [(place, self._where.worth(term), term) for place, deed in runs for term in deed.terms]
        told = [(p, t) for p, value, t in worth if value is not None and abs(value - quantity.value) <= slack]
        return [place for place, term in told if not term.factor] or [place for place, _ in told]

    def supports(self, quantity: Quantity, *, exact: bool = False) -> bool:
        """True if a number of the text is one of the program's, or one of where the ego is."""
        unknown = self.unknown_speed and not self.wanted()
        if self._facts.of("turn"):  # the way to a stop sign is driven by a law of braking
            unknown = any(low < quantity.value < high for low, high in (deed.bounds for deed in self._speeds))
        if (unknown and quantity.dimension == "speed") or (quantity.dimension == "share" and not [*self._shares()]):
            return True
        known = {
            "speed": self._speed_numbers(exact=exact), "distance": self._distances(), "time": self._times(),
            "share": self._shares(),
        }  # fmt: skip
        slack = _CLOSE.get(quantity.dimension, 0.0)
        value = abs(quantity.value)
        return any(abs(value - abs(one)) <= max(slack, _CLOSE_SHARE * abs(one)) for one in known[quantity.dimension])

    def told(self, dimension: str) -> str:
        """The program's own numbers of a kind, in words; empty where there are none."""
        known: Iterable[float] = self._facts.spans_s
        if dimension in ("speed", "distance"):
            deeds = self._speeds if dimension == "speed" else self._gaps
            known = [term.offset for deed in deeds for term in deed.terms if term.offset]
        unit = {"speed": "m/s", "distance": "m", "time": "s"}.get(dimension, "")
        return " and ".join(f"{one:.4g} {unit}" for one in sorted({round(abs(one), 3) for one in known})[:3])

    def _speed_numbers(self, *, exact: bool) -> Iterator[float]:
        where = self._where
        situation = [one for one in (where.speed_mps, where.limit_mps, where.other_mps) if one]
        following = all(term.factor for term in self.wanted())
        for deed in self._speeds:
            for term in deed.terms:
                speed = where.worth(term)
                if speed is not None and (term.base != "other" or len(deed.terms) == 1):
                    yield speed
                if not exact:
                    yield term.offset
                    steps = [one for one in (where.speed_mps, where.limit_mps) if one is not None]
                    yield from (speed - one for one in steps if speed is not None)
        bases = {"ego", "other"} if not exact else {"ego"} if following else set[str]()
        yield from (value for base, value in self._facts.marks if base in bases)
        if not exact:
            yield from situation

    def _distances(self) -> Iterator[float]:
        where = self._where
        bases = {"past", "behind", "sign"} if self._gaps else {"gap", "past", "behind", "sign"}
        yield from (value for base, value in self._facts.marks if base in bases)
        for term in (term for deed in self._gaps for term in deed.terms):
            gap = where.worth(term)
            yield term.offset
            if gap is not None:
                yield gap
                yield gap - (where.gap_m or 0.0)
        for term in (term for deed in self._headways for term in deed.terms):
            if term.base == "per speed":
                yield term.offset
            elif not term.factor and where.speed_mps is not None:
                yield term.offset * where.speed_mps
                yield term.offset * where.speed_mps + M_PER_CAR_LENGTH
        yield from (one for one in (where.gap_m, where.sign_m) if one is not None)

    def _times(self) -> Iterator[float]:
        yield from self._facts.spans_s
        yield PERIOD_S
        if not self._headways:
            yield USUAL_HEADWAY_S
        speed, gap = self._where.speed_mps, self._where.gap_m
        for deed in self._headways:
            for term in deed.terms:
                if not term.factor:
                    yield term.offset
                elif term.base == "per speed" and speed:
                    yield term.offset / speed
        yield from (term.factor for deed in self._gaps for term in deed.terms if term.base == "ego")
        if speed and gap:
            yield gap / speed

    def _shares(self) -> Iterator[float]:
        for term in (term for deed in (*self._speeds, *self._gaps) for term in deed.terms if term.factor):
            yield from () if term.factor == 1.0 else (term.factor, 1.0 - term.factor, 1.0 / term.factor)


def _sign(off: float, slack: float) -> int:
    return (off >= slack) - (off <= -slack)
