"""Acts as a string of symbols, and the grammar that such a string keeps.

A parser writes the string from left to right. Some hundred symbols name verbs, fields and values; what stands in the
text itself (the words an act was read from, a number, a name) is written as pointers to tokens of the text.

    A:turn ^0 ^4 side:left P:at K:junction A:follow ^6 ^9 T K:truck colour:white
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, cast, get_args

from chauffeur.concept.utterance import (
    Act,
    ActPlace,
    Address,
    Aim,
    Colour,
    Condition,
    ConditionKind,
    Degree,
    Direction,
    Event,
    LaneAim,
    Manner,
    Measure,
    Reference,
    ReferenceKind,
    Relation,
    Side,
    State,
    Style,
    Verb,
    Where,
    Why,
)

PAD, START, END, POINTER = "<pad>", "<s>", "</s>", "^"
"""`POINTER` stands in the vocabulary once; which token it points at is written beside it."""
_ORDINALS: Final = (1, 2, 3, 4, 5, -1)


def _values(name: str, kind: Any) -> tuple[str, ...]:
    return tuple(f"{name}:{value}" for value in get_args(kind))


_ACT_FIELDS: Final = (
    ("NOT",),
    ("PURPOSE",),
    _values("manner", Manner),
    _values("side", Side),
    _values("to", LaneAim),
    _values("direction", Direction),
    _values("measure", Measure),
    _values("degree", Degree),
    _values("aim", Aim),
    _values("style", Style),
    ("VALUE",),
    _values("why", Why),
    ("T",),
    _values("P", Relation),
    _values("W", ConditionKind),
)
"""Fields of an act in the order in which they are written; each may be left out."""
_REFERENCE_FIELDS: Final = (
    _values("colour", Colour),
    _values("state", State),
    _values("side", Side),
    _values("where", Where),
    tuple(f"ordinal:{one}" for one in _ORDINALS),
    ("DEICTIC",),
    ("NAME",),
    ("OF",),
)
_ADDRESS: Final = tuple(f"U:{one}" for one in get_args(Address) if one != "car")
_VERBS: Final = _values("A", Verb)
_KINDS: Final = _values("K", ReferenceKind)
_EVENTS: Final = _values("E", Event)
_MEASURED: Final = ("E:time", "E:slower", "E:closer", "E:further")
"""Events with a value."""

SYMBOLS: Final[tuple[str, ...]] = tuple(
    dict.fromkeys(
        (
            *(PAD, START, END, POINTER, *_ADDRESS, *_VERBS, *_KINDS, *_EVENTS),
            *(one for group in (*_ACT_FIELDS, ("CVALUE",), *_REFERENCE_FIELDS) for one in group),
        )
    )
)
"""The vocabulary; a symbol's index is its id in every trained parser, so its order is part of a model."""
INDEX: Final = {symbol: index for index, symbol in enumerate(SYMBOLS)}
MOST_SYMBOLS: Final = 96
"""Longest string written; the longest of 300 real commands has 52."""
_DEEPEST: Final = 2
"""References within a reference that may be written."""

Written = str | int
"""A symbol, or the index of a token of the text."""


@dataclass(frozen=True, slots=True)
class WrittenAct:
    """An act with its pointers still unresolved.

    Attributes:
        act: The act without value, names and span.
        span: First and last token it was read from.
        value: Token of its number.
        names: Tokens (first, last) of its references' names, in the order in which they are written.
        event_value: Token of its condition's number.
    """

    act: Act
    span: tuple[int, int]
    value: int | None = None
    names: tuple[tuple[int, int], ...] = ()
    event_value: int | None = None


_WRITTEN_FIELDS: Final = ("manner", "side", "to", "direction", "measure", "degree", "aim", "style")

# Writing --------------------------------------------------------------------------------------------------------------


