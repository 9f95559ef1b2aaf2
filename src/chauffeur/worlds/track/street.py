"""An open road on the proving ground: a street with a kerb, at times a junction, crosswalks, cones, parked vehicles.

The ego starts at the origin, headed along +x, on the right-hand lane of a two-way street. Where there is a junction its
bends have radii of 7 m to the right and 10.5 m to the left, and every arm of it is a street of the same kind. Things
stand on the strip at the kerb.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Final, Literal

import numpy as np
from pydantic import ConfigDict, Field

from chauffeur.concept import Street, StreetMark, StreetWay, VehicleState
from chauffeur.geometry import Box, Lane, Polyline, Pose, RoadGraph, Turn

LANE_M: Final = 3.5
KERB_STRIP_M: Final = 2.1
LIMIT_MPS: Final = 30.0 / 3.6
RIGHT_M: Final = 7.0
LEFT_M: Final = RIGHT_M + LANE_M
BOX_M: Final = RIGHT_M + LEFT_M
"""Side of the square that a junction covers."""
ARM_M: Final = 60.0
CROSSWALK_M: Final = 3.0
CONES_M: Final = 3.0
VEHICLE_M: Final = 4.6
KNOWN_M: Final = 55.0
"""As far as ways on are told."""
DURATION_S: Final = 45.0

Arm = Literal["here", "left", "straight", "right"]
"""Which street something stands on: that of the ego before the junction, or one of those after it."""
ThingKind = Literal["cones", "vehicle"]
MarkKind = Literal["crosswalk", "cones", "vehicle"]


@dataclass(frozen=True, slots=True)
class Crosswalk:
    """A crosswalk; `at_m` is where it begins, from the ego, or from the end of the junction."""

    __pydantic_config__: ClassVar[Any] = ConfigDict(extra="forbid")

    at_m: Annotated[float, Field(ge=0.0, le=ARM_M - 10.0)]
    arm: Arm = "here"


@dataclass(frozen=True, slots=True)
class Thing:
    """A thing at the kerb; `at_m` is where it begins, from the ego, or from the end of the junction."""

    __pydantic_config__: ClassVar[Any] = ConfigDict(extra="forbid")

    kind: ThingKind
    at_m: Annotated[float, Field(ge=0.0, le=ARM_M - 10.0)]
    arm: Arm = "here"


@dataclass(frozen=True, slots=True)
class StreetConfig:
    """A street.

    Attributes:
        junction_m: From the ego to where the junction begins; None without one.
        ways: Where the junction leads.
        crosswalks: Crosswalks.
        things: What stands at the kerb.
        speed_mps: Of the ego at the start.
    """

    __pydantic_config__: ClassVar[Any] = ConfigDict(extra="forbid")

    junction_m: Annotated[float, Field(ge=6.0, le=40.0)] | None = None
    ways: tuple[Turn, ...] = ("straight",)
    crosswalks: tuple[Crosswalk, ...] = ()
    things: tuple[Thing, ...] = ()
    speed_mps: Annotated[float, Field(ge=0.0, le=8.0)] = 0.0


@dataclass(frozen=True)
class StreetScene:
    """Road, parked cars and cones of a street.

    Attributes:
        road: The lanes.
        start_mps: Speed at the start.
        duration_s: When it ends at the latest.
        parked: Vehicles that stand.
        cones: Cones.
    """

    road: RoadGraph
    start_mps: float
    duration_s: float
    parked: tuple[VehicleState, ...]
    cones: tuple[VehicleState, ...]


@lru_cache(maxsize=64)
def street_scene(config: StreetConfig) -> StreetScene:
    """Lanes and what stands on them."""
    own = Pose(0.0, 0.0, 0.0)
    ends: dict[Arm, Pose] = {}
    lanes: list[Lane] = []
    if config.junction_m is None:
        lanes += _two_way("here", own, -_BEHIND_M, ARM_M + 40.0, ())
    else:
        fork = own.ahead(config.junction_m)
        lanes += _two_way("here", own, -_BEHIND_M, config.junction_m, tuple(f"to_{turn}" for turn in config.ways))
        for turn in config.ways:
            through = _through(fork, turn)
            ends[turn] = through.at(through.length_m)
            lanes.append(
                Lane(
                    f"to_{turn}", through, LANE_M, LIMIT_MPS, road=f"to_{turn}", successors=(f"{turn}",),
                    junction="junction", turn=turn,
                )
            )  # fmt: skip
            lanes += _two_way(turn, ends[turn], 0.0, ARM_M, ())
    ends["here"] = own
    for number, one in enumerate(config.crosswalks):
        if one.arm in ends:
            middle = ends[one.arm].ahead(one.at_m + CROSSWALK_M / 2.0)
            side = LANE_M / 2.0 + KERB_STRIP_M
            line = Polyline.of((middle.place(0.0, -side), middle.place(0.0, LANE_M + side)))
            lanes.append(
                Lane(f"crosswalk_{number}", line, CROSSWALK_M, LIMIT_MPS, "crossing", road=f"crosswalk_{number}")
            )
    parked: list[VehicleState] = []
    cones: list[VehicleState] = []
    for thing in config.things:
        if thing.arm not in ends:
            continue
        lane = f"{thing.arm}_kerb"
        start = ends[thing.arm]
        if thing.kind == "vehicle":
            x, y = start.place(thing.at_m + VEHICLE_M / 2.0, -_KERB_M)
            parked.append(
                VehicleState(
                    _PARKED + len(parked), "car", x, y, start.heading_rad, 0.0, VEHICLE_M, _VEHICLE_WIDE_M, lane
                )
            )
            continue
        for k in range(_CONES):
            along = thing.at_m + _CONE_M / 2.0 + k * (CONES_M - _CONE_M) / (_CONES - 1)
            x, y = start.place(along, -_KERB_M)
            cones.append(
                VehicleState(_CONE + len(cones), "static", x, y, start.heading_rad, 0.0, _CONE_M, _CONE_M, lane)
            )
    return StreetScene(RoadGraph(tuple(lanes), _box(config)), config.speed_mps, DURATION_S, tuple(parked), tuple(cones))


_BEHIND_M: Final = 30.0
_KERB_M: Final = LANE_M / 2.0 + KERB_STRIP_M / 2.0
_VEHICLE_WIDE_M: Final = 1.75
_PARKED: Final = 10
_CONE: Final = 100
_CONES: Final = 3
_CONE_M: Final = 0.5


def _two_way(name: Arm, start: Pose, low_m: float, high_m: float, onward: tuple[str, ...]) -> list[Lane]:
    """A lane with its kerb strip from a pose on, and those of who comes the other way."""

    def line(left_m: float, *, back: bool = False) -> Polyline:
        ends = [start.place(low_m, left_m), start.place(high_m, left_m)]
        return Polyline.of(reversed(ends) if back else ends)

    there, back, wide = name, f"{name}_back", KERB_STRIP_M
    return [
        Lane(there, line(0.0), LANE_M, LIMIT_MPS, road=there, index=0, successors=onward),
        Lane(f"{there}_kerb", line(-_KERB_M), wide, LIMIT_MPS, "emergency", road=there, index=1),
        Lane(back, line(LANE_M, back=True), LANE_M, LIMIT_MPS, road=back, index=0),
        Lane(f"{back}_kerb", line(LANE_M + _KERB_M, back=True), wide, LIMIT_MPS, "emergency", road=back, index=1),
    ]  # fmt: skip


def _box(config: StreetConfig) -> tuple[Box, ...]:
    """The paved area of a junction: both streets, with the strips at their kerbs, straight across it."""
    if config.junction_m is None:
        return ()
    middle = config.junction_m + BOX_M / 2.0, LANE_M / 2.0
    wide = 2.0 * (LANE_M + KERB_STRIP_M)
    return Box(*middle, 0.0, BOX_M, wide), Box(*middle, 0.0, wide, BOX_M)


def _through(fork: Pose, turn: Turn) -> Polyline:
    """The way through the junction: an arc of a quarter circle, or straight on."""
    if turn == "straight":
        return Polyline.of((fork.place(0.0, 0.0), fork.place(BOX_M, 0.0)))
    radius, side = _BENDS[turn], 1.0 if turn == "left" else -1.0
    parts = 24
    angles = [i * math.pi / 2.0 / parts for i in range(parts + 1)]
    return Polyline.of(fork.place(radius * math.sin(a), side * radius * (1.0 - math.cos(a))) for a in angles)


_BENDS: Final[dict[Turn, float]] = {"left": LEFT_M, "right": RIGHT_M}


def through_m(turn: Turn) -> float:
    """Way through the junction."""
    return BOX_M if turn == "straight" else _BENDS[turn] * math.pi / 2.0


def street_of(config: StreetConfig) -> Street:
    """The street as it is described to planners at the start, without paths: what training draws without end."""
    ways: list[StreetWay] = []
    turns: tuple[Turn, ...] = ("straight",) if config.junction_m is None else config.ways
    marks: list[StreetMark] = []
    for turn in turns:
        bend = None if config.junction_m is None else (config.junction_m, config.junction_m + through_m(turn))
        kerb = LANE_M / 2.0 + KERB_STRIP_M / 2.0
        ways.append(StreetWay(turn, KNOWN_M, bend, _BENDS.get(turn) if bend else None, kerb))
        if bend is not None:
            marks.append(StreetMark("junction", (turn,), *bend))
    spans: list[tuple[MarkKind, Arm, float, float]] = [
        ("crosswalk", one.arm, one.at_m, CROSSWALK_M) for one in config.crosswalks
    ]
    for one in config.things:
        spans.append((one.kind, one.arm, one.at_m, _long(one.kind)))
    for kind, arm, at, long in spans:
        if arm == "here":
            marks.append(StreetMark(kind, turns, at, at + long))
        elif config.junction_m is not None and arm in turns:
            start = config.junction_m + through_m(arm) + at
            marks.append(StreetMark(kind, (arm,), start, start + long))
    near = sorted((one for one in marks if one.start_m < KNOWN_M - 5.0), key=lambda one: (one.start_m, one.kind))
    return Street(tuple(ways), tuple(near), config.speed_mps)


def _long(kind: ThingKind) -> float:
    return CONES_M if kind == "cones" else VEHICLE_M


def draw_street(rng: np.random.Generator) -> StreetConfig:
    """A street: with a junction or without, things and crosswalks where they do not stand in one another's way."""
    speed = 0.0 if rng.random() < 0.4 else float(rng.uniform(1.0, 4.0))
    things: list[Thing] = []
    crosswalks: list[Crosswalk] = []
    if rng.random() < 0.3:
        _furnish(rng, "here", (9.0, 42.0), 3, things, crosswalks)
        return StreetConfig(crosswalks=tuple(crosswalks), things=tuple(things), speed_mps=speed)
    junction = float(rng.uniform(8.0, 15.0)) if rng.random() < 0.75 else float(rng.uniform(15.0, 30.0))
    turns: tuple[Turn, ...] = ("left", "straight", "right")
    drawn: list[Turn] = [turn for turn in turns if rng.random() < 0.8]
    kept = tuple(drawn) or turns
    if junction > 15.0:
        _furnish(rng, "here", (9.0, junction - 2.0), 2, things, crosswalks)
    for turn in kept:
        _furnish(rng, turn, (8.0, 26.0), 2, things, crosswalks)
    return StreetConfig(
        junction_m=junction, ways=kept, crosswalks=tuple(crosswalks), things=tuple(things), speed_mps=speed
    )


def _furnish(
    rng: np.random.Generator,
    arm: Arm,
    span: tuple[float, float],
    most: int,
    things: list[Thing],
    crosswalks: list[Crosswalk],
) -> None:
    at = span[0] + float(rng.uniform(0.0, 6.0))
    kinds = ["crosswalk", "cones", "vehicle"]
    for i in rng.permutation(3)[: int(rng.integers(1, most + 1))]:
        kind = kinds[int(i)]
        long = CROSSWALK_M if kind == "crosswalk" else _long("cones" if kind == "cones" else "vehicle")
        if at + long > span[1]:
            return
        if kind == "crosswalk":
            crosswalks.append(Crosswalk(arm=arm, at_m=at))
        else:
            things.append(Thing(kind="cones" if kind == "cones" else "vehicle", arm=arm, at_m=at))
        at += long + float(rng.uniform(2.0, 11.0))
