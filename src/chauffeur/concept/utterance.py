"""The meaning of words: acts that a passenger asks for, what each refers to, and the events each waits for.

An `Utterance` is what `language.meaning.read` makes of a text, and what planners, referees and screens go by. Its JSON
form (`acts_to_json`, `acts_from_json`) is the one in which labelled commands are kept.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, cast, get_args

from chauffeur.concept.errors import DataError

Verb = Literal[
    "follow", "pass", "avoid", "yield", "stop", "park", "pull_over", "wait", "go", "turn", "straight", "lane", "keep",
    "u_turn", "speed", "gap", "move", "enter", "exit", "goto", "none", "refuse",
    "again", "undo", "cancel", "yes", "no", "pick", "unclear",
]  # fmt: skip
"""What a person asks for. The last line is the verbs of dialogue: they mean something only beside the turn before."""
Side = Literal["left", "right"]
LaneAim = Literal["leftmost", "rightmost", "middle", "behind target", "original"]
Direction = Literal["slower", "faster", "same", "more", "less"]
Manner = Literal["slow", "quick", "careful"]
Measure = Literal["by", "at_most", "at_least", "times", "over_limit", "under_limit"]
"""How a value counts; without one it is the value itself."""
Degree = Literal["bit", "much"]
Aim = Literal["limit", "maximum", "traffic", "nearest"]
"""A value without a number: the speed limit, as fast as is allowed, as the traffic; the nearest parking space."""
Style = Literal["hurry", "relaxed", "gentle", "careful", "sporty", "economical", "normal"]
"""How the whole drive is to be."""
Relation = Literal[
    "at", "before", "after", "behind", "in_front_of", "beside", "near", "opposite", "on", "into", "next", "here"
]
ConditionKind = Literal["once", "until", "while", "before", "after", "if", "unless"]
Event = Literal[
    "green", "red", "clear", "passed", "gone", "moves", "stopped", "opens", "near", "arrives", "told", "other",
    "time", "slower", "closer", "further",
]  # fmt: skip
"""The last line's have a value: so much time has gone by; the reference is slower, closer, further away than it."""
ReferenceKind = Literal[
    "car", "truck", "bus", "van", "motorcycle", "bicycle", "pedestrian", "animal", "vehicle", "vehicles",
    "pedestrians", "traffic", "obstacle", "cone", "barrier", "light", "stop_sign", "sign", "junction", "crosswalk",
    "lane", "road", "driveway", "lot", "parking_space", "building", "roundabout", "gate", "sidewalk", "end_of_road",
    "landmark", "me_here", "other",
]  # fmt: skip
Colour = Literal[
    "white", "black", "grey", "red", "yellow", "silver", "orange", "blue", "green", "dark", "brown", "pink", "purple",
    "beige",
]  # fmt: skip
State = Literal["parked", "moving", "turning", "oncoming", "stopped", "walking", "standing", "crossing"]
Where = Literal["ahead", "behind", "beside", "far", "near", "across"]
Why = Literal["illegal", "dangerous", "not driving"]
Address = Literal["car", "remark", "story", "question", "feedback", "other"]
"""Who or what words are for: a wish to the car, or words that ask nothing of it."""

Span = tuple[int, int]
"""Characters of the text, end exclusive."""


@dataclass(frozen=True, slots=True)
class Reference:
    """A road user, thing or place that words point at.

    Attributes:
        kind: What it is.
        colour, state, side, where: Attributes that were said.
        ordinal: "the second": 2; "the last": -1; None where none was said.
        deictic: Whether it is pointed at ("that", "him").
        name: A proper name or make, as it was said.
        of: What it belongs to or stands at ("the street *that truck is in*").
    """

    kind: ReferenceKind
    colour: Colour | None = None
    state: State | None = None
    side: Side | None = None
    where: Where | None = None
    ordinal: int | None = None
    deictic: bool = False
    name: str = ""
    of: Reference | None = None


