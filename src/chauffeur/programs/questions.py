"""The host's side of prefetching: which questions a program has asked, and which it is likely to ask in this period."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final

from chauffeur.programs.prefetch import MAX_SLOTS

_LATE_TICKS: Final = 1
"""How long after its time a question is still expected."""
_LONGEST_PERIOD_TICKS: Final = 10
"""What has not been asked for so long does not come back regularly."""


class AskedQuestion:
    """A question that was asked.

    Attributes:
        name: API name.
        given: Arguments the program gave.
        values: What they stand for.
    """

    __slots__ = ("_due", "_last", "given", "name", "values")

    def __init__(self, name: str, given: Sequence[Any], values: Sequence[Any], tick: int) -> None:
        self.name = name
        self.given = given
        self.values = values
        self._due = tick + 1
        self._last = tick

    def again(self, tick: int) -> None:
        """It was asked in this period: what is asked every so often is expected after as long again."""
        if tick > self._last:
            self._due = 2 * tick - self._last
            self._last = tick

    def expected(self, tick: int) -> bool:
        """Whether it may be asked in this period."""
        return self._due <= tick <= self._due + _LATE_TICKS

    def forgotten(self, tick: int) -> bool:
        """Whether it was asked too long ago."""
        return tick > self._last + _LONGEST_PERIOD_TICKS


class Questions:
    """Questions by their slots: the numbers under which the sandbox knows them.

    A slot is the sandbox's word. A wrong one gives a program wrong answers to its own questions and does nothing else.
    """

    def __init__(self) -> None:
        self._by_slot: dict[int, AskedQuestion] = {}

    def asked(self, slot: object, name: str, given: Sequence[Any], values: Sequence[Any], tick: int) -> None:
        """The host was asked a question in a period."""
        if isinstance(slot, bool) or not isinstance(slot, int) or not 0 <= slot < MAX_SLOTS:
            return
        known = self._by_slot.get(slot)
        if known is not None and known.name == name and known.given == given:
            known.again(tick)
        else:
            self._by_slot[slot] = AskedQuestion(name, given, values, tick)

    def refused(self, slot: object) -> None:
        """The host did not answer a question."""
        if isinstance(slot, int):
            self._by_slot.pop(slot, None)

    def expected(self, tick: int) -> Iterator[tuple[int, AskedQuestion]]:
        """What may be asked in a period, by slot. What has no answer any more is to be `refused`."""
        for slot, question in list(self._by_slot.items()):
            if question.expected(tick):
                yield slot, question
            elif question.forgotten(tick):
                del self._by_slot[slot]
