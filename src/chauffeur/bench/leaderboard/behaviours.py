"""The ten scenarios of Leaderboard 1.0 as small state machines on the stage of a world.

Distances and speeds are those of scenario_runner's branch leaderboard-1.0. Where its public code does next to nothing
(7, 8 and 9 switch lights, 10 waits), so does this. 2, 5 and 6 have no published triggers; they are here for triggers of
one's own.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Final, Protocol

import numpy as np

from chauffeur.bench.leaderboard.track import TURNS, RouteTrack
from chauffeur.bench.leaderboard.triggers import REACHED_M, Placed
from chauffeur.concept import Command, Observation, ScenarioError, SignalState
from chauffeur.geometry import Lane, LanePlace, Polyline, Pose, RoadGraph, joined, wrap_to_pi
from chauffeur.worlds.base import Stage

GIVE_UP_S: Final = 60.0
"""A scenario that is still running after so long is cleared away."""
CAR_WIDTH_M: Final = 2.0
_ONCOMING_RAD: Final = math.radians(150.0)
_FLOW_LANES: Final = 12
"""Lanes that are looked along for the way of oncoming cars: they are cut at every section and junction."""


class Behaviour(Protocol):
    """A scenario that was set off."""

    @property
    def done(self) -> bool:
        """True if it is over; its road users are gone by then."""
        ...

    @property
    def disturbance(self) -> Command | None:
        """Addition to the ego's command."""
        ...

    def update(self, observation: Observation) -> None:
        """Go on by a control period."""
        ...


@dataclass(frozen=True, slots=True)
class _Site:
    """Place at which a scenario is set off, and what it works with."""

    placed: Placed
    track: RouteTrack
    road: RoadGraph
    stage: Stage
    rng: np.random.Generator

    @property
    def name(self) -> str:
        return f"Scenario{self.placed.trigger.scenario}"

    @property
    def station_m(self) -> float:
        """Position of its trigger along the way."""
        return self.placed.station_m(self.track)

    def junction(self) -> int:
        """Index of the first point of the way inside a junction ahead. Raises ScenarioError: there is none."""
        found = self.track.next_junction(self.placed.index)
        if found is None:
            raise ScenarioError(f"{self.name} needs a junction ahead on the way.", hint="Check the trigger's place.")
        return found

    def lane_at(self, pose: Pose) -> Lane:
        """The driving lane at a pose. Raises ScenarioError: there is none."""
        place = self.road.locate(pose.x_m, pose.y_m, pose.heading_rad, ("driving",))
        if place is None or abs(place.offset_m) > 5.0:
            raise ScenarioError(
                f"{self.name} finds no lane at ({pose.x_m:.1f}, {pose.y_m:.1f}).", hint="Check the map."
            )
        return self.road[place.lane]