def write(acts: Sequence[WrittenAct], address: Address = "car") -> list[Written]:
    """The string of some acts, without start and end."""
    out: list[Written] = [] if address == "car" else [f"U:{address}"]
    for one in acts:
        names = iter(one.names)
        act = one.act
        out += [f"A:{act.act}", one.span[0], one.span[1]]
        out += ["NOT"] * act.negated + ["PURPOSE"] * act.purpose
        out += [f"{name}:{value}" for name in _WRITTEN_FIELDS if (value := getattr(act, name))]
        if one.value is not None:
            out += ["VALUE", one.value]
        out += [f"why:{act.why}"] if act.why else []
        if act.target is not None:
            out += ["T", *_reference(act.target, names)]
        if act.place is not None:
            out += [f"P:{act.place.rel}", *_reference(act.place.ref, names)]
        if act.when is not None:
            out += [f"W:{act.when.type}", f"E:{act.when.event}"]
            out += ["CVALUE", one.event_value] if one.event_value is not None else []
            out += _reference(act.when.ref, names)
    return out


def _reference(reference: Reference | None, names: Iterator[tuple[int, int]]) -> list[Written]:
    if reference is None:
        return []
    out: list[Written] = [f"K:{reference.kind}"]
    out += [f"{name}:{value}" for name in ("colour", "state", "side", "where") if (value := getattr(reference, name))]
    out += [f"ordinal:{reference.ordinal}"] if reference.ordinal in _ORDINALS else []
    out += ["DEICTIC"] * reference.deictic
    if reference.name and (place := next(names, None)) is not None:
        out += ["NAME", *place]
    return out + (["OF", *_reference(reference.of, names)] if reference.of is not None else [])


# The grammar ----------------------------------------------------------------------------------------------------------


@dataclass
class ActGrammar:
    """The grammar as a state machine: give each symbol to `take`, and ask `allowed` before the next."""

    _next: Callable[[], tuple[str, ...]] = field(init=False)
    _field: int = 0
    _of: list[int] = field(default_factory=list[int])
    _pointers: int = 0
    _then: Callable[[], tuple[str, ...]] = field(init=False)

    def __post_init__(self) -> None:
        """Begin before the first symbol."""
        self._next = self._opening

    def allowed(self) -> tuple[str, ...]:
        """Symbols that may come next; `POINTER` for any token of the text."""
        return self._next()

    def take(self, symbol: str) -> None:
        """Write a symbol. Raises ValueError: it may not stand here."""
        if symbol not in self._next():
            raise ValueError(f"{symbol} may not stand here")
        if symbol == POINTER:
            self._pointers -= 1
            if self._pointers == 0:
                self._next = self._then
        elif symbol.startswith("U:"):
            self._next = lambda: (*_VERBS, END)
        elif symbol.startswith("A:"):
            self._field, self._of = 0, []
            self._point(2, self._act)
        elif symbol.startswith("K:"):
            self._of.append(0)
            self._next = self._attributes
        elif symbol == "CVALUE":
            self._point(1, self._kind_or_act)
        elif symbol in ("T", "OF") or symbol.startswith(("P:", "W:", "E:")):
            self._opens(symbol)
        elif symbol == END:
            self._next = tuple
        else:
            self._plain(symbol)

    def _opening(self) -> tuple[str, ...]:
        return (*_ADDRESS, *_VERBS, END)

    def _point(self, count: int, then: Callable[[], tuple[str, ...]]) -> None:
        self._pointers, self._then, self._next = count, then, lambda: (POINTER,)

    def _act(self) -> tuple[str, ...]:
        return (*(one for group in _ACT_FIELDS[self._field :] for one in group), *_VERBS, END)

    def _attributes(self) -> tuple[str, ...]:
        groups = _REFERENCE_FIELDS[self._of[-1] :]
        if len(self._of) > _DEEPEST:
            groups = tuple(group for group in groups if group != ("OF",))
        return (*(one for group in groups for one in group), *self._act())

    def _kind_or_act(self) -> tuple[str, ...]:
        return (*_KINDS, *self._act())

    def _opens(self, symbol: str) -> None:
        if symbol == "OF":
            self._next = lambda: _KINDS
            return
        if symbol.startswith("E:"):
            measured = ("CVALUE",) if symbol in _MEASURED else ()
            self._next = lambda: (*measured, *self._kind_or_act())
            return
        self._pass_field(symbol)
        self._of = []
        if symbol == "T":
            self._next = lambda: _KINDS
        elif symbol.startswith("W:"):
            self._next = lambda: _EVENTS
        else:
            self._next = self._kind_or_act

    def _pass_field(self, symbol: str) -> None:
        self._field = next(i for i, group in enumerate(_ACT_FIELDS) if symbol in group) + 1

    def _plain(self, symbol: str) -> None:
        inside = self._of and any(symbol in group for group in _REFERENCE_FIELDS[self._of[-1] :])
        if inside:
            self._of[-1] = (
                next(i for i, group in enumerate(_REFERENCE_FIELDS) if i >= self._of[-1] and symbol in group) + 1
            )
            self._next = self._attributes
        else:
            self._pass_field(symbol)
            self._of = []
            self._next = self._act
        if symbol == "NAME":
            self._point(2, self._attributes)
        elif symbol == "VALUE":
            self._point(1, self._act)


