"""Acts and references in plain words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from chauffeur.concept.utterance import Act, Condition, Event, Reference

_MANY: Final = ("vehicles", "pedestrians")


def act_words(act: Act) -> str:
    """An act in plain words."""
    verb = "do that" if act.act == "refuse" else act.act.replace("_", " ")
    parts = [("do not " if act.negated else "") + verb]
    parts += [value for value in (act.side, act.to, act.direction) if value]
    if act.value is not None:
        parts.append(f"{act.value:g} {act.unit}".strip())
    if act.target is not None:
        parts.append(reference_words(act.target))
    if act.place is not None:
        where = "" if act.place.ref is None else f" {reference_words(act.place.ref)}"
        parts.append(f"{act.place.rel.replace('_', ' ')}{where}")
    if act.manner is not None:
        parts.append(f"({act.manner})")
    if act.when is not None:
        parts.append(f"— {condition_words(act.when)}")
    if act.purpose:
        parts.append("(as the purpose of the act before)")
    if act.why is not None:
        parts.append(f"({act.why})")
    return " ".join(parts)


_EVENTS: Final[Mapping[Event, tuple[str, str]]] = {
    "green": ("is green", "the light is green"),
    "red": ("is red", "the light is red"),
    "clear": ("is clear", "it is clear"),
    "passed": ("is passed", "it is passed"),
    "gone": ("has gone", "it has gone"),
    "moves": ("moves", "it moves"),
    "stopped": ("has stopped", "it has stopped"),
    "opens": ("opens", "it opens"),
    "near": ("is near", "it is near"),
    "arrives": ("arrives", "somebody arrives"),
    "told": ("says so", "you say so"),
    "other": ("", ""),
}
"""What an event is called with, and without, a reference."""


def condition_words(when: Condition) -> str:
    """A condition in plain words."""
    with_reference, alone = _EVENTS[when.event]
    event = alone if when.ref is None else f"{reference_words(when.ref)} {with_reference}"
    if when.ref is not None and when.ref.kind in _MANY:
        event = event.replace(" is ", " are ").replace(" has ", " have ").replace(" moves", " move")
    return f"{when.type} {event}".strip()


def reference_words(reference: Reference) -> str:
    """A reference in plain words."""
    ordinal = {1: "first", 2: "second", 3: "third", -1: "last"}.get(reference.ordinal or 0, "")
    parts = ["that" if reference.deictic else "the", ordinal, reference.state or "", reference.colour or ""]
    parts += [reference.kind.replace("_", " "), f"“{reference.name}”" if reference.name else ""]
    parts += [f"on the {reference.side}" if reference.side else "", reference.where or ""]
    if reference.of is not None:
        parts.append(f"at/of {reference_words(reference.of)}")
    return " ".join(part for part in parts if part)