class _Running:
    """A scenario with a clock and its road users."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._began_s: float | None = None
        self._last_s: float | None = None
        self._actors: list[int] = []
        self.done = False
        self.disturbance: Command | None = None

    def _age_s(self, observation: Observation) -> float:
        if self._began_s is None:
            self._began_s = observation.time_s
        return observation.time_s - self._began_s

    def _step_s(self, observation: Observation) -> float:
        """Time since it was last asked for, s; 0 at the first time."""
        step = 0.0 if self._last_s is None else observation.time_s - self._last_s
        self._last_s = observation.time_s
        return step

    def _end(self) -> None:
        for actor in self._actors:
            self._stage.remove(actor)
        self._actors = []
        self.done = True


class ControlLoss(_Running):
    """1: from 12 m after the trigger, for 30 m or until 10 m before a junction, the command is disturbed.

    Steering noise of CARLA's mean 0.001 and deviation 0.01 of full lock, and 0.045 of full throttle more.
    """

    AFTER_M: Final = 12.0
    LENGTH_M: Final = 30.0
    JUNCTION_M: Final = 10.0
    MEAN: Final = 0.001
    DEVIATION: Final = 0.01
    THROTTLE: Final = 0.045
    LOCK_RAD: Final = math.radians(70.0)
    FULL_THROTTLE_MPS2: Final = 4.0

    def __init__(self, site: _Site) -> None:
        super().__init__(site.stage)
        self._rng = site.rng
        stations = site.track.stations_m
        start = site.station_m + self.AFTER_M
        index = site.track.next_junction(bisect_left(stations, start))
        junction = math.inf if index is None else stations[index]
        self._length_m = max(0.0, min(self.LENGTH_M, junction - self.JUNCTION_M - start))
        self._driven_m = 0.0
        self._last: tuple[float, float] | None = None

    def update(self, observation: Observation) -> None:
        here = observation.ego.x_m, observation.ego.y_m
        self._driven_m += 0.0 if self._last is None else math.dist(here, self._last)
        self._last = here
        active = self.AFTER_M <= self._driven_m < self.AFTER_M + self._length_m
        if active:
            steering = float(self._rng.normal(self.MEAN, self.DEVIATION)) * self.LOCK_RAD
            self.disturbance = Command(self.THROTTLE * self.FULL_THROTTLE_MPS2, steering)
        elif self._driven_m >= self.AFTER_M + self._length_m or self._age_s(observation) > GIVE_UP_S:
            self.disturbance = None
            self._end()


class CrossingBehaviour(_Running):
    """3 and 4: somebody crosses the ego's way from the right, seen late.

    Waits beside the road until the ego is within `starts_m` of where the ways cross, then crosses at a steady speed and
    is gone on the other side.
    """

    def __init__(
        self,
        stage: Stage,
        at: Pose,
        kind: str,
        from_right_m: float,
        to_left_m: float,
        starts_m: float,
        speed_mps: float,
    ) -> None:
        super().__init__(stage)
        self._at = at
        self._offset = -from_right_m
        self._to_left_m = to_left_m
        self._starts_m = starts_m
        self._speed = speed_mps
        self._started = False
        actor = stage.spawn("pedestrian" if kind == "pedestrian" else "bicycle", self._pose())
        self._actors = [actor]

    def add(self, actor: int) -> None:
        """Somebody else who is cleared away with it."""
        self._actors.append(actor)

    def update(self, observation: Observation) -> None:
        ego = observation.ego
        if self._age_s(observation) > GIVE_UP_S:
            self._end()
            return
        if not self._started:
            away = math.hypot(ego.x_m - self._at.x_m, ego.y_m - self._at.y_m)
            self._started = away <= self._starts_m + ego.length_m / 2.0
            self._step_s(observation)
            self._stage.drive(self._actors[0], self._pose(), 0.0)
            return
        self._offset += self._speed * self._step_s(observation)
        if self._offset >= self._to_left_m:
            self._end()
            return
        self._stage.drive(self._actors[0], self._pose(), self._speed)

    def _pose(self) -> Pose:
        x, y = self._at.place(0.0, self._offset)
        return Pose(x, y, self._at.heading_rad + math.pi / 2.0)


class Leading(_Running):
    """2 and 5: cars ahead that drive on along the way and then brake to a stand for a while."""

    BRAKING_MPS2: Final = 4.0
    STANDS_S: Final = 5.0

    def __init__(
        self, stage: Stage, track: RouteTrack, start_m: float, speeds: Mapping[float, float], brakes_after_m: float
    ) -> None:
        """`speeds`: of each car, by its distance ahead of the trigger, m."""
        super().__init__(stage)
        self._track = track
        self._stations = [start_m + ahead for ahead in speeds]
        self._wished = list(speeds.values())
        self._speeds = list(speeds.values())
        self._brakes_at = [station + brakes_after_m for station in self._stations]
        self._stood_s = 0.0
        for station, speed in zip(self._stations, self._speeds, strict=True):
            self._actors.append(stage.spawn("car", track.at(station), speed))

    def update(self, observation: Observation) -> None:
        step = self._step_s(observation)
        if self._age_s(observation) > GIVE_UP_S or max(self._stations) > self._track.length_m - 5.0:
            self._end()
            return
        for i, actor in enumerate(self._actors):
            braking = self._stations[i] > self._brakes_at[i] and self._stood_s < self.STANDS_S
            if braking:
                self._speeds[i] = max(0.0, self._speeds[i] - self.BRAKING_MPS2 * step)
                self._stood_s += step if self._speeds[i] <= 0.0 else 0.0
            else:
                self._speeds[i] = min(self._wished[i], self._speeds[i] + 2.0 * step)
            self._stations[i] += self._speeds[i] * step
            self._stage.drive(actor, self._track.at(self._stations[i]), self._speeds[i])


class Obstacle(_Running):
    """6: something stands in the lane 50 m ahead, and cars come the other way, 40 m apart.

    It is all cleared away when the ego has passed it, or after a minute. Who comes waits for an ego in the way.
    """

    AHEAD_M: Final = 50.0
    BEYOND_M: Final = 15.0
    SOURCE_M: Final = 60.0
    """Distance beyond the obstacle at which the oncoming cars begin."""
    FLOW_M: Final = 200.0
    FLOW_MPS: Final = 5.56
    GAP_M: Final = 40.0
    WAITS_M: Final = 6.0

    def __init__(self, stage: Stage, at: Pose, oncoming: Polyline) -> None:
        """`oncoming`: the way of those who come, from where they begin on."""
        super().__init__(stage)
        self._at = at
        self._oncoming = oncoming
        self._flow: dict[int, float] = {}
        self._actors = [stage.spawn("static", at)]

    def update(self, observation: Observation) -> None:
        passed = self._at.sees(observation.ego.x_m, observation.ego.y_m)[0] > self.BEYOND_M
        if passed or self._age_s(observation) > GIVE_UP_S:
            self._actors += self._flow
            self._end()
            return
        step = self._step_s(observation)
        way, ego = self._oncoming, observation.ego
        at, aside = way.project(ego.x_m, ego.y_m)
        in_the_way = abs(aside) < (ego.width_m + CAR_WIDTH_M) / 2.0
        for actor, station in self._flow.items():
            waits = in_the_way and 0.0 < at - station < ego.length_m + self.WAITS_M
            speed = 0.0 if waits else self.FLOW_MPS
            self._flow[actor] = station + speed * step
            self._stage.drive(actor, way.at(self._flow[actor]), speed)
        for actor in [one for one, station in self._flow.items() if station > way.length_m]:
            del self._flow[actor]
            self._stage.remove(actor)
        if min(self._flow.values(), default=self.GAP_M) >= self.GAP_M:
            self._flow[self._stage.spawn("car", way.at(0.0), self.FLOW_MPS)] = 0.0


class Lights(_Running):
    """7, 8 and 9: within 10 m of a green light all lights of the junction turn red, then the ego's and one other green.

    Yellow for 2 s, red for 1.5 s, then green for the ego and the traffic that crosses its way, for 6 s. A light that is
    red already is left as it is.
    """

    NEAR_M: Final = 10.0
    YELLOW_S: Final = 2.0
    RED_S: Final = 1.5
    RESET_S: Final = 6.0

    def __init__(self, stage: Stage, road: RoadGraph, lane: str, others: frozenset[str]) -> None:
        """`lane`: the ego's before the junction; `others`: lanes before it whose traffic meets the ego."""
        super().__init__(stage)
        self._road = road
        self._lane = lane
        self._others = others
        self._since_s: float | None = None
        self._own: tuple[str, ...] = ()
        self._meeting: tuple[str, ...] = ()
        self._junction: tuple[str, ...] = ()

    def update(self, observation: Observation) -> None:
        now_s = observation.time_s
        if self._since_s is None:
            self._wait(observation)
            return
        age = now_s - self._since_s
        if age < self.YELLOW_S:
            return
        if age < self.YELLOW_S + self.RED_S:
            self._force(self._junction, "red")
        elif age < self.YELLOW_S + self.RED_S + self.RESET_S:
            self._force((*self._own, *self._meeting), "green")
        else:
            self._force(self._junction, None)
            self._end()

    def _wait(self, observation: Observation) -> None:
        ego = observation.ego
        if self._age_s(observation) > GIVE_UP_S:
            self._end()
            return
        for signal in observation.signals:
            if self._lane not in signal.lanes:
                continue
            (ax, ay), (bx, by) = signal.stop_line_m
            near = math.hypot((ax + bx) / 2.0 - ego.x_m, (ay + by) / 2.0 - ego.y_m) <= self.NEAR_M
            if not near or signal.state != "green":
                return
            junction = _junction_after(self._road, self._lane)
            of_junction = [
                one for one in observation.signals if any(_junction_after(self._road, x) == junction for x in one.lanes)
            ]
            self._junction = tuple(one.id for one in of_junction)
            self._own = tuple(one.id for one in of_junction if self._lane in one.lanes)
            self._meeting = tuple(one.id for one in of_junction if self._others & set(one.lanes))
            self._since_s = observation.time_s
            self._force(self._own, "yellow")
            return

    def _force(self, signals: tuple[str, ...], state: SignalState | None) -> None:
        for signal in signals:
            self._stage.force_signal(signal, state)


