"""Grounding of references: the road users, lights, signs and junctions in sight that words mean.

Attributes are filters: each one that is said leaves the same candidates or fewer. Of what is left an ordinal counts
from the nearest, "that one" is the nearest ahead, a plural is all of them; of several alike the passenger is asked by
the difference. Geometry alone: no model, no chance, no state.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal

from chauffeur.concept.scene import AgentKind, Observation, Signal, VehicleState
from chauffeur.concept.sight import seen_from, states_of
from chauffeur.concept.utterance import Colour, Reference, ReferenceKind, Side, State, Verb, reference_from_json
from chauffeur.geometry import Pose

SIGHT_M: Final = 80.0
"""Road users farther away are not what a passenger speaks of."""
BEHIND_M: Final = 30.0
VAN_M: Final = 5.3
"""A car as long as this is a van (SUMO's and CARLA's are 5.6 m and more, their cars 5 m and less)."""
_AHEAD_M: Final = -2.0
_SIDE_M: Final = 1.2
_BESIDE_M: Final = 6.0
_FAR_M: Final = 35.0
_NEAR_M: Final = 25.0
_ACROSS_M: Final = 3.5
_OF_M: Final = 15.0
_CLEARLY: Final = 2.0
"""A candidate that is so many times nearer than the next is meant without a question."""
_CLEARLY_M: Final = 15.0

_ALL_VEHICLES: Final[tuple[AgentKind, ...]] = ("car", "truck", "bus", "motorcycle", "bicycle")
_KINDS: Final[dict[ReferenceKind, tuple[AgentKind, ...]]] = {
    "car": ("car",), "van": ("car",), "truck": ("truck",), "bus": ("bus",), "motorcycle": ("motorcycle",),
    "bicycle": ("bicycle",), "pedestrian": ("pedestrian",), "pedestrians": ("pedestrian",),
    "vehicle": _ALL_VEHICLES, "vehicles": _ALL_VEHICLES, "traffic": _ALL_VEHICLES,
    "obstacle": ("static", "obstacle"), "cone": ("static",), "barrier": ("obstacle",),
}  # fmt: skip
"""Kinds of road users that a word covers."""
ROAD_USERS: Final = frozenset(_KINDS)
"""Words for what can be pointed at among those who are on the road, or stand in its way."""
_AT_JUNCTIONS: Final[frozenset[ReferenceKind]] = frozenset({"junction", "crosswalk", "end_of_road"})
"""Places that are at a junction, or are one: a world's map knows no others."""
_SEEN: Final = frozenset[ReferenceKind]({*ROAD_USERS, "light", "stop_sign", "sign", *_AT_JUNCTIONS})
"""What narrows a search for what stands by it; other things ("under the trees") are not known, and narrow nothing."""
PLURALS: Final[frozenset[ReferenceKind]] = frozenset({"vehicles", "pedestrians", "traffic"})
_TAKEN_FOR: Final[dict[Colour, tuple[Colour, ...]]] = {
    "silver": ("grey",), "grey": ("silver",), "dark": ("black", "grey", "blue", "brown", "green"),
    "black": ("dark",), "beige": ("brown", "white"), "white": ("silver",), "orange": ("yellow",), "pink": ("red",),
}  # fmt: skip
"""Colours that people also mean by a word, where nothing in sight has the one that was said."""
_HOLDS: Final[dict[State, tuple[State, ...]]] = {"standing": ("standing", "stopped"), "walking": ("walking",)}

_ABOUT_AHEAD: Final[frozenset[Verb]] = frozenset(
    {"follow", "stop", "park", "pull_over", "wait", "yield", "avoid", "pass"}
)
"""Acts about a road user that is ahead, where there is one."""

TargetKind = Literal["agent", "light", "sign", "junction"]


@dataclass(frozen=True, slots=True)
class Target:
    """A candidate of a reference.

    Attributes:
        kind: What sort of thing it is.
        id: Stable within a trip; of an agent the number it has in observations, as text.
        forward_m, leftward_m: In the ego's frame.
        words: What tells it from others of its kind: colour, kind.
    """

    kind: TargetKind
    id: str
    forward_m: float
    leftward_m: float
    words: str = ""

    @property
    def agent(self) -> int:
        """The road user's number. Raises ValueError for other things."""
        return int(self.id)

    @property
    def away_m(self) -> float:
        """Distance from the middle of the ego."""
        return math.hypot(self.forward_m, self.leftward_m)


