"""Where a program is to be driven, as values; and what the driving APIs can answer there.

What is said of the ego's own place holds in the program's first control period only: then the road goes on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from chauffeur.concept import Snapshot
from chauffeur.programs.catalogue import APIS
from chauffeur.programs.verify.values import (
    ANY_TEXT,
    CAR,
    EGO,
    FLAG,
    LANE,
    NONE,
    NOTHING,
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
    def of(cls, snapshot: Snapshot) -> Circumstances:
        """The circumstances of an instant. The speed is taken with 1 m/s to either side: it is the first to change."""
        here = snapshot.ego.lane
        limits = [lane.speed_limit_mps for lane in snapshot.lanes]
        beside = sorted(lane.id[2] for lane in snapshot.lanes if here is not None and lane.id[:2] == here[:2])
        on_road = here is not None and here[2] in beside
        speed = snapshot.ego.speed_mps
        return cls(
            kind=snapshot.kind,
            speed_limits_mps=(min(limits, default=0.0), max(limits, default=MAX_SPEED_MPS)),
            speed_limit_mps=next((lane.speed_limit_mps for lane in snapshot.lanes if lane.id == here), None),
            speed_mps=(speed - 1.0, speed + 1.0),
            lanes=len(beside) if on_road else None,
            lane_index=beside.index(here[2]) if here is not None and on_road else None,
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
    if name == "get_speed_limit":
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
    api = APIS[name]
    if api.returns == "vehicle":
        return Value(EGO) if name == "get_ego_vehicle" else Value(CAR | NONE)
    if api.returns == "flag":
        return FLAG
    if api.returns == "text":
        return ANY_TEXT
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