class Nothing(_Running):
    """10: the traffic of the junction is what there is to negotiate with."""

    def update(self, observation: Observation) -> None:
        del observation
        self._end()


def set_off(placed: Placed, track: RouteTrack, road: RoadGraph, stage: Stage, rng: np.random.Generator) -> Behaviour:
    """Set off a scenario.

    Raises:
        ScenarioError: It cannot be placed: the way or the road does not have what it needs.
    """
    return _MAKERS[placed.trigger.scenario](_Site(placed, track, road, stage, rng))


def reached(placed: Placed, observation: Observation) -> bool:
    """True if the ego sets off a scenario."""
    pose, ego = placed.trigger.pose, observation.ego
    return math.hypot(pose.x_m - ego.x_m, pose.y_m - ego.y_m) < REACHED_M


SWITCHES_LIGHTS: Final = (7, 8, 9)
"""Scenarios that take a junction's lights in hand."""


def _jaywalker(site: _Site) -> Behaviour:
    """12 m ahead on the right, behind a machine, at 3 m/s and 0.4 m/s more for each lane to its right."""
    at = site.track.at(site.station_m + 12.0)
    lane = site.lane_at(at)
    right, left = _edges(site.road, lane, at)
    lanes = max(0, round((right - lane.width_m / 2.0) / lane.width_m))
    kind = "pedestrian" if site.rng.random() < 0.5 else "bicycle"
    crossing = CrossingBehaviour(site.stage, at, kind, right + 1.0, left + 1.0, 12.0 + lanes, 3.0 + 0.4 * lanes)
    x, y = at.place(-1.5, -(right + 1.0))
    crossing.add(site.stage.spawn("static", Pose(x, y, at.heading_rad)))
    return crossing