@dataclass(frozen=True, slots=True)
class Grounded:
    """A reference resolved at an instant.

    Attributes:
        reference: The words.
        fits: Everything in sight that the attributes allow, nearest first.
        targets: What is meant: one, all of a plural; empty where it is not known.
        question: Where several are left: the one question that names the difference.
        absent: Where none is left: that none is in sight, in words.
    """

    reference: Reference
    fits: tuple[Target, ...] = ()
    targets: tuple[Target, ...] = ()
    question: str = ""
    absent: str = ""
    choices: tuple[Reference, ...] = field(default=())
    """Of a question: the references that answer it, in its order."""


def ground(reference: Reference, observation: Observation, verb: Verb | None = None) -> Grounded:
    """Resolve a reference.

    Args:
        reference: What was said.
        observation: The instant at which it was said.
        verb: The act it belongs to: of several road users alike, one that can be followed is meant by "follow".
    """
    fits = tuple(sorted(_fitting(reference, observation), key=_order))
    if not fits:
        return Grounded(reference, absent=_absent(reference, observation))
    return _chosen(reference, fits, observation, verb)


def reference_of(kind: str, colour: str = "", state: str = "", side: str = "") -> Reference:
    """A deictic reference to one road user of that description. Raises DataError for a word that references lack."""
    said = {"kind": kind, "colour": colour, "state": state, "side": side, "deictic": True}
    return reference_from_json({name: value for name, value in said.items() if value})


def spoken_of(reference: Reference, before: Iterable[Reference]) -> Reference | None:
    """The earlier reference that one takes up: of its kind, told by nothing that was not said of that one."""
    if reference.kind in PLURALS:
        return None
    return next((one for one in reversed(tuple(before)) if one != reference and _takes_up(reference, one)), None)


def _takes_up(reference: Reference, before: Reference) -> bool:
    said = ("colour", "state", "side", "where", "ordinal", "of")
    return reference.kind == before.kind and all(
        getattr(reference, one) in (None, getattr(before, one)) for one in said
    )


# What fits ------------------------------------------------------------------------------------------------------------


def _fitting(reference: Reference, observation: Observation) -> list[Target]:
    kind = reference.kind
    if kind in _KINDS:
        found = [_target(one, observation) for one in _agents(reference, observation)]
    elif kind == "light":
        found = _lights(observation)
    elif kind in ("stop_sign", "sign"):
        found = _signs(reference, observation)
    elif kind in _AT_JUNCTIONS:
        found = _junctions(observation)
    else:
        return []
    if kind in _KINDS and reference.of is not None and reference.of.kind in _SEEN:
        around = _fitting(reference.of, observation)
        found = [
            one
            for one in found
            if any(
                math.hypot(one.forward_m - its.forward_m, one.leftward_m - its.leftward_m) < _OF_M
                for its in around
                if its.id != one.id
            )
        ]
    return found


def _agents(reference: Reference, observation: Observation) -> list[VehicleState]:
    kinds, ego = _KINDS[reference.kind], observation.ego
    near: list[VehicleState] = []
    for one in (*observation.others, *observation.objects):
        if one.kind not in kinds or (reference.kind == "van" and one.length_m < VAN_M):
            continue
        forward, leftward = seen_from(ego, one)
        if math.hypot(forward, leftward) < SIGHT_M and forward > -BEHIND_M:
            near.append(one)
    # Colours first: which of them are taken for the one that was said may depend on nothing else that is said.
    found = _of_colour(reference.colour, near)
    if reference.state is not None:
        wanted = _HOLDS.get(reference.state, (reference.state,))
        found = [one for one in found if states_of(one, observation).intersection(wanted)]
    seen = [(one, *seen_from(ego, one)) for one in found]
    return [
        one
        for one, forward, leftward in seen
        if _side_fits(reference.side, leftward) and _where_fits(reference, forward, leftward)
    ]


def _of_colour(colour: Colour | None, agents: list[VehicleState]) -> list[VehicleState]:
    if colour is None:
        return agents
    exact = [one for one in agents if one.colour == colour]
    return exact or [one for one in agents if one.colour in _TAKEN_FOR.get(colour, ())]


def _side_fits(side: Side | None, leftward_m: float) -> bool:
    return side is None or (leftward_m > _SIDE_M if side == "left" else leftward_m < -_SIDE_M)


