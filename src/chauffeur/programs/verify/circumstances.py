"""Where a program is to be driven, as values; and what the driving APIs can answer there.

What is said of the ego's own place holds in the program's first control period only: then the road goes on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from chauffeur.concept import Observation
from chauffeur.programs.catalogue import apis_of
from chauffeur.programs.verify.values import (
    ANY_TEXT,
    CAR,
    EGO,
    FLAG,
    LANE,
    NONE,
    NOTHING,
    TOP,
    Value,
    fresh,
    number,
)

MAX_SPEED_MPS: Final = 100.0
"""No vehicle is taken to be faster, in either direction: the worlds themselves stop at less than half of it."""
MAX_DISTANCE_M: Final = 1e6
"""No two vehicles are taken to be farther apart along a lane."""
MAX_TARGET_MPS: Final = 1000.0
"""A target speed is clipped to this at run time (the catalogue's `clip`)."""
MAX_HEADWAY_S: Final = 10.0
"""Nobody is taken to start a program with a larger headway; what a program sets is clipped to 2 s."""


@dataclass(frozen=True, slots=True)
class Circumstances:
    """The road and the ego on it when a program begins. What is None is not known.

    Attributes:
        kind: Kind of road: `highway`, `intersection`; empty for any.
        speed_limits_mps: Lowest and highest limit of any lane of the road.
        speed_limit_mps: Limit of the lane the ego is in.
        speed_mps: Lowest and highest speed that the ego may have.
        lanes: Lanes beside each other in the ego's direction, its own included.
        lane_index: The ego's lane among them; 0 is leftmost.
    """

    kind: str = ""
    speed_limits_mps: tuple[float, float] = (0.0, MAX_SPEED_MPS)
    speed_limit_mps: float | None = None
    speed_mps: tuple[float, float] | None = None
    lanes: int | None = None
    lane_index: int | None = None

    @classmethod
    def of(cls, observation: Observation) -> Circumstances:
        """The circumstances of an instant. The speed is taken with 1 m/s to either side: it is the first to change."""
        own = observation.road.get(observation.ego.lane)
        limits = [lane.speed_limit_mps for lane in observation.road.lanes]
        beside = () if own is None else observation.road.abreast(own.id)
        speed = observation.ego.speed_mps
        return cls(
            kind=observation.kind,
            speed_limits_mps=(min(limits, default=0.0), max(limits, default=MAX_SPEED_MPS)),
            speed_limit_mps=None if own is None else own.speed_limit_mps,
            speed_mps=(speed - 1.0, speed + 1.0),
            lanes=None if own is None else len(beside),
            lane_index=None if own is None else beside.index(own),
        )

    def has_lane(self, offset: int) -> bool | None:
        """Whether there is a lane so many places to the right of the ego's (negative: left); None if not known."""
        if self.lanes is None or self.lane_index is None:
            return None
        return 0 <= self.lane_index + offset < self.lanes


ANYWHERE: Final = Circumstances()
"""Any road and any place on it."""

_STEPS: Final = {"get_left_lane": -1, "get_right_lane": 1}
_SPEED: Final = number(-MAX_SPEED_MPS, MAX_SPEED_MPS)
_NUMBERS: Final = {
    "get_desired_time_headway": number(0.0, MAX_HEADWAY_S),
    "get_target_speed": number(-MAX_SPEED_MPS, MAX_TARGET_MPS),
    "get_speed_of": _SPEED,
    "get_distance_between_vehicles": number(-MAX_DISTANCE_M, MAX_DISTANCE_M),
    "detect_stop_sign_ahead": number(-MAX_DISTANCE_M, MAX_DISTANCE_M),
    "get_distance_to_junction": number(0.0, MAX_DISTANCE_M),
    "get_distance_to_place": number(-1.0, MAX_DISTANCE_M),
}


def answer(name: str, arguments: dict[str, Value], where: Circumstances, *, first: bool, site: int) -> Value:
    """What a driving API may answer.

    Args:
        name: API name.
        arguments: What it is given, by parameter.
        where: Circumstances.
        first: Whether it is surely asked in the first control period.
        site: Place of the call.
    """
    if name in {"get_speed_limit", "check_speed_limit"}:
        here = where.speed_limit_mps
        return number(*where.speed_limits_mps) if here is None or not first else number(here, here)
    if name == "get_speed_of":
        vehicle = arguments.get("veh")
        if first and where.speed_mps is not None and vehicle is not None and vehicle.bits == EGO:
            return number(*where.speed_mps)
        return _SPEED
    if name == "get_lane_of":
        return Value(LANE, offsets=frozenset({0}) if _of_ego(arguments) else None)
    if name in _STEPS:
        return _beside(_STEPS[name], where, first=first) if _of_ego(arguments) else Value(LANE | NONE, offsets=None)
    if name in _NUMBERS:
        return _NUMBERS[name]
    api = apis_of("town")[name]
    if api.answer is not None:  # a plug-in vouches for no range
        return TOP
    if api.returns == "vehicle":
        return Value(EGO) if name == "get_ego_vehicle" else Value(CAR | NONE)
    if api.returns == "flag":
        return FLAG
    if api.returns == "text":
        return ANY_TEXT
    if api.returns in {"sighting", "place", "light"}:
        return TOP
    if api.returns in {"lanes", "action"}:
        return fresh(site)
    return NOTHING


def _of_ego(arguments: dict[str, Value]) -> bool:
    vehicle = arguments.get("veh")
    return vehicle is None or not vehicle.bits & ~(EGO | NONE)


def _beside(offset: int, where: Circumstances, *, first: bool) -> Value:
    there = where.has_lane(offset) if first else None
    if there is None:
        return Value(LANE | NONE, offsets=frozenset({offset}))
    return Value(LANE, offsets=frozenset({offset})) if there else NOTHING
