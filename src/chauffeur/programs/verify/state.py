"""What is known at one point of a program: its variables, and what happened since the last yield."""

from __future__ import annotations

from typing import Final, Self

from chauffeur.programs.verify.values import NONE, TOP, Key, Value, join, widen, without_period

WISHES: Final[dict[str, int]] = {
    "set_target_speed": 0,
    "set_desired_time_headway": 1,
    "set_target_lane": 2,
    "turn_left_at_next_intersection": 3,
    "turn_right_at_next_intersection": 3,
    "go_straight_at_next_intersection": 3,
}
"""APIs whose wish takes the place of an earlier one with the same number."""

NEVER: Final = 0
"""Stands among the places of pending wishes for: nothing was wished since the last yield."""
QUIET: Final = (frozenset({NEVER}),) * 4
"""Pending wishes right after a yield."""

Pending = tuple[frozenset[int], ...]


class State:
    """A point of a program, in all the ways it can be come to.

    Attributes:
        variables: What each variable may hold; one that is missing was not bound on any way here.
        idle: Loops whose present pass may not have yielded yet.
        first: Whether no yield has happened on any way here.
        pending: For each kind of wish, the places that may have wished last since the last yield.
        facts: For a variable, which others are not None if it is true: `near = front is not None and ...`.
    """

    __slots__ = ("facts", "first", "idle", "pending", "variables")

    def __init__(
        self,
        variables: dict[Key, Value],
        idle: frozenset[int] = frozenset(),
        pending: Pending = QUIET,
        *,
        first: bool = True,
    ) -> None:
        self.variables = variables
        self.idle = idle
        self.first = first
        self.pending = pending
        self.facts: dict[Key, frozenset[Key]] = {}

    def copy(self) -> Self:
        """The same, to be changed by itself."""
        twin = type(self)(dict(self.variables), self.idle, self.pending, first=self.first)
        if self.facts:
            twin.facts = dict(self.facts)
        return twin

    def bind(self, key: Key, value: Value) -> None:
        """A variable is given another value."""
        self.variables[key] = value
        if self.facts:
            self.facts = {flag: about for flag, about in self.facts.items() if flag != key and key not in about}

    def believe(self, flag: Key) -> None:
        """A variable has turned out to be true."""
        for key in self.facts.get(flag, ()):
            value = self.variables.get(key)
            if value is not None and value.bits & NONE and value.bits != NONE:
                self.variables[key] = value._replace(bits=value.bits & ~NONE)

    def same(self, other: State) -> bool:
        """Whether both say the same."""
        return (
            self.idle == other.idle
            and self.first == other.first
            and self.pending == other.pending
            and self.facts == other.facts
            and self.variables == other.variables
        )

    def yielded(self) -> None:
        """A control period has passed."""
        self.idle = frozenset()
        self.first = False
        self.pending = QUIET
        self.forget_lanes()

    def forget_lanes(self) -> None:
        """The ego may be in another lane now."""
        variables = self.variables
        changed = [(key, value) for key, value in variables.items() if value.offsets or value.items]
        for key, value in changed:
            variables[key] = without_period(value)

    def forget(self, names: set[str]) -> None:
        """Variables of these names may hold anything."""
        for key in self.variables:
            if key[1] in names:
                self.variables[key] = TOP
        if self.facts:
            self.facts = {}


def joined(*states: State | None) -> State | None:
    """Everything that any of the states allows; None where all are impossible. A state of its own."""
    result: State | None = None
    for state in states:
        if state is None:
            continue
        if result is None:
            result = state.copy()
        elif state is not result:
            _join_into(result, state)
    return result


def _join_into(state: State, other: State) -> None:
    mine = state.variables
    for key, value in other.variables.items():
        own = mine.get(key)
        if own is None:
            mine[key] = value
        elif own is not value:
            mine[key] = join(own, value)
    state.idle |= other.idle
    state.first = state.first and other.first
    if state.facts:
        state.facts = {flag: about for flag, about in state.facts.items() if other.facts.get(flag) == about}
    if state.pending is not other.pending:
        state.pending = tuple(a | b for a, b in zip(state.pending, other.pending, strict=True))


def widened(state: State, new: State) -> State:
    """A state that holds `new`, of which `state` is a part, and that stops growing when this is repeated."""
    result = new.copy()
    mine = state.variables
    for key, value in result.variables.items():
        own = mine.get(key)
        if own is not None and own is not value:
            result.variables[key] = widen(own, value)
    return result