def _where_fits(reference: Reference, forward_m: float, leftward_m: float) -> bool:
    away = math.hypot(forward_m, leftward_m)
    match reference.where:
        case None:
            return True
        case "ahead":
            return forward_m > 0.0
        case "behind":
            return forward_m < 0.0
        case "beside":
            return abs(forward_m) < _BESIDE_M
        case "far":
            return away > _FAR_M
        case "near":
            return away < _NEAR_M
        case "across":
            return abs(leftward_m) > _ACROSS_M


def _target(agent: VehicleState, observation: Observation) -> Target:
    forward, leftward = seen_from(observation.ego, agent)
    kind = "van" if agent.kind == "car" and agent.length_m >= VAN_M else agent.kind
    return Target("agent", str(agent.id), forward, leftward, f"{agent.colour or ''} {kind}".strip())


def _lights(observation: Observation) -> list[Target]:
    """Lights that rule the ego's lane or what it leads into."""
    road, lane = observation.road, observation.ego.lane
    if lane is None or lane not in road:
        return []
    ahead = {one.id for one, _ in zip(road.ahead(lane), range(6), strict=False)}
    ahead |= {one.id for name in tuple(ahead) for one in road.abreast(name)}
    return [_light(one, observation) for one in observation.signals if ahead & set(one.lanes)]


def _light(signal: Signal, observation: Observation) -> Target:
    (ax, ay), (bx, by) = signal.stop_line_m
    ego = observation.ego
    forward, leftward = Pose(ego.x_m, ego.y_m, ego.heading_rad).sees((ax + bx) / 2.0, (ay + by) / 2.0)
    return Target("light", signal.id, forward, leftward, "light")


def _signs(reference: Reference, observation: Observation) -> list[Target]:
    ego = observation.ego
    here = Pose(ego.x_m, ego.y_m, ego.heading_rad)
    own = observation.road.get(ego.lane)
    ahead = set[str]()
    if own is not None:
        ahead = {one.id for one, _ in zip(observation.road.ahead(own.id), range(6), strict=False)}
    found: list[Target] = []
    for sign in observation.signs:
        if reference.kind == "stop_sign" and sign.kind != "stop":
            continue
        forward, leftward = here.sees(sign.x_m, sign.y_m)
        if 0.0 < forward < SIGHT_M and ahead & set(sign.lanes):
            found.append(Target("sign", sign.id, forward, leftward, f"{sign.kind} sign".replace("_", " ")))
    return found


def _junctions(observation: Observation) -> list[Target]:
    """Junctions along the lane, straight on, the next one first."""
    road, ego = observation.road, observation.ego
    own = road.get(ego.lane)
    if own is None:
        return []
    found: list[Target] = []
    at_m = -max(0.0, own.centre.nearest(ego.x_m, ego.y_m))
    for lane in road.ahead(own.id):
        if at_m > 3.0 * SIGHT_M:
            break
        if lane.junction and lane.id != own.id and lane.junction not in (one.id for one in found):
            found.append(Target("junction", lane.junction, at_m, 0.0, "junction"))
        at_m += lane.length_m
    return found


# Which of them --------------------------------------------------------------------------------------------------------


def _order(target: Target) -> tuple[bool, float, str]:
    """Ahead before behind, near before far."""
    return target.forward_m < _AHEAD_M, target.away_m, target.id


def _chosen(reference: Reference, fits: tuple[Target, ...], observation: Observation, verb: Verb | None) -> Grounded:
    if reference.kind in PLURALS:
        return Grounded(reference, fits, fits)
    number = reference.ordinal
    if number is not None:
        ahead = [one for one in fits if one.forward_m >= _AHEAD_M] or list(fits)
        index = number - 1 if number > 0 else len(ahead) + number
        if 0 <= index < len(ahead):
            return Grounded(reference, fits, (ahead[index],))
        return Grounded(reference, fits, absent=f"I see only {len(ahead)} {_plural(reference)}.")
    able = _able(fits, observation, verb)
    if reference.deictic or len(able) == 1 or fits[0].kind != "agent" or _clearly(able):
        return Grounded(reference, fits, (able[0],))
    return _asked(reference, fits, able, observation)


def _able(fits: tuple[Target, ...], observation: Observation, verb: Verb | None) -> list[Target]:
    """Those of several that the act can be about, or all where it can be about none."""
    if len(fits) < 2 or fits[0].kind != "agent" or verb not in _ABOUT_AHEAD:
        return list(fits)
    by_id = {str(one.id): one for one in (*observation.others, *observation.objects)}
    able = [one for one in fits if _suits(by_id[one.id], one, observation, verb)]
    return able or list(fits)