# Reading --------------------------------------------------------------------------------------------------------------


def parse(written: Sequence[Written]) -> tuple[list[WrittenAct], Address]:
    """The acts of a string that keeps the grammar (a string cut off anywhere gives what stands whole).

    Raises:
        ValueError: It does not keep the grammar.
    """
    grammar, address = ActGrammar(), cast("Address", "car")
    acts: list[_Building] = []
    for one in written:
        symbol = POINTER if isinstance(one, int) else one
        grammar.take(symbol)
        if symbol == END:
            break
        if symbol.startswith("U:"):
            address = cast("Address", symbol[2:])
        elif symbol.startswith("A:"):
            acts.append(_Building(Act(cast("Verb", symbol[2:]))))
        else:
            acts[-1].take(one)
    return [built for act in acts if (built := act.built()) is not None], address


@dataclass
class _Building:
    act: Act
    pointers: list[int] = field(default_factory=list[int])
    kinds: list[tuple[str, list[dict[str, Any]]]] = field(default_factory=list[tuple[str, list[dict[str, Any]]]])
    named: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    names: list[list[int]] = field(default_factory=list[list[int]])
    value: int | None = None
    event_value: int | None = None
    _waits: str = ""

    def take(self, one: Written) -> None:
        if isinstance(one, int):
            self._point(one)
            return
        name, _, value = one.partition(":")
        if name == "K":
            self.kinds[-1][1].append({"kind": value})
        elif name in ("T", "P", "W"):
            self.kinds.append((one, []))
        elif name == "E":
            self.kinds[-1] = (f"{self.kinds[-1][0]}/{value}", [])
        elif one == "NAME":
            self.names.append([])
            self._waits = "name"
            self.kinds[-1][1][-1]["name"] = "?"
        elif one in ("VALUE", "CVALUE"):
            self._waits = "value" if one == "VALUE" else "event"
        elif one == "OF":
            return
        elif one in ("NOT", "PURPOSE"):
            self.act = replace(self.act, **{"negated" if one == "NOT" else "purpose": True})
        elif self.kinds and self.kinds[-1][1] and name in ("colour", "state", "side", "where", "ordinal", "DEICTIC"):
            held = self.kinds[-1][1][-1]
            held["deictic" if one == "DEICTIC" else name] = (
                True if one == "DEICTIC" else int(value) if name == "ordinal" else value
            )
        else:
            self.act = replace(self.act, **{name: value})

    def _point(self, token: int) -> None:
        if self._waits == "name":
            self.names[-1].append(token)
            self._waits = "" if len(self.names[-1]) == 2 else "name"
        elif self._waits == "value":
            self.value, self._waits = token, ""
        elif self._waits == "event":
            self.event_value, self._waits = token, ""
        else:
            self.pointers.append(token)

    def built(self) -> WrittenAct | None:
        if len(self.pointers) != 2:
            return None
        act = self.act
        for opened, held in self.kinds:
            reference = _nested(held)
            name, _, rest = opened.partition(":")
            if name == "T":
                act = replace(act, target=reference)
            elif name == "P":
                act = replace(act, place=ActPlace(cast("Relation", rest), reference))
            elif "/" in rest:
                kind, event = rest.split("/")
                act = replace(act, when=Condition(cast("ConditionKind", kind), cast("Event", event), reference))
        low, high = sorted(self.pointers)
        names = tuple((min(pair), max(pair)) for pair in self.names if len(pair) == 2)
        return WrittenAct(act, (low, high), self.value, names, self.event_value)


def _nested(held: Sequence[dict[str, Any]]) -> Reference | None:
    found: Reference | None = None
    for one in reversed(held):
        found = Reference(**one, of=found)
    return found
