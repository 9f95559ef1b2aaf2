"""A drive as instants, and the geometry that predicates ask it for."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final, NamedTuple

from chauffeur.concept import LaneId, Lead, Observation, PartResult, Setpoints, SignalState, VehicleState
from chauffeur.concept.sight import seen_from
from chauffeur.concept.utterance import Reference
from chauffeur.geometry import Pose, RoadGraph, named_ways, wrap_to_pi
from chauffeur.geometry.road_graph import turn_of

Referents = Mapping[Reference, tuple[int, ...]]
"""Ids of the road users that references mean, where a stage names them."""

PERIOD_S: Final = 0.1
"""Instants of a drive are looked at so often."""
HELD_S: Final = 2.5
"""How long everything has to be as asked, and how long a car stands that has stopped."""
STANDS_MPS: Final = 0.6
"""Slower is standing: the highway simulator's driver rocks about a standstill by one period's braking, 0.5 m/s."""
ON_PATH_M: Final = 2.0
"""A road user whose middle is so near to the car's path is on it."""
IN_LANE_M: Final = 0.6
"""The car is in a lane once its middle is this near the lane's."""
_NEAR_M: Final = 12.0
_SIGHT_M: Final = 80.0
_TOLD_TO_STAND_MPS: Final = 0.05


class Found(NamedTuple):
    """What became of an act, the instant at which that was clear, and what is missing, in words.

    `planned` tells that a number of the plan's decided, where the words have none.
    """

    result: PartResult
    end: int
    why: str = ""
    planned: bool = False


@dataclass(frozen=True, slots=True)
class DriveInstant:
    """What is kept of an instant of a drive.

    Attributes:
        time_s: Since the trip began.
        ego: The car.
        agents: Road users and things by id.
        lights: What each lane before a light was shown.
        setpoints: What the policy asked for.
        front: Who was ahead in the car's lane.
    """

    time_s: float
    ego: VehicleState
    agents: Mapping[int, VehicleState]
    lights: Mapping[LaneId, SignalState]
    setpoints: Setpoints
    front: Lead | None = None

    @property
    def told_to_stand(self) -> bool:
        """Whether the policy asked for a standstill: a car that waits at a light has not stopped there."""
        speed = self.setpoints.target_speed_mps
        return speed is not None and speed <= _TOLD_TO_STAND_MPS


@dataclass(slots=True)
class DriveTrace:
    """A drive as a sequence of instants.

    Attributes:
        road: Where it was driven.
        first: The observation in which the words were said.
        instants: Instants, in order.
    """

    road: RoadGraph
    first: Observation
    instants: list[DriveInstant] = field(default_factory=list[DriveInstant])

    def add(self, seen: Observation, setpoints: Setpoints) -> None:
        """Keep an instant."""
        lights: dict[LaneId, SignalState] = {lane: signal.state for signal in seen.signals for lane in signal.lanes}
        agents = {one.id: one for one in (*seen.others, *seen.objects)}
        self.instants.append(DriveInstant(seen.time_s, seen.ego, agents, lights, setpoints, seen.front))


@dataclass(frozen=True, slots=True)
class Passage:
    """A junction that the car drove through: first instant in it, first behind it, lane before it, way taken."""

    enters: int
    leaves: int
    before: LaneId
    way: str