def _after_turn(site: _Site) -> Behaviour:
    """A bicycle crosses 8 m behind the junction that the ego turns at, at 10 m/s."""
    last, options = site.junction(), site.track.options
    while last + 1 < len(options) and options[last + 1] in TURNS:
        last += 1
    at = site.track.at(site.track.stations_m[last] + 8.0)
    lane = site.lane_at(at)
    right, left = _edges(site.road, lane, at)
    return CrossingBehaviour(site.stage, at, "bicycle", right + 1.0, left + 1.0, 13.0 + lane.width_m, 10.0)


def _lead(site: _Site) -> Behaviour:
    """A car 25 m ahead at 10 m/s brakes."""
    return Leading(site.stage, site.track, site.station_m, {25.0: 10.0}, float(site.rng.uniform(30.0, 60.0)))


def _leads(site: _Site) -> Behaviour:
    """Two cars from 35 m ahead, at 55 km/h and 45 km/h; the second brakes."""
    speeds = {35.0: 45.0 / 3.6, 60.0: 55.0 / 3.6}
    return Leading(site.stage, site.track, site.station_m, speeds, float(site.rng.uniform(40.0, 80.0)))


def _obstacle(site: _Site) -> Behaviour:
    track, station = site.track, site.station_m + Obstacle.AHEAD_M
    if station > track.length_m - 10.0:
        raise ScenarioError("Scenario6 needs 60 m of way ahead.", hint="Check the trigger's place.")
    return Obstacle(site.stage, track.at(station), _oncoming(site.road, track.at(station + Obstacle.SOURCE_M)))