def _suits(agent: VehicleState, seen: Target, observation: Observation, verb: Verb) -> bool:
    if verb != "follow":
        return seen.forward_m > _AHEAD_M
    same_way = math.cos(agent.heading_rad - observation.ego.heading_rad) > 0.0
    return seen.forward_m > 0.0 and same_way and "parked" not in states_of(agent, observation)


def _clearly(able: Sequence[Target]) -> bool:
    """True if the first is so much nearer than the second that nobody would ask."""
    first, second = able[0].away_m, able[1].away_m
    return second > _CLEARLY * first and second - first > _CLEARLY_M


def _asked(reference: Reference, fits: tuple[Target, ...], able: list[Target], observation: Observation) -> Grounded:
    """The question that tells two candidates apart: by colour, side, what they do, else how far they are."""
    one, other = able[0], able[1]
    noun = _noun(reference)
    by_id = {str(agent.id): agent for agent in (*observation.others, *observation.objects)}
    first, second = by_id[one.id], by_id[other.id]
    if first.colour != second.colour and first.colour and second.colour and reference.colour is None:
        choices = replace(reference, colour=first.colour), replace(reference, colour=second.colour)
        words = f"the {first.colour} one or the {second.colour} one"
    elif one.leftward_m > _SIDE_M and other.leftward_m < -_SIDE_M:
        choices = replace(reference, side="left"), replace(reference, side="right")
        words = "the one on the left or the one on the right"
    elif one.leftward_m < -_SIDE_M and other.leftward_m > _SIDE_M:
        choices = replace(reference, side="right"), replace(reference, side="left")
        words = "the one on the right or the one on the left"
    elif state := _telling(states_of(first, observation), states_of(second, observation)):
        choices = replace(reference, state=state[0]), replace(reference, state=state[1])
        words = f"the {state[0]} one or the {state[1]} one"
    else:
        choices = replace(reference, ordinal=1), replace(reference, ordinal=2)
        words = f"the first one, {one.away_m:.0f} m away, or the second one, {other.away_m:.0f} m away"
    more = "" if len(able) == 2 else f" I see {len(able)} of them."
    return Grounded(reference, fits, question=f"Which {noun} do you mean: {words}?{more}", choices=choices)


_TELLING: Final[tuple[State, ...]] = (
    "parked", "oncoming", "crossing", "turning", "moving", "walking", "stopped", "standing",
)  # fmt: skip


def _telling(first: Iterable[State], second: Iterable[State]) -> tuple[State, State] | None:
    """A state of each of two that the other has not; None where they do the same."""
    mine, its = set(first) - set(second), set(second) - set(first)
    one: State | None = next((state for state in _TELLING if state in mine), None)
    other: State | None = next((state for state in _TELLING if state in its), None)
    return None if one is None or other is None else (one, other)


def _noun(reference: Reference) -> str:
    return " ".join(
        part for part in (reference.state or "", reference.colour or "", reference.kind.replace("_", " ")) if part
    )


def _plural(reference: Reference) -> str:
    noun = _noun(reference)
    return noun if reference.kind in PLURALS else f"{noun}es" if noun.endswith("s") else f"{noun}s"


def _absent(reference: Reference, observation: Observation) -> str:
    """Reason why nothing is meant, by the first attribute that nothing in sight has."""
    bare = Reference(reference.kind)
    if reference.kind not in _SEEN:
        return f"I cannot make out a {reference.kind.replace('_', ' ')} here."
    if not _fitting(bare, observation):
        return f"I see no {_plural(bare) if reference.kind in PLURALS else _noun(bare)}."
    colours = {one.colour for one in observation.others}
    if reference.colour is not None and colours <= {None}:
        return f"I cannot tell colours here, so I do not know which {_noun(bare)} is meant."
    seen = _fitting(replace(bare, colour=reference.colour), observation)
    where = {"ahead": "ahead", "behind": "behind us", "beside": "beside us", "across": "across the road"}.get(
        reference.where or "", reference.where or ""
    )
    said = [f"on the {reference.side}" if reference.side else "", where]
    said += ["where you say" if reference.of is not None else ""]
    place = " ".join(part for part in said if part)
    return f"I see no {_noun(reference if seen else replace(reference, state=None))}{f' {place}' if place else ''}."