@dataclass(frozen=True, slots=True)
class ActPlace:
    """Where an act is done, relative to a reference; `here` needs none."""

    rel: Relation
    ref: Reference | None = None


@dataclass(frozen=True, slots=True)
class Condition:
    """An event that an act waits for, or lasts until."""

    type: ConditionKind
    event: Event
    ref: Reference | None = None
    value: float | None = None
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Act:
    """One thing that the car is to do, or not to do.

    Attributes:
        act: The verb.
        side, to, direction, manner: As said.
        value: Amount of a speed or gap, number of lanes; None where none was said.
        unit: Unit of the value as said: `km/h`, `mph`, `m/s`, `m`, `ft`, `yd`, `s`, `lengths`, `share`; empty where
            none was said.
        measure: How the value counts.
        degree: A little or much, of a change.
        aim, style: As said.
        negated: The person says not to do it.
        target: Whom or what it is about.
        place: Where it is done.
        when: What it waits for.
        purpose: It only says why the act before it is done.
        why: Of a `refuse`: why a car does not do this.
        span: Characters of the text that it was read from.
    """

    act: Verb
    side: Side | None = None
    to: LaneAim | None = None
    direction: Direction | None = None
    manner: Manner | None = None
    value: float | None = None
    unit: str = ""
    measure: Measure | None = None
    degree: Degree | None = None
    aim: Aim | None = None
    style: Style | None = None
    negated: bool = False
    target: Reference | None = None
    place: ActPlace | None = None
    when: Condition | None = None
    purpose: bool = False
    why: Why | None = None
    span: Span | None = None


@dataclass(frozen=True, slots=True)
class Utterance:
    """The meaning of a text.

    Attributes:
        text: The words as they came.
        acts: In the order in which the person wants them done; empty where nothing is asked of the car.
        opinion: Of feedback on what has been driven: the acts that would have been right; `yes` for praise.
        address: Whom or what the words are for.
        emergency: Whether they are words of distress or an order to stop at once.
        sure: Probability that the reading is right, 0 to 1, calibrated on writers left out of training.
        unused: Parts of the text that no act was read from, in order: said to the person.
    """

    text: str
    acts: tuple[Act, ...] = ()
    opinion: tuple[Act, ...] = ()
    address: Address = "car"
    emergency: bool = False
    sure: float = 1.0
    unused: tuple[Span, ...] = ()


# JSON -----------------------------------------------------------------------------------------------------------------

_CHOICES: Final[Mapping[str, tuple[str, ...]]] = {
    "act": get_args(Verb),
    "side": get_args(Side),
    "to": get_args(LaneAim),
    "direction": get_args(Direction),
    "manner": get_args(Manner),
    "measure": get_args(Measure),
    "degree": get_args(Degree),
    "aim": get_args(Aim),
    "style": get_args(Style),
    "why": get_args(Why),
    "kind": get_args(ReferenceKind),
    "colour": get_args(Colour),
    "state": get_args(State),
    "where": get_args(Where),
    "rel": get_args(Relation),
    "type": get_args(ConditionKind),
    "event": get_args(Event),
}
_DEEPEST: Final = 4
"""References within references that are read."""


def acts_to_json(acts: Sequence[Act]) -> list[dict[str, Any]]:
    """Acts in their written form; what was not said is left out."""
    return [_act_to_json(act) for act in acts]


def _act_to_json(act: Act) -> dict[str, Any]:
    found: dict[str, Any] = {"act": act.act}
    for name in ("side", "to", "direction", "manner", "value", "unit", "measure", "degree", "aim", "style", "why"):
        if (value := getattr(act, name)) not in (None, ""):
            found[name] = value
    if act.negated:
        found["not"] = True
    if act.target is not None:
        found["target"] = _reference_to_json(act.target)
    if act.place is not None:
        found["place"] = {"rel": act.place.rel, **_ref(act.place.ref)}
    if act.when is not None:
        when = act.when
        amount = {} if when.value is None else {"value": when.value, "unit": when.unit}
        found["when"] = {"type": when.type, "event": when.event, **_ref(when.ref), **amount}
    if act.purpose:
        found["purpose"] = True
    return found


