"""Acts and references in plain words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from chauffeur.concept.utterance import Act, Condition, Direction, Event, Manner, Reference, Verb

_MANY: Final = ("vehicles", "pedestrians")


_VERBS: Final[Mapping[Verb, str]] = {
    "avoid": "steer clear of", "yield": "give way to", "pull_over": "pull over", "go": "drive on",
    "straight": "go straight on", "u_turn": "turn round", "exit": "leave", "goto": "drive to", "none": "do nothing",
    "refuse": "do that",
}  # fmt: skip
"""Acts whose words are not their names."""
_MANNERS: Final[Mapping[Manner, str]] = {"slow": "slowly", "quick": "quickly", "careful": "carefully"}
_SPEEDS: Final[Mapping[Direction, str]] = {"slower": "slow down", "less": "slow down", "same": "keep this speed"}


def act_words(act: Act) -> str:
    """An act in plain words, as a person would say it to a driver."""
    parts = ["do not" if act.negated else "", _said(act), "" if act.target is None else reference_words(act.target)]
    if act.place is not None:
        where = "" if act.place.ref is None else reference_words(act.place.ref)
        rel = act.place.rel.replace("_", " ")
        parts.append(f"at the next {where.removeprefix('the ')}" if rel == "next" else f"{rel} {where}")
    if act.manner is not None:
        parts.append(_MANNERS[act.manner])
    if act.when is not None:
        parts.append(f"— {condition_words(act.when)}")
    if act.purpose:
        parts.append("(as the purpose of the act before)")
    if act.why is not None:
        parts.append(f"({act.why})")
    return " ".join(part.strip() for part in parts if part.strip())


def _said(act: Act) -> str:
    """The verb with what belongs to it."""
    amount = "" if act.value is None else f"{act.value:g} {act.unit}".strip()
    match act.act:
        case "lane" if act.to == "original":
            return "change back to the original lane"
        case "lane" if act.to == "behind target":
            return "change to the lane of"
        case "lane":
            return f"change to the {act.to or act.side or 'next'} lane"
        case "keep":
            return f"keep to the {act.to or act.side} lane" if act.to or act.side else "keep the lane"
        case "move":
            return f"move a little to the {act.side}" if act.side else "move a little aside"
        case "speed":
            change = "" if act.direction is None else _SPEEDS.get(act.direction, "speed up")
            return f"{change} ({amount})" if change and amount else change or f"drive at {amount or 'another speed'}"
        case "gap":
            size = amount and f"a gap of {amount}"
            change = "less distance" if act.direction == "less" else "the same distance"
            change = "more distance" if act.direction in (None, "more") else change
            return f"keep {size or change}" + (" to" if act.target is not None else "")
        case _:
            return f"{_VERBS.get(act.act, act.act)} {act.side or ''} {amount}"


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
    "time": ("", ""),
    "slower": ("is slower than", "it is slower than"),
    "closer": ("is closer than", "it is closer than"),
    "further": ("is further away than", "it is further away than"),
}
"""What an event is called with, and without, a reference."""


def condition_words(when: Condition) -> str:
    """A condition in plain words."""
    with_reference, alone = _EVENTS[when.event]
    event = alone if when.ref is None else f"{reference_words(when.ref)} {with_reference}"
    if when.ref is not None and when.ref.kind in _MANY:
        event = event.replace(" is ", " are ").replace(" has ", " have ").replace(" moves", " move")
    amount = "" if when.value is None else f"{when.value:g} {when.unit}"
    return " ".join(f"{when.type} {event} {amount}".split())


def reference_words(reference: Reference) -> str:
    """A reference in plain words."""
    ordinal = {1: "first", 2: "second", 3: "third", -1: "last"}.get(reference.ordinal or 0, "")
    parts = ["that" if reference.deictic else "the", ordinal, reference.state or "", reference.colour or ""]
    parts += [reference.kind.replace("_", " "), f"“{reference.name}”" if reference.name else ""]
    parts += [f"on the {reference.side}" if reference.side else "", reference.where or ""]
    if reference.of is not None:
        parts.append(f"of {reference_words(reference.of)}")
    return " ".join(part for part in parts if part)
