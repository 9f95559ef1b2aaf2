"""The driving APIs: one table, three readers.

Prompt documentation (`render_docs`), the static gate's signatures (`argument_problem`) and the run-time binding all
read `CATALOGUE`. Names and meanings are those of the public LaMPilot benchmark, so its programs run unchanged;
`get_speed_limit` is ours. A vehicle or lane is an opaque handle: a program passes it on, compares it with `==` or tests
it for None, and can do nothing else with it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Final, Literal

ValueKind = Literal["vehicle", "lane", "lanes", "number", "flag", "text", "action", "nothing"]
"""What crosses between a program and its host."""

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
    """

    name: str
    meaning: str
    returns: ValueKind
    example: str
    result: str = ""
    maybe_none: bool = False
    params: tuple[Param, ...] = ()
    effect: Literal["read", "wish", "say"] = "read"

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
"""The table by name."""


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


def render_docs() -> str:
    """The driving APIs as Python stub text for a prompt."""
    return "\n\n".join(_render(api) for api in CATALOGUE)


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