def _ref(reference: Reference | None) -> dict[str, Any]:
    return {} if reference is None else {"ref": _reference_to_json(reference)}


def _reference_to_json(reference: Reference) -> dict[str, Any]:
    found: dict[str, Any] = {"kind": reference.kind}
    for name in ("colour", "state", "side", "where", "ordinal", "name"):
        if (value := getattr(reference, name)) not in (None, ""):
            found[name] = value
    if reference.deictic:
        found["deictic"] = True
    if reference.of is not None:
        found["of"] = _reference_to_json(reference.of)
    return found


def acts_from_json(rows: Sequence[Any]) -> tuple[Act, ...]:
    """Acts of their written form.

    Raises:
        DataError: A field or value that the language of acts does not have.
    """
    return tuple(_act_from_json(row) for row in rows)


def _act_from_json(row: Any) -> Act:
    said = dict(_mapping(row, "an act"))
    place, when, target = said.pop("place", None), said.pop("when", None), said.pop("target", None)
    act = Act(
        cast("Verb", _chosen("act", said.pop("act", None))),
        negated=bool(said.pop("not", False)),
        purpose=bool(said.pop("purpose", False)),
        value=_number(said.pop("value", None)),
        unit=str(said.pop("unit", "")),
    )
    if target is not None:
        act = replace(act, target=reference_from_json(target))
    if place is not None:
        held = dict(_mapping(place, "a place"))
        act = replace(
            act, place=ActPlace(cast("Relation", _chosen("rel", held.get("rel"))), _held_reference(held.get("ref")))
        )
    if when is not None:
        held = dict(_mapping(when, "a condition"))
        kind, event = _chosen("type", held.get("type")), _chosen("event", held.get("event"))
        act = replace(
            act,
            when=Condition(
                cast("ConditionKind", kind),
                cast("Event", event),
                _held_reference(held.get("ref")),
                _number(held.get("value")),
                str(held.get("unit", "")),
            ),
        )
    for name in list(said):
        if name not in ("side", "to", "direction", "manner", "measure", "degree", "aim", "style", "why"):
            raise DataError(f"An act has no field {name!r}.")
        act = replace(act, **{name: _chosen(name, said[name])})
    return act


def _held_reference(value: Any) -> Reference | None:
    return None if value is None else reference_from_json(value)


def reference_from_json(value: Any, depth: int = 0) -> Reference:
    """A reference of its written form. Raises DataError for what the language of acts does not have."""
    if depth > _DEEPEST:
        raise DataError(f"References are nested more than {_DEEPEST} deep.")
    said = dict(_mapping(value, "a reference"))
    found = Reference(
        cast("ReferenceKind", _chosen("kind", said.pop("kind", None))),
        deictic=bool(said.pop("deictic", False)),
        name=str(said.pop("name", "")),
    )
    if (of := said.pop("of", None)) is not None:
        found = replace(found, of=reference_from_json(of, depth + 1))
    if (ordinal := said.pop("ordinal", None)) is not None:
        found = replace(found, ordinal=int(ordinal))
    for name in list(said):
        if name not in ("colour", "state", "side", "where"):
            raise DataError(f"A reference has no field {name!r}.")
        spoken = "grey" if said[name] == "gray" else said[name]
        found = replace(found, **{name: _chosen(name, spoken)})
    return found


def _mapping(value: Any, what: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise DataError(f"{what.capitalize()} is an object, not {value!r:.40}.")
    return cast("Mapping[str, Any]", value)


def _chosen(name: str, value: Any) -> str:
    if value not in _CHOICES[name]:
        raise DataError(f"{name} {value!r:.40} is none of {', '.join(_CHOICES[name])}.")
    return value


def _number(value: Any) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise DataError(f"value {value!r:.40} is no number.")
    return float(value)
