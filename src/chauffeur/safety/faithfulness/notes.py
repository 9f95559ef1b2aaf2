"""Notes of what a program does while it is followed: its wishes in order, and the numbers it holds things against."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from chauffeur.safety.faithfulness.facts import Deed, Event, FactMark, Facts
from chauffeur.safety.faithfulness.frames import MeaningFrame
from chauffeur.safety.faithfulness.values import NOTHING, Base, Term, TracedValue, in_order

PERIOD_S: Final = 0.1
"""Time between two yields in the highway worlds."""

_MAX_STEPS: Final = 40_000
_MAX_EVENTS: Final = 400
_MARKED: Final = frozenset[Base]({"ego", "other", "gap", "past", "behind", "sign", "headway"})
_SIDES: Final = {
    "turn_left_at_next_intersection": -1,
    "go_straight_at_next_intersection": 0,
    "turn_right_at_next_intersection": 1,
}


class TooMuchError(Exception):
    """The program is larger than is worth reading."""


class ProgramNotes:
    """What is noted, and where the ego may be by then."""

    def __init__(self) -> None:
        self._events: list[Event] = []
        self._marks: list[FactMark] = []
        self._spans: list[float] = []
        self._literals: set[float] = set()
        self._line: int | None = None
        self._repeats: list[int] = []
        self._at = frozenset({0})
        self._visited = {0}
        self._steps = 0

    def _noted(self) -> Facts:
        marks, spans = tuple(dict.fromkeys(self._marks)), tuple(dict.fromkeys(self._spans))
        return Facts(tuple(self._events), marks, spans, frozenset(self._literals))

    def _steered_gap(self, left: TracedValue, right: TracedValue, frame: MeaningFrame) -> None:
        """Note `gap - wanted`; what is taken off a gap before something else is, is no gap that is wanted."""
        if not left.terms or any(term.base != "gap" for term in left.terms):
            return
        if left.terms == frozenset({Term("gap", 1.0, 0.0)}):
            wanted = frozenset(t for t in right.terms if t.base in ("", "gap", "ego") and not t.bound)
            if wanted:
                self._do("gap", frame, TracedValue(wanted, left.tags | right.tags), reference=True)
        elif not right.constants and self._events and self._events[-1].deed == "gap":
            self._events.pop()

    def _compare(self, left: TracedValue, right: TracedValue, *, compared: bool = True) -> None:
        line = self._line
        if compared and left.constants and right.constants and len(left.terms | right.terms) <= 4:
            # A counter held against its end: control periods.
            self._spans.append(max(*left.constants, *right.constants) * PERIOD_S)
        for one, other in ((left, right), (right, left)):
            bases: set[Base] = {term.base for term in one.terms if term.factor and term.base in _MARKED}
            for base in bases:
                self._marks += [FactMark(base, value, line, compared) for value in other.constants]
            for term in in_order(one.terms):
                if term.base in bases and term.offset and term.base in ("gap", "past", "behind"):
                    self._marks += [
                        FactMark(term.base, (value - term.offset) / term.factor, line, compared)
                        for value in other.constants
                    ]

    def _wish(self, name: str, asked: Sequence[TracedValue], frame: MeaningFrame) -> None:
        value = asked[0] if asked else NOTHING
        if name == "set_target_speed":
            self._do("speed", frame, value)
        elif name == "set_desired_time_headway":
            self._do("headway", frame, value)
        elif name == "say":
            self._do("say", frame, value)
        elif name == "recover_from_stop":
            self._do("go", frame, value)
        elif name in _SIDES:
            self._do("turn", frame, value, sides=frozenset({_SIDES[name]}))
        else:  # set_target_lane, the last of the catalogue's wishes
            self._move(value, frame)

    def _move(self, value: TracedValue, frame: MeaningFrame) -> None:
        at = self._at
        sides: set[int] = set()
        asked: set[str] = set()
        reached: set[int] = set()
        for lane in value.lanes:
            asked.add(f"safe:{lane.offset}")
            if lane.at == at:
                sides.add(lane.offset)
                reached |= {place + lane.offset for place in at}
            else:
                ends = {place + lane.offset for place in lane.at}
                reached |= ends
                # Of a lane seen before a move: where the ego may be now, the farthest from it counts.
                ways = {(end > here) - (end < here) for end in ends for here in at}
                sides |= ways - {0} if ways != {0} else ways
        if not value.lanes:
            asked.add("safe:?")
        back = bool(reached) and reached <= self._visited and reached != set(at)
        depends = frame.depends | value.tags
        checked = any(tag in depends for tag in asked) or (bool(value.lanes) and "safe:?" in depends)
        self._do("lane", frame, value, sides=frozenset(sides), checked=checked, back=back)
        if reached:
            self._at = frozenset(reached)
            self._visited |= reached

    def _do(
        self,
        deed: Deed,
        frame: MeaningFrame,
        value: TracedValue,
        *,
        sides: frozenset[int] = frozenset(),
        checked: bool = False,
        back: bool = False,
        reference: bool = False,
    ) -> None:
        if len(self._events) >= _MAX_EVENTS:
            raise TooMuchError
        depends = frame.depends | value.tags
        times = 1
        for repeat in self._repeats:
            times = times * repeat
        if deed == "go":
            checked = any(tag.startswith("safe:cross") for tag in depends)
        self._events.append(
            Event(
                deed, self._line, value.terms, sides, checked, depends, times, back, reference,
                value.open or not value.terms,
            )
        )  # fmt: skip

    def _count(self) -> None:
        self._steps += 1
        if self._steps > _MAX_STEPS:
            raise TooMuchError
