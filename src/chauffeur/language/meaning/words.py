"""Acts and references in plain words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from chauffeur.concept.dialogue import wishes
from chauffeur.concept.utterance import Act, Aim, Condition, Degree, Direction, Event, Manner, Reference, Style, Verb

_MANY: Final = ("vehicles", "pedestrians")


_VERBS: Final[Mapping[Verb, str]] = {
    "avoid": "steer clear of", "yield": "give way to", "pull_over": "pull over", "go": "drive on",
    "straight": "go straight on", "u_turn": "turn round", "exit": "leave", "goto": "drive to", "none": "do nothing",
    "refuse": "do that", "again": "do it again", "undo": "go back to how it was", "cancel": "take that back",
    "pick": "do the other", "unclear": "do something that I do not understand",
}  # fmt: skip
"""Acts whose words are not their names."""
_MANNERS: Final[Mapping[Manner, str]] = {"slow": "slowly", "quick": "quickly", "careful": "carefully"}
_SPEEDS: Final[Mapping[Direction, str]] = {"slower": "slow down", "less": "slow down", "same": "keep this speed"}
_STYLES: Final[Mapping[Style, str]] = {
    "hurry": "quickly", "relaxed": "without hurry", "gentle": "gently", "careful": "carefully", "sporty": "sportily",
    "economical": "economically", "normal": "normally",
}  # fmt: skip
_WHY_SO: Final[Mapping[Style, str]] = {"hurry": "as we are in a hurry", "relaxed": "as there is no hurry"}
_DEGREES: Final[Mapping[Degree, str]] = {"bit": "a bit", "much": "a lot"}
_UNITS: Final[Mapping[str, str]] = {"lengths": "car lengths"}
_ON_A_SIDE: Final[frozenset[Verb]] = frozenset({"pass", "park", "pull_over", "stop", "avoid"})
"""Acts of which a side is where, and not which way."""


def wish_words(acts: Iterable[Act]) -> str:
    """Acts as a sentence that asks for them, whole by itself: "Change to the left lane, then drive at 50 km/h."; empty
    where nothing is to be driven."""
    said = [act_words(act).replace(" — ", " ") for act in wishes(acts) if act.act != "refuse" and not act.purpose]
    words = ", then ".join(said)
    return f"{words[0].upper()}{words[1:]}." if words else ""


def act_words(act: Act) -> str:
    """An act in plain words, as a person would say it to a driver."""
    parts = ["do not" if act.negated else "", _said(act)]
    if act.target is not None:
        parts += ["for" if act.act in ("wait", "stop") else "", reference_words(act.target)]
    if act.side is not None and act.act in _ON_A_SIDE:
        parts.append(f"on the {act.side}")
    if act.place is not None:
        where = "" if act.place.ref is None else reference_words(act.place.ref)
        rel = act.place.rel.replace("_", " ")
        parts.append(f"at the next {where.removeprefix('the ')}" if rel == "next" else f"{rel} {where}")
    if act.manner is not None:
        parts.append(_MANNERS[act.manner])
    if act.style is not None and _STYLES[act.style] not in parts[1]:
        parts.append(_WHY_SO.get(act.style, _STYLES[act.style]))
    if act.when is not None:
        parts.append(f"— {condition_words(act.when)}")
    if act.purpose:
        parts.append("(as the purpose of the act before)")
    if act.why is not None:
        parts.append(f"({act.why})")
    return " ".join(part.strip() for part in parts if part.strip())


def _said(act: Act) -> str:
    """The verb with what belongs to it."""
    amount = "" if act.value is None else f"{act.value:g} {_UNITS.get(act.unit, act.unit)}".strip()
    degree = "" if act.degree is None else _DEGREES[act.degree]
    match act.act:
        case "lane" if act.to == "original":
            return "change back to the original lane"
        case "lane" if act.to == "behind target":
            return "change to the lane of"
        case "lane" if act.value is not None and act.side is not None:
            return f"change {act.value:g} lanes to the {act.side}"
        case "lane":
            return f"change to the {act.to or act.side or 'next'} lane"
        case "keep":
            return f"keep to the {act.to or act.side} lane" if act.to or act.side else "keep the lane"
        case "move":
            return f"move {degree or 'a little'} to the {act.side}" if act.side else "move a little aside"
        case "speed":
            return _speed(act, amount, degree)
        case "gap":
            return _gap(act, amount, degree) + (" to" if act.target is not None else "")
        case "go" if act.style is not None:
            return f"drive {_STYLES[act.style]}"
        case "park" if act.aim == "nearest":
            return "park in the nearest free space"
        case _:
            side = "" if act.act in _ON_A_SIDE else act.side or ""
            return " ".join(f"{_VERBS.get(act.act, act.act)} {side} {amount}".split())


def _speed(act: Act, amount: str, degree: str) -> str:
    change = "" if act.direction is None else _SPEEDS.get(act.direction, "speed up")
    match act.measure:
        case "over_limit" | "under_limit" if amount:
            return f"drive {amount} {act.measure.removesuffix('_limit')} the speed limit"
        case "times" if amount:
            return f"drive at {act.value:g} times this speed"
        case "by" if amount:
            return f"{change or 'speed up'} by {amount}"
        case "at_most" | "at_least" if amount:
            return f"drive at {'no more than' if act.measure == 'at_most' else 'least at'} {amount}"
        case _ if act.unit == "share":
            return f"drive at {act.value:g} times this speed"
        case _ if amount:
            return f"{change} to {amount}" if change and act.direction != "same" else f"drive at {amount}"
        case _ if act.aim in ("limit", "maximum", "traffic"):
            return _AIMS[act.aim]
        case _ if act.direction == "same" and act.target is not None:
            return "drive as fast as"
        case _ if act.style is not None and not change:
            return f"drive {_STYLES[act.style]}"
        case _:
            return f"{change} {degree}".strip() or "drive at another speed"


_AIMS: Final[Mapping[Aim, str]] = {
    "limit": "drive at the speed limit", "maximum": "drive as fast as is allowed", "traffic": "drive with the traffic",
}  # fmt: skip


def _gap(act: Act, amount: str, degree: str) -> str:
    change = {"less": "less", "same": "the same"}.get(act.direction or "", "more")
    match act.measure:
        case "by" if amount:
            return f"keep {amount} {change} distance"
        case "times" if amount:
            return f"keep {act.value:g} times the distance"
        case "at_most" | "at_least" if amount:
            return f"keep a gap of {act.measure.replace('_', ' ')} {amount}"
        case _ if amount and act.unit != "share":
            return f"keep a gap of {amount}"
        case _:
            return " ".join(f"keep {degree} {change} distance".split())


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
"""Names of an event with, and without, a reference."""


def condition_words(when: Condition) -> str:
    """A condition in plain words."""
    with_reference, alone = _EVENTS[when.event]
    event = alone if when.ref is None else f"{reference_words(when.ref)} {with_reference}"
    if when.ref is not None and when.ref.kind in _MANY:
        event = event.replace(" is ", " are ").replace(" has ", " have ").replace(" moves", " move")
    amount = "" if when.value is None else f"{when.value:g} {when.unit}"
    if when.event == "time" and amount:
        return f"{'for' if when.type in ('until', 'while') else 'in'} {amount}"
    return " ".join(f"{when.type} {event} {amount}".split())


def reference_words(reference: Reference) -> str:
    """A reference in plain words."""
    if reference.kind == "me_here":
        return "me"
    ordinal = {1: "first", 2: "second", 3: "third", 4: "fourth", 5: "fifth", -1: "last"}.get(reference.ordinal or 0, "")
    parts = ["that" if reference.deictic else "the", ordinal, reference.state or "", reference.colour or ""]
    kind = "" if reference.name and reference.kind == "other" else reference.kind.replace("_", " ")
    parts += [kind, f"“{reference.name}”" if reference.name else ""]
    parts += [f"on the {reference.side}" if reference.side else "", reference.where or ""]
    if reference.of is not None:
        parts.append(f"of {reference_words(reference.of)}")
    return " ".join(part for part in parts if part)
