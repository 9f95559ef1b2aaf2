"""The driving APIs: one table, three readers.

A vocabulary is the part of the table that a kind of road understands: `road` is LaMPilot's, `town` adds the paper's
town calls (Sec. IV-B: `check_front_vehicle`, `check_speed_limit`, `stop`, `proceed`) and those for lights, people,
junctions, places and single road users (`agent`). Prompt documentation (`render_docs`), the static gate's signatures
(`argument_problem`) and the run-time binding all read it. Names and meanings of roads are those of the public LaMPilot
benchmark, so its programs run unchanged; `get_speed_limit` is ours. A vehicle or lane is an opaque handle: a program
passes it on, compares it with `==` or tests it for None, and can do nothing else with it.

A plug-in adds a question of its own as an `Api` with an `answer` (entry-point group `chauffeur.apis`). It cannot add a
wish: what a program may want of the car are the set-points, and these are checked.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cache
from keyword import iskeyword
from typing import Any, Final, Literal

from chauffeur.concept import ConfigError
from chauffeur.concept.registry import load_plugin, plugin_names
from chauffeur.programs.words import BUILTINS

ValueKind = Literal[
    "vehicle", "lane", "lanes", "number", "flag", "text", "action", "nothing", "sighting", "place", "light"
]
"""What crosses between a program and its host. A sighting is (is there one, m, m/s), a place (is there one, m), a light
(what it shows, m)."""

Vocabulary = Literal["road", "town"]
"""Which of the driving APIs a kind of road understands."""

Required = Literal["required"]

_STUB_TYPES: Final[dict[ValueKind, str]] = {
    "vehicle": "Vehicle",
    "lane": "Lane",
    "lanes": "list[Lane]",
    "number": "float",
    "flag": "bool",
    "text": "str",
    "action": "list[float]",
    "nothing": "None",
    "sighting": "tuple[bool, float, float]",
    "place": "tuple[bool, float]",
    "light": "tuple[str, float]",
}

MAX_SAY_CHARS: Final = 500
"""Longest text `say` takes; a passenger reads it while driving."""
MAX_SAID_AT_ONCE: Final = 5
"""Texts of one control period that are handed on; what is said beyond is counted, and that is said instead."""
MAX_SAID: Final = 200
"""Texts of one program that are handed on: every screen, log and recording keeps them."""


@dataclass(frozen=True, slots=True)
class Param:
    """A parameter of a driving API.

    Attributes:
        name: Keyword.
        kind: What it takes.
        meaning: What it is, with its unit.
        unit: Unit of a number, empty otherwise.
        default: `required`, a number, or None (the API's documented fallback).
        optional: Whether an explicit None is accepted.
        low, high: Range in which a constant written in a program makes sense; outside it is a slip of unit or sign.
        clip: Range a number is clipped to at run time, as LaMPilot clips the headway; None for no clipping. Numbers
            that are not finite are refused in any case.
    """

    name: str
    kind: ValueKind
    meaning: str
    unit: str = ""
    default: Required | float | None = "required"
    optional: bool = False
    low: float | None = None
    high: float | None = None
    clip: tuple[float, float] | None = None

    @property
    def required(self) -> bool:
        """Whether a call must give it."""
        return self.default == "required"


@dataclass(frozen=True, slots=True)
class Api:
    """A driving API.

    Attributes:
        name: Function name.
        meaning: One or two sentences for the model.
        returns: What comes back.
        maybe_none: Whether None may come back instead.
        result: The result in words, with its unit.
        params: Parameters in order.
        example: A line of program.
        effect: `read` asks the present instant, `wish` changes what the program wants, `say` speaks.
        answer: What a plug-in's API answers: a function of the world's `Perception` and the call's arguments, vehicles
            as ids. Raises ValueError, which the program may catch, where it has none. None for built-in APIs.
    """

    name: str
    meaning: str
    returns: ValueKind
    example: str
    result: str = ""
    maybe_none: bool = False
    params: tuple[Param, ...] = ()
    effect: Literal["read", "wish", "say"] = "read"
    answer: Callable[..., Any] | None = None

    @property
    def signature(self) -> str:
        """The call as a stub line without `def`, e.g. `get_speed_of(veh: Vehicle) -> float`."""
        parts = [_param_stub(param) for param in self.params]
        none = " | None" if self.maybe_none else ""
        return f"{self.name}({', '.join(parts)}) -> {_STUB_TYPES[self.returns]}{none}"


def _param_stub(param: Param) -> str:
    stub = f"{param.name}: {_STUB_TYPES[param.kind]}"
    if param.optional:
        stub += " | None"
    if not param.required:
        stub += f" = {param.default}"
    return stub


_VEH = Param("veh", "vehicle", "a vehicle")
_VEH_OR_GONE = Param("veh", "vehicle", "a vehicle; None is one that is out of sight", optional=True)
_VEH_OR_EGO = Param("veh", "vehicle", "a vehicle; None is the ego", default=None, optional=True)
_LANE_OR_EGO = Param("lane", "lane", "a lane; None is the lane the ego is in", optional=True)
_DISTANCE = Param("distance", "number", "how far to look", "m", default=100.0, low=0.0, high=2000.0)

CATALOGUE: Final[tuple[Api, ...]] = (
    Api(
        "get_ego_vehicle",
        "The vehicle this program drives.",
        "vehicle",
        "ego = get_ego_vehicle()",
    ),
    Api(
        "get_desired_time_headway",
        "The time headway the ego wants to the vehicle in front; 1.5 s until it is set.",
        "number",
        "headway = get_desired_time_headway()",
        result="seconds",
    ),
    Api(
        "get_target_speed",
        "The speed the ego wants in free traffic; its speed at the start until it is set.",
        "number",
        "speed = get_target_speed()",
        result="m/s",
    ),
    Api(
        "say",
        "Tells the passenger something.",
        "nothing",
        'say("I am waiting for a gap on the left.")',
        params=(Param("text", "text", f"what to say, at most {MAX_SAY_CHARS} characters"),),
        effect="say",
    ),
    Api(
        "is_safe_enter",
        "Whether the ego may enter a lane now: neither it nor the vehicle behind it there would have to brake harder "
        "than safe_decel. False for None, so the result of get_left_lane can be passed on.",
        "flag",
        "if is_safe_enter(get_left_lane(ego)): ...",
        params=(
            Param("lane", "lane", "the lane to enter", optional=True),
            Param("safe_decel", "number", "hardest acceptable braking", "m/s^2", default=5.0, low=0.0, high=15.0),
        ),
    ),
    Api(
        "set_desired_time_headway",
        "Sets the time headway to the vehicle in front. A gap of d metres at v m/s is a headway of d / v seconds. "
        "Clipped to 0.01..2.0 s.",
        "nothing",
        "set_desired_time_headway(1.2)",
        params=(Param("desired_time_headway", "number", "time headway", "s", low=0.0, high=10.0, clip=(0.01, 2.0)),),
        effect="wish",
    ),
    Api(
        "set_target_speed",
        "Sets the speed wanted in free traffic. The autopilot still slows down behind slower traffic.",
        "nothing",
        "set_target_speed(28.0)",
        params=(Param("target_speed", "number", "speed", "m/s", low=0.0, high=70.0, clip=(0.0, 1000.0)),),
        effect="wish",
    ),
    Api(
        "set_target_lane",
        "Sets the lane to drive in; the autopilot steers there at once, so ask is_safe_enter first.",
        "nothing",
        "set_target_lane(get_left_lane(ego))",
        params=(Param("target_lane", "lane", "a lane from get_lane_of, get_left_lane or get_right_lane"),),
        effect="wish",
    ),
    Api(
        "autopilot",
        "The action that follows the target lane, the target speed and the vehicle in front for one control period of "
        "0.1 s. Yield it: `yield autopilot()`.",
        "action",
        "yield autopilot()",
        result="[acceleration m/s^2, steering rad]",
    ),
    Api(
        "recover_from_stop",
        "Drives on after a full stop at a stop sign. Works only below 1 m/s with the stop sign in front; call it when "
        "the crossing is free.",
        "nothing",
        "recover_from_stop()",
        effect="wish",
    ),
    Api(
        "get_speed_of",
        "Speed of a vehicle.",
        "number",
        "speed = get_speed_of(ego)",
        result="m/s",
        params=(_VEH,),
    ),
    Api(
        "get_lane_of",
        "Lane a vehicle is in.",
        "lane",
        "lane = get_lane_of(ego)",
        params=(_VEH,),
    ),
    Api(
        "detect_front_vehicle_in",
        "The nearest vehicle or obstacle ahead of the ego in a lane.",
        "vehicle",
        "front = detect_front_vehicle_in(get_lane_of(ego))",
        result="the vehicle, or None when there is none within the distance",
        maybe_none=True,
        params=(_LANE_OR_EGO, _DISTANCE),
    ),
    Api(
        "detect_rear_vehicle_in",
        "The nearest vehicle or obstacle behind the ego in a lane.",
        "vehicle",
        "rear = detect_rear_vehicle_in(get_left_lane(ego), 50)",
        result="the vehicle, or None when there is none within the distance",
        maybe_none=True,
        params=(_LANE_OR_EGO, _DISTANCE),
    ),
    Api(
        "get_distance_between_vehicles",
        "Distance between the centres of two vehicles along the lane.",
        "number",
        "gap = get_distance_between_vehicles(front, ego)",
        result="m, positive when veh1 is ahead of veh2",
        params=(Param("veh1", "vehicle", "a vehicle"), Param("veh2", "vehicle", "another vehicle")),
    ),
    Api(
        "get_left_lane",
        "The lane to the left of a vehicle's lane.",
        "lane",
        "left = get_left_lane(ego)",
        result="the lane, or None in the leftmost lane",
        maybe_none=True,
        params=(_VEH_OR_EGO,),
    ),
    Api(
        "get_right_lane",
        "The lane to the right of a vehicle's lane.",
        "lane",
        "right = get_right_lane(ego)",
        result="the lane, or None in the rightmost lane",
        maybe_none=True,
        params=(_VEH_OR_EGO,),
    ),
    Api(
        "get_left_to_right_cross_traffic_lanes",
        "Lanes of the traffic that crosses from the left at the next intersection.",
        "lanes",
        "lanes = get_left_to_right_cross_traffic_lanes()",
        result="lanes, empty where there is no intersection",
    ),
    Api(
        "get_right_to_left_cross_traffic_lanes",
        "Lanes of the traffic that crosses from the right at the next intersection.",
        "lanes",
        "lanes = get_right_to_left_cross_traffic_lanes()",
        result="lanes, empty where there is no intersection",
    ),
    Api(
        "detect_stop_sign_ahead",
        "Distance to the stop sign ahead.",
        "number",
        "distance = detect_stop_sign_ahead()",
        result="m, or -1 when there is none",
    ),
    Api(
        "turn_left_at_next_intersection",
        "Routes the ego to the left at the next intersection.",
        "nothing",
        "turn_left_at_next_intersection()",
        effect="wish",
    ),
    Api(
        "turn_right_at_next_intersection",
        "Routes the ego to the right at the next intersection.",
        "nothing",
        "turn_right_at_next_intersection()",
        effect="wish",
    ),
    Api(
        "go_straight_at_next_intersection",
        "Routes the ego straight across the next intersection.",
        "nothing",
        "go_straight_at_next_intersection()",
        effect="wish",
    ),
    Api(
        "get_speed_limit",
        "Speed limit of the lane the ego is in.",
        "number",
        "set_target_speed(min(30.0, get_speed_limit()))",
        result="m/s",
    ),
)

APIS: Final[dict[str, Api]] = {api.name: api for api in CATALOGUE}
"""The table of roads by name."""

NOTHING_AHEAD_M: Final = 1000.0
"""Distance to what is not there: larger than any that a program compares with."""

TOWN_CALLS: Final[tuple[Api, ...]] = (
    Api(
        "check_front_vehicle",
        "The vehicle or thing ahead of the ego on its way.",
        "sighting",
        "is_front_vehicle, distance, speed = check_front_vehicle()",
        result=f"(whether there is one, m between the bumpers, its speed in m/s); {NOTHING_AHEAD_M:g} m without one",
    ),
    Api(
        "check_speed_limit",
        "Speed limit of the lane the ego is in.",
        "number",
        "yield proceed(check_speed_limit())",
        result="m/s",
    ),
    Api(
        "check_traffic_light",
        "The next traffic light that rules the ego's way.",
        "light",
        "state, distance = check_traffic_light()",
        result=f'("red", "yellow", "green", "off" or "none", m to its stop line); {NOTHING_AHEAD_M:g} m without one',
    ),
    Api(
        "check_stop_sign",
        "The next stop sign on the ego's way at which it has not stopped yet.",
        "place",
        "is_stop_sign, distance = check_stop_sign()",
        result=f"(whether there is one, m); {NOTHING_AHEAD_M:g} m without one",
    ),
    Api(
        "check_people",
        "The nearest person on foot ahead, on the ego's way or close to it.",
        "place",
        "is_somebody, distance = check_people()",
        result=f"(whether there is somebody, m); {NOTHING_AHEAD_M:g} m without",
    ),
    Api(
        "get_distance_to_junction",
        "Distance to the next junction at which the ego has a choice of ways.",
        "number",
        "distance = get_distance_to_junction()",
        result=f"m, {NOTHING_AHEAD_M:g} where none is near",
    ),
    Api(
        "can_go",
        "Whether a way leads on to a side at the next junction, from whichever lane of the street.",
        "flag",
        'if can_go("left"): ...',
        params=(Param("side", "text", "left, straight or right"),),
    ),
    Api(
        "get_distance_to_place",
        "Distance along the ego's way to a place by its name or kind, e.g. a church.",
        "number",
        'distance = get_distance_to_place("church")',
        result="m, or -1 where it does not lie ahead on this way",
        params=(Param("name", "text", "name or kind of the place"),),
    ),
    Api(
        "change_lane_left",
        "Moves over to the lane on the left as soon as there is a gap.",
        "flag",
        "if not change_lane_left(): ...",
        result="whether there is such a lane",
        effect="wish",
    ),
    Api(
        "change_lane_right",
        "Moves over to the lane on the right as soon as there is a gap.",
        "flag",
        "if not change_lane_right(): ...",
        result="whether there is such a lane",
        effect="wish",
    ),
    Api(
        "agent",
        "A road user in sight by its number, as the situation tells it.",
        "vehicle",
        "car = agent(17)",
        result="the vehicle or person, or None where none with that number is in sight any more",
        maybe_none=True,
        params=(Param("label", "number", "its number", low=0.0, high=1e9),),
    ),
    Api(
        "see",
        "The road user that a description means, as a passenger would mean it: of several the nearest ahead. Empty "
        "texts leave an attribute open.",
        "vehicle",
        'car = see("car", "black", "parked", "right")',
        result="the vehicle or person, or None where none such is in sight",
        maybe_none=True,
        params=(
            Param("kind", "text", "car, truck, bus, van, motorcycle, bicycle, pedestrian or vehicle"),
            Param("colour", "text", "its colour"),
            Param("state", "text", "parked, moving, stopped, oncoming, turning, crossing, walking or standing"),
            Param("side", "text", "left or right of the ego"),
        ),
    ),
    Api(
        "in_sight",
        "Whether a road user is still in sight.",
        "flag",
        "if not in_sight(agent(17)): ...",
        params=(_VEH_OR_GONE,),
    ),
    Api(
        "get_distance_to",
        "Distance along the ego's way to a road user, parked ones beside it included.",
        "place",
        "is_ahead, distance = get_distance_to(agent(17))",
        result=f"(whether it is ahead, m from the front bumper to its near end); {NOTHING_AHEAD_M:g} m where it is not",
        params=(_VEH,),
    ),
    Api(
        "is_moving",
        "Whether a road user moves.",
        "flag",
        "if is_moving(agent(17)): ...",
        params=(_VEH,),
    ),
    Api(
        "has_gone",
        "Whether a road user has crossed or left the ego's way, is behind the ego, or out of sight.",
        "flag",
        "if has_gone(agent(17)): ...",
        params=(_VEH_OR_GONE,),
    ),
    Api(
        "has_passed",
        "Whether the ego has passed a road user: all of it is behind the ego.",
        "flag",
        "if has_passed(agent(17)): ...",
        params=(_VEH_OR_GONE,),
    ),
    Api(
        "is_clear",
        "Whether nobody who crosses the ego's way has to be let go first.",
        "flag",
        "if is_clear(): ...",
    ),
    Api(
        "follow_agent",
        "Drives behind a road user, in its lane and the way it goes, within the speed limit. Yield it in every step.",
        "action",
        "yield follow_agent(agent(17))",
        result="[speed wanted m/s]",
        params=(_VEH,),
        effect="wish",
    ),
    Api(
        "stop_behind",
        "Drives on, and stands a few metres behind a road user, a parked one beside the way included. Yield it in "
        "every step.",
        "action",
        "yield stop_behind(agent(17))",
        result="[speed wanted m/s]",
        params=(_VEH,),
        effect="wish",
    ),
    Api(
        "stop_beside",
        "Drives on, and stands beside a road user. Yield it in every step.",
        "action",
        "yield stop_beside(agent(17))",
        result="[speed wanted m/s]",
        params=(_VEH,),
        effect="wish",
    ),
    Api(
        "stop_beyond",
        "Drives past a road user that stands beside the way, and stands a few metres in front of it. Yield it in every "
        "step.",
        "action",
        "yield stop_beyond(agent(17))",
        result="[speed wanted m/s]",
        params=(_VEH,),
        effect="wish",
    ),
    Api(
        "give_way_to",
        "Drives on, and waits before the place where a road user crosses or may cross the way. Yield it in every step.",
        "action",
        "yield give_way_to(agent(17))",
        result="[speed wanted m/s]",
        params=(_VEH,),
        effect="wish",
    ),
    Api(
        "stop",
        "Slows down gently and stands. Yield it, for as long as the car shall stand: `yield stop()`.",
        "action",
        "yield stop()",
        result="[speed wanted m/s]",
        effect="wish",
    ),
    Api(
        "proceed",
        "Drives on at up to a speed; the autopilot still keeps its distance, stops at lights and stop signs and lets "
        "people and crossing traffic go first. Yield it in every step: `yield proceed(speed)`.",
        "action",
        "yield proceed(check_speed_limit())",
        result="[speed wanted m/s]",
        params=(Param("speed", "number", "speed", "m/s", low=0.0, high=70.0, clip=(0.0, 1000.0)),),
        effect="wish",
    ),
)

VOCABULARIES: Final[Mapping[Vocabulary, tuple[Api, ...]]] = {"road": CATALOGUE, "town": (*TOWN_CALLS, *CATALOGUE)}
"""The table, a part each vocabulary."""

TOWN_APIS: Final[dict[str, Api]] = {api.name: api for api in VOCABULARIES["town"]}
"""The table of towns by name. All of a road's are among them: programs of roads drive in towns as well."""

_ROADS: Final[Mapping[str, Vocabulary]] = {"town": "town"}


def vocabulary_of(kind: str) -> Vocabulary:
    """What a kind of road (`Observation.kind`) understands: LaMPilot's calls where it has none of its own."""
    return _ROADS.get(kind, "road")


GROUP: Final = "chauffeur.apis"
"""Entry points of driving APIs."""
OWN_KINDS: Final = frozenset({"vehicle", "lane", "number", "flag", "text"})
"""What a plug-in's API may answer."""
OWN_PARAMS: Final = frozenset({"vehicle", "lane", "number", "text"})
"""What a plug-in's API may take."""


@cache
def apis_of(vocabulary: Vocabulary) -> Mapping[str, Api]:
    """The driving APIs of a vocabulary by name, those of plug-ins after the built-in ones.

    Raises:
        ConfigError: A plug-in cannot be loaded, or is no driving API.
    """
    return {**{api.name: api for api in VOCABULARIES[vocabulary]}, **plugged_apis()}


@cache
def plugged_apis() -> Mapping[str, Api]:
    """The driving APIs of plug-ins by name. Raises ConfigError."""
    found: dict[str, Api] = {}
    for point in plugin_names(GROUP):
        api: object = load_plugin(GROUP, point)
        if fault := api_fault(api):
            raise ConfigError(f"The driving API {point!r} cannot be used: {fault}", hint="Mend or uninstall it.")
        assert isinstance(api, Api)
        if found.setdefault(api.name, api) is not api:
            raise ConfigError(f"Two plug-ins bring a driving API {api.name}.", hint="Uninstall one.")
    return found


def api_fault(api: object) -> str:
    """Why an object cannot be a plug-in's driving API, in words; empty where it can."""
    if not isinstance(api, Api):
        return f"it is a {type(api).__name__}, not an Api."
    names = [api.name, *(param.name for param in api.params)]
    for name in names:
        if not name.isidentifier() or iskeyword(name) or name.startswith("_"):
            return f"{name!r} is no plain name."
    if api.name in TOWN_APIS or api.name in BUILTINS:
        return f"the name {api.name} belongs to the driving language."
    if len(set(names)) < len(names):
        return "two of its names are the same."
    if api.effect != "read":
        return "its effect is not `read`: a plug-in asks, and only set-points act."
    if api.returns not in OWN_KINDS or any(param.kind not in OWN_PARAMS for param in api.params):
        return f"it may answer {', '.join(sorted(OWN_KINDS))} and take {', '.join(sorted(OWN_PARAMS))}."
    return "" if callable(api.answer) else "it has no `answer`."


def argument_problem(api: Api, positional: int, keywords: Collection[str]) -> str | None:
    """What is wrong with the shape of a call.

    Args:
        api: The API called.
        positional: Number of positional arguments.
        keywords: Names of keyword arguments.

    Returns:
        The problem in words, or None when the shape fits.
    """
    names = [param.name for param in api.params]
    if positional > len(names):
        takes = "no arguments" if not names else f"at most {len(names)} ({', '.join(names)})"
        return f"{api.name} takes {takes}, but is given {positional}"
    for keyword in keywords:
        if keyword not in names:
            known = f"; it knows {', '.join(names)}" if names else ""
            return f"{api.name} has no parameter {keyword[:40]!r}{known}"
        if names.index(keyword) < positional:
            return f"{api.name} is given {keyword!r} twice"
    missing = [p.name for p in api.params[positional:] if p.required and p.name not in keywords]
    if missing:
        return f"{api.name} needs {' and '.join(repr(name) for name in missing)}"
    return None


def render_docs(vocabulary: Vocabulary = "road") -> str:
    """The driving APIs of a vocabulary as Python stub text for a prompt."""
    return "\n\n".join(_render(api) for api in apis_of(vocabulary).values())


def _render(api: Api) -> str:
    lines = [f"def {api.signature}:", f'    """{api.meaning}']
    if api.params:
        lines += ["", "    Args:"]
        for param in api.params:
            unit = f" [{param.unit}]" if param.unit else ""
            lines.append(f"        {param.name}: {param.meaning}{unit}")
    if api.result:
        lines += ["", f"    Returns: {api.result}"]
    lines += ["", f"    Example: {api.example}", '    """']
    return "\n".join(lines)
