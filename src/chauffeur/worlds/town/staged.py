"""Road users that a scenario puts before the ego: parked, walking over the road, or driving on in SUMO's traffic.

Places are told along the ego's own lane and what follows it straight on, so that a scene stays the same scene wherever
in a town it begins.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from chauffeur.concept import AgentKind
from chauffeur.concept.utterance import Colour
from chauffeur.geometry import LaneId, LanePlace, Polyline, Pose, RoadGraph, Turn, joined

StagedKind = Literal["car", "van", "truck", "bus", "motorcycle", "bicycle", "pedestrian", "static", "obstacle"]
_HEADINGS: Final = {"along": 0.0, "against": math.pi, "left": math.pi / 2.0, "right": -math.pi / 2.0}
_WAY_M: Final = 900.0


class StagedActor(BaseModel):
    """One road user or thing of a scene.

    Attributes:
        kind: What it is.
        colour: Of it; drawn where none is given.
        ahead_m: Of its middle, along the lane from beside the middle of the ego; negative behind it.
        left_m: Of its middle, to the left of the middle of that lane.
        way: The turns that lead to it, where it is round a corner; straight on by default.
        heading: Which way it faces: along the lane, against it, or over it to the left or right.
        speed_mps: Of its move; 0 for one that stays.
        after_s: When it sets off.
        near_m: It does not set off before the ego is so near.
        for_m: How far it moves, then stands.
        drives: Whether it drives on as SUMO's traffic does, by lights and signs, in place of that move.
        turns: Where such a one goes at the junctions that it comes to; straight on after them.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    kind: StagedKind
    colour: Colour | None = None
    ahead_m: float = Field(ge=-80.0, le=300.0)
    left_m: float = Field(default=0.0, ge=-30.0, le=30.0)
    way: tuple[Turn, ...] = ()
    heading: Literal["along", "against", "left", "right"] = "along"
    speed_mps: float = Field(default=0.0, ge=0.0, le=30.0)
    after_s: float = Field(default=0.0, ge=0.0)
    near_m: float = Field(default=math.inf, ge=0.0)
    for_m: float = Field(default=math.inf, ge=0.0)
    drives: bool = False
    turns: tuple[Turn, ...] = ()

    @property
    def at_once(self) -> bool:
        """True if it moves from the beginning."""
        return self.after_s <= 0.0 and math.isinf(self.near_m)

    @property
    def agent_kind(self) -> AgentKind:
        """Kind in observations: a van is a large car."""
        return "car" if self.kind == "van" else self.kind


def lanes_onward(road: RoadGraph, lane: LaneId, turns: Sequence[Turn] = (), way_m: float = _WAY_M) -> list[LaneId]:
    """A lane and those that follow it, by a turn at each junction with a choice, straight on after them."""
    found, left, length = [lane], list(turns), road[lane].length_m
    while length < way_m and road[found[-1]].successors:
        here = road[found[-1]]
        chooses = not here.junction and len({one.turn for one in road.successors(here.id)}) > 1
        onward = road.onward(here.id, left.pop(0) if chooses and left else None)
        assert onward is not None
        if onward.id in found:
            break
        found.append(onward.id)
        length += onward.length_m
    return found


@dataclass(slots=True)
class _Moving:
    actor: StagedActor
    number: int
    pose: Pose
    moved_m: float = 0.0


class Staged:
    """Moves the road users of a scene that SUMO does not drive."""

    def __init__(self, road: RoadGraph, start: LanePlace, drive: Callable[[int, Pose, float], None]) -> None:
        """Args: the road, where the ego begins, and how one of the stage is moved."""
        self._road, self._start = road, start
        self._drive = drive
        self._lines: dict[tuple[Turn, ...], tuple[Polyline, float]] = {}
        self._moving: list[_Moving] = []

    def _line(self, way: tuple[Turn, ...]) -> tuple[Polyline, float]:
        """(the middle of the lanes along some turns, the station at which the ego begins)."""
        if way not in self._lines:
            road, own = self._road, self._start.lane
            lanes = [road[lane].centre for lane in lanes_onward(road, own, way)]
            before = min(road.predecessors(own), key=lambda one: (abs(one.bend_rad), one.id), default=None)
            back = [] if before is None else [before.centre]
            zero = sum(one.length_m for one in back) + self._start.station_m
            self._lines[way] = joined([*back, *lanes]), zero
        return self._lines[way]

    def pose_of(self, actor: StagedActor) -> Pose:
        """Start pose of an actor."""
        line, zero = self._line(actor.way)
        at = line.at(min(max(0.0, zero + actor.ahead_m), line.length_m))
        x, y = at.place(0.0, actor.left_m)
        return Pose(x, y, at.heading_rad + _HEADINGS[actor.heading])

    def add(self, actor: StagedActor, number: int) -> None:
        """Take charge of one that was put on the road."""
        if actor.speed_mps > 0.0:
            self._moving.append(_Moving(actor, number, self.pose_of(actor)))

    def step(self, time_s: float, dt_s: float, ego: Pose) -> None:
        """Move them all on by a control period."""
        for one in self._moving:
            actor = one.actor
            near = math.hypot(one.pose.x_m - ego.x_m, one.pose.y_m - ego.y_m) <= actor.near_m
            if not one.moved_m and (time_s < actor.after_s or not near):
                continue
            way = min(actor.speed_mps * dt_s, max(0.0, actor.for_m - one.moved_m))
            one.moved_m += way
            one.pose = one.pose.ahead(way)
            self._drive(one.number, one.pose, actor.speed_mps if way else 0.0)