def _oncoming(road: RoadGraph, at: Pose) -> Polyline:
    """The way of those who come towards a pose, in the nearest lane to its left that leads the other way."""
    for aside in np.arange(2.0, 12.0, 0.5).tolist():
        place = road.locate(*at.place(0.0, aside), at.heading_rad + math.pi, ("driving",))
        if place is None or abs(place.offset_m) > road[place.lane].width_m / 2.0:
            continue
        if abs(wrap_to_pi(road[place.lane].centre.at(place.station_m).heading_rad - at.heading_rad)) > _ONCOMING_RAD:
            line = joined([lane.centre for lane in islice(road.ahead(place.lane), _FLOW_LANES)])
            return line.between(place.station_m, min(line.length_m, place.station_m + Obstacle.FLOW_M))
    raise ScenarioError("Scenario6 needs a lane whose traffic comes the other way.", hint="Check the trigger's place.")


def _lights(site: _Site) -> Behaviour:
    road, poses, first = site.road, site.track.poses, site.junction()
    if first == 0:
        raise ScenarioError(f"{site.name} needs a way before the junction.", hint="Check the trigger's place.")
    own = site.lane_at(poses[first - 1])
    if own.junction:
        before = road.predecessors(own.id)
        own = before[0] if before else own
    crossing = site.lane_at(poses[min(first + 1, len(poses) - 1)])
    others = frozenset(before.id for lane in road.conflicts(crossing.id) for before in road.predecessors(lane))
    return Lights(site.stage, road, own.id, others - {own.id})


_MAKERS: Final[Mapping[int, Callable[[_Site], Behaviour]]] = {
    1: ControlLoss,
    2: _lead,
    3: _jaywalker,
    4: _after_turn,
    5: _leads,
    6: _obstacle,
    7: _lights,
    8: _lights,
    9: _lights,
    10: lambda site: Nothing(site.stage),
}


def _edges(road: RoadGraph, lane: Lane, at: Pose) -> tuple[float, float]:
    """Distances to the edge of the roadway, right and left of a pose on a lane, m.

    To the left the lanes of the other direction belong to it, as far as they lie right beside.
    """
    beside = road.abreast(lane.id)
    right = lane.width_m / 2.0 + sum(one.width_m for one in beside if one.index > lane.index)
    left = lane.width_m / 2.0 + sum(one.width_m for one in beside if one.index < lane.index)
    while left < 25.0:
        place: LanePlace | None = road.locate(*at.place(0.0, left + 1.5), kinds=("driving",))
        if place is None or abs(place.offset_m) > 1.8:
            break
        other = road[place.lane]
        if abs(wrap_to_pi(other.centre.at(place.station_m).heading_rad - at.heading_rad)) < math.pi / 2.0:
            break
        left += other.width_m
    return right, left


def _junction_after(road: RoadGraph, lane: str) -> str:
    """Name of the junction that a lane leads into."""
    own = road.get(lane)
    return "" if own is None else next((one.junction for one in road.successors(lane) if one.junction), own.junction)