class TracedDrive:
    """A drive as predicates look at it.

    Attributes:
        first: The observation in which the words were said.
        all: Instants, in order.
        road: Where it was driven.
        given: Whom references mean, where that is known.
        numbers: What the plan sets where words name no number: `target_speed_mps`, `gap_m`, `time_headway_s`.
    """

    def __init__(self, trace: DriveTrace, referents: Referents, numbers: Mapping[str, float]) -> None:
        self.first, self.all, self.road = trace.first, trace.instants, trace.road
        self.given, self.numbers = referents, numbers

    # Instants ---------------------------------------------------------------------------------------------------------

    def sees(self, i: int, number: int) -> tuple[float, float] | None:
        """(forward, leftward) of a road user in the car's frame, m; None where it is out of sight."""
        agent = self.all[i].agents.get(number)
        return None if agent is None else seen_from(self.all[i].ego, agent)

    def gap_m(self, i: int, number: int) -> float | None:
        """Along the car, between its end and that of a road user; negative where they overlap."""
        agent, seen = self.all[i].agents.get(number), self.sees(i, number)
        if agent is None or seen is None:
            return None
        return abs(seen[0]) - (self.all[i].ego.length_m + agent.length_m) / 2.0

    def is_behind(self, i: int, number: int) -> bool:
        """Whether a road user is behind the car, all of it."""
        seen, gap = self.sees(i, number), self.gap_m(i, number)
        return seen is not None and gap is not None and seen[0] < 0.0 < gap

    def moved(self, number: int, i: int) -> bool:
        """Whether a road user is not where it was first seen."""
        first = next((one.agents[number] for one in self.all if number in one.agents), None)
        now = self.all[i].agents.get(number)
        return first is not None and (now is None or math.hypot(now.x_m - first.x_m, now.y_m - first.y_m) > 1.0)

    def gone(self, number: int, i: int) -> bool:
        """Whether a road user has left the way ahead: it is on the other side, draws away, or is out of sight."""
        began = next((j for j, one in enumerate(self.all) if number in one.agents), None)
        agent, seen, gap = self.all[i].agents.get(number), self.sees(i, number), self.gap_m(i, number)
        if began is None or agent is None or seen is None or gap is None:
            return began is not None
        first = self.sees(began, number)
        assert first is not None
        if seen[0] > _SIGHT_M or (first[0] < 0.0 < seen[0] and gap > 0.0):
            return True
        if first[1] * seen[1] < 0.0 and abs(seen[1]) > ON_PATH_M:
            return True
        return self.is_behind(i, number) and agent.kind != "pedestrian"

    def limit_mps(self, i: int) -> float:
        """The speed limit of the lane that the car is in."""
        lane = self.road.get(self.all[i].ego.lane)
        return math.inf if lane is None else lane.speed_limit_mps

    def held(self, start: int, fits: Callable[[int], bool], *, last: bool = False) -> int | None:
        """The first instant at which something held for long enough; None where it never did.

        What is asked for last on a road without junctions has to hold on to the end.
        """
        trails = last and self.road.uninterrupted
        since = end = None
        for i in range(start, len(self.all)):
            if not fits(i):
                since = None
                end = None if trails else end
                continue
            since = i if since is None else since
            if end is None and self.all[i].time_s - self.all[since].time_s >= HELD_S - 1e-6:
                end = i
                if not trails:
                    return end
        return end

    # Stands -----------------------------------------------------------------------------------------------------------

    def stands(self, start: int) -> Sequence[tuple[int, int]]:
        """(first instant, instant at which it has stood for long enough) of each stand from an instant on."""
        found: list[tuple[int, int]] = []
        since = -1
        for i in range(start, len(self.all)):
            if self.all[i].ego.speed_mps >= STANDS_MPS:
                since = -1
                continue
            since = i if since < 0 else since
            long = self.all[i].time_s - self.all[since].time_s >= HELD_S - 1e-6
            told = self.all[i].told_to_stand or self.road.uninterrupted
            if long and told and (not found or found[-1][0] != since):
                found.append((since, i))
        return found

    def sets_off(self, i: int) -> bool:
        """Whether the car begins to drive at an instant."""
        return self.all[i].ego.speed_mps >= STANDS_MPS > self.all[i - 1].ego.speed_mps

    # Lanes ------------------------------------------------------------------------------------------------------------

    @cached_property
    def places(self) -> Sequence[int]:
        """Lanes changed to the right since the beginning, at each instant; a lane that goes on is the same place."""
        found = [0]
        for before, after in zip(self.all, self.all[1:], strict=False):
            a, b = before.ego.lane, after.ego.lane
            moved = None if a is None or b is None else self.road.places_between(a, b)
            if moved is None and self.road.uninterrupted:
                own, its = self.road.get(a), self.road.get(b)
                moved = None if own is None or its is None else its.index - own.index
            found.append(found[-1] + (moved or 0))
        return found

    def settled(self, i: int) -> bool:
        """Whether the car is in the middle of the lane that is its set-point, and not still on its way there; on roads
        without junctions only: elsewhere lanes bend."""
        if not self.road.uninterrupted:
            return True
        ego = self.all[i].ego
        lane, wanted = self.road.get(ego.lane), self.road.get(self.all[i].setpoints.target_lane)
        if lane is None or (wanted is not None and wanted.index != lane.index):
            return False
        return abs(lane.centre.project(ego.x_m, ego.y_m)[1]) <= IN_LANE_M

    def before_junction(self, i: int) -> bool:
        """Whether the car is just before a junction."""
        ego, lane = self.all[i].ego, self.road.get(self.all[i].ego.lane)
        if lane is None or lane.junction or not any(one.junction for one in self.road.successors(lane.id)):
            return False
        return lane.length_m - lane.centre.nearest(ego.x_m, ego.y_m) < _NEAR_M

    # Junctions --------------------------------------------------------------------------------------------------------

    @cached_property
    def passages(self) -> Sequence[Passage]:
        """Junctions that the car drove through, in order."""
        found: list[Passage] = []
        enters = -1
        for i, instant in enumerate(self.all):
            lane = self.road.get(instant.ego.lane)
            inside = lane is not None and bool(lane.junction)
            if inside and enters < 0 and i > 0:
                enters = i
            elif not inside and enters >= 0:
                before, behind = self.all[enters - 1].ego, instant.ego
                way = turn_of(wrap_to_pi(behind.heading_rad - before.heading_rad))
                found.append(Passage(enters, i, before.lane or "", way))
                enters = -1
        return found

    def ways(self, passage: Passage) -> frozenset[str]:
        """Names of the ways that were open to the car at a junction."""
        return frozenset(named_ways(self.road, passage.before) if passage.before in self.road else ())

    def turned(self, start: int, end: int | None = None) -> bool:
        """Whether the car turned at a junction up to an instant, or between two."""
        low, high = (-1, start) if end is None else (start, end)
        return any(one.way != "straight" and low < one.leaves <= high for one in self.passages)


def path_of(agent: VehicleState) -> list[tuple[float, float]]:
    """The way that a road user may be taken to have come, metre by metre, itself last."""
    here = Pose(agent.x_m, agent.y_m, agent.heading_rad)
    return [here.place(-float(back), 0.0) for back in range(60, -1, -1)]
