"""A town: SUMO's traffic round an ego that is moved by a bicycle model of its own, at 20 Hz.

The ego's way is told to SUMO, so that its traffic yields to the ego; lights run the cycles of the map pack; people on
foot, and what a scenario puts on the road, are seen by the traffic as small vehicles. Contacts are overlaps of boxes.
All chance comes from one seed: the same scenario and seed give the same trip to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from chauffeur.concept import (
    AgentKind,
    Command,
    DataError,
    Lead,
    Observation,
    Scenario,
    ScenarioError,
    Signal,
    SignalState,
    VehicleState,
)
from chauffeur.control.kinematic_bicycle import LINCOLN_MKZ, BicycleState, advanced
from chauffeur.geometry import LaneId, LanePlace, Pose, Route, overlap, plan_route
from chauffeur.worlds.base import EGO
from chauffeur.worlds.parking.path_follower import Chassis
from chauffeur.worlds.town import pack as packs
from chauffeur.worlds.town.brakes import TrafficBrakes
from chauffeur.worlds.town.driver import TOWN_CAPABILITIES, TownDriver
from chauffeur.worlds.town.pack import MapPack, SignalGroup, places_called
from chauffeur.worlds.town.people import People
from chauffeur.worlds.town.perception import TownPerception
from chauffeur.worlds.town.sumo import EGO_NAME, MAKES, Link, Mover, Sumo, engine_name
from chauffeur.worlds.town.traffic import Traffic

DT_S: Final = 0.05
SEES_M: Final = 100.0
"""Who is farther away is not shown."""
TOUCHES_M: Final = 60.0
FIRST_WALKER: Final = 10_001
FIRST_ACTOR: Final = 20_001
_SIZES: Final[Mapping[AgentKind, tuple[float, float]]] = {
    "car": (4.6, 1.85),
    "truck": (8.0, 2.4),
    "bus": (9.5, 2.5),
    "motorcycle": (2.2, 0.9),
    "bicycle": (1.8, 0.65),
    "pedestrian": (0.6, 0.6),
    "static": (1.0, 1.0),
    "obstacle": (2.0, 2.0),
}
_ON_ROAD_M: Final = 0.4
_OFF_ROAD_M: Final = 1.0
_NEAR_LANE_M: Final = 3.0
_AMID_M: Final = 0.5


class TownConfig(BaseModel):
    """A trip in a town.

    Attributes:
        town: Name of a map pack, or the folder of one.
        start: Where the ego begins: lane and station, or (x, y, heading); by default somewhere, as the seed says.
        goal: Name of a place, or (x, y); by default there is none.
        lanes: The route itself, lane by lane; `start` and `goal_m` are then stations on its first and last lane.
        start_m, goal_m: Of `lanes`.
        vehicles: In the traffic; fewer where the town is full.
        people: On foot.
        ego_speed: At the start, m/s.
        duration_s: Time limit.
        contact_ends: Whether a collision ends the trip; a benchmark may count it and go on.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    town: str
    start: tuple[str, float] | tuple[float, float, float] | None = None
    goal: str | tuple[float, float] | None = None
    lanes: tuple[str, ...] = ()
    start_m: float = 0.0
    goal_m: float | None = None
    vehicles: int = Field(default=60, ge=0, le=400)
    people: int = Field(default=20, ge=0, le=200)
    ego_speed: float = Field(default=0.0, ge=0.0, le=30.0)
    duration_s: float = Field(default=600.0, gt=0.0, le=36_000.0)
    contact_ends: bool = True


@dataclass(slots=True)
class _Actor:
    """What a scenario put on the road."""

    id: int
    kind: AgentKind
    pose: Pose
    speed_mps: float
    length_m: float
    width_m: float


class TownWorld:
    """A town, stepped at 20 Hz. One a process at a time: the one reset last drives, and the others say so."""

    capabilities = TOWN_CAPABILITIES

    def __init__(self, town: MapPack | None = None) -> None:
        """Args: the town to drive in, whatever scenarios say; by default they do."""
        self._given = town
        self._town: MapPack | None = None
        self._config: TownConfig | None = None
        self._sumo: Sumo | None = None
        self._state = BicycleState(Pose(0.0, 0.0, 0.0), 0.0)

    @property
    def engine(self) -> str:
        """SUMO and its version. Its figures are no CARLA driving scores."""
        return engine_name()

    @property
    def dt_s(self) -> float:
        """Control period, s."""
        return DT_S

    @property
    def chassis(self) -> Chassis:
        """The ego's size, axles and bounds."""
        return Chassis.of(LINCOLN_MKZ)

    @property
    def town(self) -> MapPack:
        """Where it is driven. Raises ScenarioError before the first reset."""
        if self._town is None:
            raise ScenarioError("The world has no scenario yet.", hint="Call reset(scenario) first.")
        return self._town

    def reset(self, scenario: Scenario, seed: int | None = None) -> Observation:
        """Set up a town, its traffic and the ego.

        Raises:
            ScenarioError: The configuration is malformed, a place or way does not exist, or SUMO cannot run.
            MissingExtraError: SUMO is not installed.
        """
        config = _parse(scenario)
        town = self._given or self._load(config.town)
        if town.sumo is None:
            raise ScenarioError(
                f"The map pack {town.name!r} has no SUMO network.", hint="Build it again: chauffeur maps build."
            )
        drawn = np.random.SeedSequence(scenario.seed if seed is None else seed)
        rng = np.random.Generator(np.random.PCG64(drawn))
        self._town, self._config = town, config
        self._net = town.sumo
        self.close()
        self._sumo = Sumo(town.sumo.path, DT_S, int(drawn.generate_state(1)[0]))
        self._brakes = TrafficBrakes(self._sumo, DT_S)
        start, route = self._start(config, rng)
        pose = town.road[start.lane].centre.at(start.station_m)
        rear = pose.ahead(-LINCOLN_MKZ.rear_to_middle_m)
        self._state = BicycleState(rear, config.ego_speed)
        self._lane: LaneId | None = start.lane
        self._offset_m = 0.0
        self._tick, self._touched = 0, frozenset[int]()
        self._crashed = False
        self._ids: dict[str, int] = {}
        self._lane_places: dict[str, tuple[tuple[str, float, float], LaneId | None]] = {}
        self._actors: dict[int, _Actor] = {}
        self._next_actor = FIRST_ACTOR
        self._forced: dict[str, SignalState] = {}
        self._links = self._sumo.links()
        self._link_lanes = _ruled(town, self._links)
        self._phases: list[int] = []
        self._lights_until_s = 0.0
        self._states: dict[str, SignalState] = {}
        self._lane_lights: dict[LaneId, SignalState] = {}
        self._places = [_middle(group) for group in town.signals]
        self._shown: Observation | None = None
        self._in_traffic: dict[int, str] = {}
        self._puppets = 0
        self._told: tuple[str, ...] = ()
        self._others: tuple[VehicleState, ...] = ()
        self._lead: Lead | None = None
        self._people = People(town.road, town.crossings, config.people, FIRST_WALKER, rng)
        self._route = route
        self._mind_lights()
        self._driver: TownDriver | None = None
        self._driver = TownDriver(town.road, LINCOLN_MKZ, DT_S, self.observe, route)
        self._perception = TownPerception(town.road, self.observe, self._driver, town.places)
        way = self._edges_ahead() or [self._edge_of(start.lane)]
        self._sumo.place(EGO_NAME, LINCOLN_MKZ.length_m, LINCOLN_MKZ.width_m, way, SEES_M)
        self._mind_lights()
        self._tell_traffic(first=True)
        self._sumo.step()
        self._traffic = Traffic(self._sumo, config.vehicles, rng)
        self._tell_traffic()
        self._sumo.step()
        self._look_round()
        return self.observe()

    def close(self) -> None:
        """End the simulation, if this world still has it."""
        if self._sumo is not None:
            self._sumo.close()

    def step(self, command: Command) -> Command:
        """Advance 50 ms under `command`; returns what the vehicle really applied.

        Raises:
            ScenarioError: Another town was set up in this process since.
        """
        if not (math.isfinite(command.acceleration_mps2) and math.isfinite(command.steering_rad)):
            raise ValueError(f"A command must be finite numbers, not {command}.")
        assert self._sumo is not None, "reset first"
        asked = -LINCOLN_MKZ.most_braking_mps2 if self._stopped else command.acceleration_mps2
        before = self._state
        self._state = advanced(before, asked, command.steering_rad, DT_S, LINCOLN_MKZ)
        self._tick += 1
        self._locate()
        self._people.step(DT_S, self._lane_lights, self._road_users())
        self._mind_lights()
        self._tell_traffic()
        self._sumo.step()
        self._traffic.mind()
        self._look_round()
        return Command(self._state.acceleration_mps2, self._state.steering_rad)

    def observe(self) -> Observation:
        """The present instant as frozen values."""
        if self._shown is None:
            self._shown = self._look()
        return self._shown

    @property
    def ended(self) -> bool:
        """Crash, off the road, at the goal, or out of time."""
        return self.observe().ended

    def perception(self) -> TownPerception:
        """Questions about the present instant."""
        assert self.town is not None
        return self._perception

    def driver(self) -> TownDriver:
        """The low-level driver of the present trip; the same until the next reset."""
        assert self.town is not None
        assert self._driver is not None
        return self._driver

    def head_for(self, place: str) -> None:
        """Set out for a place of the town from where the ego is. Raises ScenarioError: no such place, no way there."""
        assert self._driver is not None
        self._route = self._way_to(place)
        self._driver.head_for(self._route)
        self._shown = None

    @property
    def mean_traffic_mps(self) -> float:
        """Mean speed of the traffic at this instant."""
        assert self._sumo is not None
        return self._sumo.mean_speed_mps()

    @property
    def vehicles(self) -> int:
        """How many vehicles the traffic has."""
        return self._traffic.count

    @property
    def arrived(self) -> bool:
        """Whether the ego is at its goal."""
        driver = self._driver
        if driver is None or self._route is None or not driver.stretch.goal:
            return False
        return driver.station_m + LINCOLN_MKZ.rear_to_middle_m > driver.stretch.end_m - 3.0

    # The stage of a scenario ------------------------------------------------------------------------------------------

    def spawn(self, kind: AgentKind, pose: Pose, speed_mps: float = 0.0) -> int:
        """Put somebody or something on the road, its middle at a pose; returns its id. Raises ScenarioError."""
        if kind not in _SIZES:
            raise ScenarioError(f"A town has no road user of the kind {kind!r}.", hint=f"Say {', '.join(_SIZES)}.")
        number, self._next_actor = self._next_actor, self._next_actor + 1
        self._actors[number] = _Actor(number, kind, pose, speed_mps, *_SIZES[kind])
        self._look_round()
        return number

    def drive(self, actor: int, pose: Pose, speed_mps: float) -> None:
        """Have what was put on the road at a pose, with a speed, from the next period on. Raises KeyError."""
        one = self._actors[actor]
        one.pose, one.speed_mps = pose, speed_mps

    def remove(self, actor: int) -> None:
        """Take away what was put on the road; nothing happens where it is gone already."""
        if self._actors.pop(actor, None) is not None:
            self._hide(actor)
            self._look_round()

    def force_signal(self, signal: str, state: SignalState | None) -> None:
        """Have a light show something, or its own cycle again. Raises KeyError for a light that is not there."""
        if signal not in self._states:
            raise KeyError(signal)
        if state is None:
            self._forced.pop(signal, None)
        else:
            self._forced[signal] = state
        self._phases = []
        self._mind_lights()
        self._shown = None

    # Setting up -------------------------------------------------------------------------------------------------------

    def _load(self, name: str) -> MapPack:
        try:
            return packs.load(name)
        except DataError as error:
            raise ScenarioError(str(error), hint=error.hint) from error

    def _start(self, config: TownConfig, rng: np.random.Generator) -> tuple[LanePlace, Route | None]:
        road = self.town.road
        if config.lanes:
            unknown = [lane for lane in config.lanes if lane not in road]
            if unknown:
                raise ScenarioError(f"{self.town.name} has no lane {unknown[0]!r}, which the route names.")
            end = road[config.lanes[-1]].length_m
            goal = end if config.goal_m is None else min(config.goal_m, end)
            return LanePlace(config.lanes[0], config.start_m, 0.0), Route(config.lanes, config.start_m, goal)
        start = self._somewhere(rng) if config.start is None else self._place(config.start)
        if config.goal is None:
            return start, None
        goal = self._goal(config.goal)
        route = plan_route(road, start, goal)
        if route is None:
            raise ScenarioError(f"No way leads to {config.goal!r} from here.", hint="Choose another goal.")
        return start, route

    def _way_to(self, place: str) -> Route:
        assert self._lane is not None
        start = LanePlace(self._lane, self._ego_station, 0.0)
        route = plan_route(self.town.road, start, self._goal(place))
        if route is None:
            raise ScenarioError(f"No way leads to {place!r} from here.", hint="Choose another place.")
        return route

    def _place(self, start: tuple[Any, ...]) -> LanePlace:
        road = self.town.road
        if isinstance(start[0], str):
            if start[0] not in road:
                raise ScenarioError(f"{self.town.name} has no lane {start[0]!r}.")
            return LanePlace(start[0], float(start[1]), 0.0)
        x, y, heading = (float(value) for value in start)
        place = road.locate(x, y, heading, ("driving",))
        if place is None:
            raise ScenarioError(f"{self.town.name} has no lane at ({x}, {y}).")
        return place

    def _goal(self, goal: str | tuple[float, float]) -> LanePlace:
        if isinstance(goal, str):
            found = place_named(self.town, goal)
            return LanePlace(found.lane, found.station_m, 0.0)
        place = self.town.road.locate(*goal, None, ("driving",))
        if place is None:
            raise ScenarioError(f"{self.town.name} has no lane at {goal}.")
        return place

    def _somewhere(self, rng: np.random.Generator) -> LanePlace:
        lanes = [
            one
            for one in self.town.road.lanes
            if one.kind == "driving" and not one.junction and one.length_m > 20.0 and one.successors
        ]
        if not lanes:
            raise ScenarioError(f"{self.town.name} has no lane to start on.")
        lane = lanes[int(rng.integers(len(lanes)))]
        return LanePlace(lane.id, lane.length_m / 2.0, 0.0)

    # Telling SUMO -----------------------------------------------------------------------------------------------------

    def _edge_of(self, lane: LaneId) -> str:
        names = self._net.lanes.get(lane, ())
        return names[0].rpartition("_")[0] if names else ""

    def _edges_ahead(self) -> list[str]:
        """SUMO's edges of the ego's way, its junctions left out: they follow from the rest."""
        assert self._driver is not None
        found: list[str] = []
        for lane in self._driver.lanes_ahead():
            for name in self._net.lanes.get(lane, ()):
                edge = name.rpartition("_")[0]
                if edge and not edge.startswith(":") and (not found or found[-1] != edge):
                    found.append(edge)
        return found

    def _sumo_lane(self, lane: LaneId | None, station_m: float) -> str:
        names = self._net.lanes.get(lane or "", ())
        if not names:
            return ""
        share = station_m / self.town.road[lane or ""].length_m
        return names[max(0, min(len(names) - 1, int(share * len(names))))]

    def _tell_traffic(self, *, first: bool = False) -> None:
        assert self._sumo is not None
        ego = self._state.middle(LINCOLN_MKZ)
        lane = self._sumo_lane(self._lane, self._ego_station)
        self._sumo.move(EGO_NAME, ego, LINCOLN_MKZ.length_m, lane)
        if self._tick % 10 == 0 or first:
            way = self._edges_ahead()
            if tuple(way) != self._told and way:
                self._told = tuple(way)
                self._sumo.lead(EGO_NAME, way)
        for walker in self._people.walkers:
            if self._people.crosses(walker):
                one = self._people.state(walker)
                self._puppet(walker.id, Pose(one.x_m, one.y_m, one.heading_rad), one.length_m, one.width_m)
            elif walker.id in self._in_traffic:
                self._hide(walker.id)
        for actor in self._actors.values():
            self._puppet(actor.id, actor.pose, actor.length_m, actor.width_m)

    def _puppet(self, number: int, pose: Pose, length_m: float, width_m: float) -> None:
        """Somebody on the carriageway as SUMO's traffic sees them: a small vehicle."""
        assert self._sumo is not None
        place = self.town.road.locate(pose.x_m, pose.y_m, None, ("driving",))
        near = place is not None and abs(place.offset_m) < (
            self.town.road[place.lane].width_m / 2.0 + width_m / 2.0 + _ON_ROAD_M
        )
        if not near or place is None:
            self._hide(number)
            return
        lane = self._sumo_lane(place.lane, place.station_m)
        if not lane:
            return
        if number not in self._in_traffic:
            edge = lane.rpartition("_")[0]
            if edge.startswith(":"):
                return
            self._puppets += 1
            self._in_traffic[number] = f"p{number}.{self._puppets}"
            self._sumo.place(self._in_traffic[number], length_m, width_m, [edge])
        self._sumo.move(self._in_traffic[number], pose, length_m, lane)

    def _hide(self, number: int) -> None:
        assert self._sumo is not None
        name = self._in_traffic.pop(number, None)
        if name is not None:
            self._sumo.remove(name)

    def _mind_lights(self) -> None:
        """Set the traffic's lights anew where one has changed."""
        assert self._sumo is not None
        now = self._tick * DT_S
        if now < self._lights_until_s and self._phases:
            return
        at = [group.phase_at(now) for group in self.town.signals]
        self._lights_until_s = now + min((left for _, left in at), default=math.inf) - DT_S
        phases = [phase for phase, _ in at]
        if phases == self._phases:
            return
        self._phases = phases
        self._states, self._lane_lights = {}, {}
        for group, phase in zip(self.town.signals, phases, strict=True):
            for head, state in zip(group.heads, group.phases[phase].states, strict=True):
                shown = self._states[head.id] = self._forced.get(head.id, state)
                self._lane_lights.update(dict.fromkeys(head.lanes, shown))
        self._sumo.show(self._links, {lane: self._states[head] for lane, head in self._link_lanes.items()})

    def _signals_near(self, ego: VehicleState) -> tuple[Signal, ...]:
        found: list[Signal] = []
        for group, (x, y) in zip(self.town.signals, self._places, strict=True):
            if abs(x - ego.x_m) < SEES_M and abs(y - ego.y_m) < SEES_M:
                for one in group.signals(self._tick * DT_S):
                    forced = self._forced.get(one.id)
                    found.append(one if forced is None else replace(one, state=forced, remaining_s=None))
        return tuple(found)

    # Looking ----------------------------------------------------------------------------------------------------------

    @property
    def _stopped(self) -> bool:
        assert self._config is not None
        return self._crashed and self._config.contact_ends

    def _locate(self) -> None:
        """The ego's lane: one of its line's that it is in, the one it was in, or whichever is closest.

        Where ways part in a junction the closest is often another way than the one that the ego takes.
        """
        road, middle = self.town.road, self._state.middle(LINCOLN_MKZ)
        here = () if self._driver is None else self._driver.lanes_here()
        own = () if self._lane is None else (self._lane,)
        for name in (*(one for one in own if one in here), *here, *own):
            lane = road[name]
            station, offset = lane.centre.project(middle.x_m, middle.y_m)
            if -0.5 <= station <= lane.length_m and abs(offset) < lane.width_m / 2.0:
                self._lane, self._offset_m, self._ego_station = name, offset, station
                return
        place = road.locate(middle.x_m, middle.y_m, middle.heading_rad, ("driving",))
        if place is not None:
            self._lane, self._offset_m, self._ego_station = place.lane, place.offset_m, place.station_m

    _ego_station = 0.0

    def _road_users(self) -> tuple[VehicleState, ...]:
        return (self._ego(), *(one for one in self._others if one.kind != "pedestrian"))

    def _look_round(self) -> None:
        """Who is around, and whom the ego touches."""
        assert self._sumo is not None
        self._shown = None
        middle = self._state.middle(LINCOLN_MKZ)
        found: list[VehicleState] = []
        stacked = self.town.levels.near(middle.x_m, middle.y_m)
        movers: list[Mover] = []
        for mover in self._sumo.around(EGO_NAME):
            make = MAKES[mover.make]
            number = self._ids.setdefault(mover.name, len(self._ids) + 1)
            lanes = self._net.graph_lanes.get(mover.lane, ())
            lane = lanes[0] if len(lanes) == 1 else self._lane_of(mover, lanes)
            if stacked and self._on_another_level(lane, mover.x_m, mover.y_m, middle):
                continue
            movers.append(mover)
            found.append(
                VehicleState(
                    number,
                    make.kind,
                    mover.x_m,
                    mover.y_m,
                    mover.heading_rad,
                    mover.speed_mps,
                    make.length_m,
                    make.width_m,
                    lane,
                    acceleration_mps2=mover.acceleration_mps2,
                )
            )
        self._brakes.mind(self._ego(), movers)
        for walker in self._people.walkers:
            one = self._people.state(walker)
            if abs(one.x_m - middle.x_m) < SEES_M and abs(one.y_m - middle.y_m) < SEES_M:
                found.append(one)
        for actor in self._actors.values():
            p = actor.pose
            if math.hypot(p.x_m - middle.x_m, p.y_m - middle.y_m) < SEES_M:
                size = actor.length_m, actor.width_m
                lane = None
                if actor.kind != "pedestrian":
                    place = self.town.road.locate(p.x_m, p.y_m, p.heading_rad, ("driving",))
                    lane = None if place is None or abs(place.offset_m) > _NEAR_LANE_M else place.lane
                found.append(
                    VehicleState(actor.id, actor.kind, p.x_m, p.y_m, p.heading_rad, actor.speed_mps, *size, lane)
                )
        self._mind_contacts(found)

    def _on_another_level(self, lane: LaneId | None, x_m: float, y_m: float, ego: Pose) -> bool:
        """Whether somebody in a lane is over the ego, or under it."""
        if lane is None or self._lane is None:
            return False
        if self.town.levels.all_level(self._lane, self._ego_station, lane):
            return False
        away = math.hypot(x_m - ego.x_m, y_m - ego.y_m)
        station = self.town.road[lane].centre.nearest(x_m, y_m)
        return self.town.levels.apart(self._lane, self._ego_station, lane, max(0.0, station), away)

    def _lane_of(self, mover: Mover, lanes: tuple[LaneId, ...]) -> LaneId | None:
        """The lane of somebody of those that are one lane to SUMO; who stands is not looked for again."""
        known = self._lane_places.get(mover.name)
        place = mover.lane, mover.x_m, mover.y_m
        if known is None or known[0] != place:
            lane = None if known is None or known[0][0] != mover.lane else known[1]
            if lane is None or not self._amid(lane, mover.x_m, mover.y_m):
                lane = self._closest(lanes, mover.x_m, mover.y_m)
            known = self._lane_places[mover.name] = place, lane
        return known[1]

    def _amid(self, name: LaneId, x_m: float, y_m: float) -> bool:
        """Whether a place is well inside a lane: of those that follow one another no other is closer."""
        lane = self.town.road[name]
        station, offset = lane.centre.project(x_m, y_m)
        return _AMID_M < station < lane.length_m - _AMID_M and abs(offset) < lane.width_m / 2.0

    def _closest(self, lanes: tuple[LaneId, ...], x_m: float, y_m: float) -> LaneId | None:
        if len(lanes) <= 1:
            return lanes[0] if lanes else None
        road = self.town.road

        def away(lane: LaneId) -> float:
            station, offset = road[lane].centre.project(x_m, y_m)
            return abs(offset) + max(0.0, -station, station - road[lane].length_m)

        return min(lanes, key=away)

    def _mind_contacts(self, others: list[VehicleState]) -> None:
        box = self._ego().box
        touched: set[int] = set()
        for i, other in enumerate(others):
            if math.hypot(other.x_m - box.x_m, other.y_m - box.y_m) < TOUCHES_M and overlap(box, other.box):
                touched.add(other.id)
                others[i] = replace(other, crashed=True)
        if touched - self._touched:
            self._crashed = True
            self._state = replace(self._state, speed_mps=0.0)  # whatever it struck, the blow takes its speed
        self._touched = frozenset(touched)
        self._others = tuple(others)

    def _ego(self) -> VehicleState:
        state, middle = self._state, self._state.middle(LINCOLN_MKZ)
        assert self._config is not None
        crashed = self._crashed if self._config.contact_ends else bool(self._touched)
        return VehicleState(
            EGO,
            "car",
            middle.x_m,
            middle.y_m,
            middle.heading_rad,
            state.speed_mps,
            LINCOLN_MKZ.length_m,
            LINCOLN_MKZ.width_m,
            self._lane,
            crashed,
            state.acceleration_mps2,
            state.yaw_rate_radps(LINCOLN_MKZ),
            state.steering_rad,
        )

    def _look(self) -> Observation:
        assert self._config is not None
        ego, town = self._ego(), self.town
        lane = town.road.get(self._lane)
        off_road = lane is None or abs(self._offset_m) > lane.width_m / 2.0 + _OFF_ROAD_M
        late = self._tick * DT_S >= self._config.duration_s
        return Observation(
            time_s=round(self._tick * DT_S, 6),
            tick=self._tick,
            kind="town",
            ego=ego,
            others=self._others,
            objects=(),
            road=town.road,
            front=None if self._driver is None else self._driver.lead,
            stop_sign_m=None if self._driver is None or self._driver.stop_sign is None else self._driver.stop_sign[1],
            off_road=off_road,
            ended=self._stopped or off_road or late or self.arrived,
            signals=self._signals_near(ego),
            signs=town.signs,
            route=self._route if self._driver is None else self._driver.route,
        )


def place_named(town: MapPack, name: str) -> Any:
    """The place of a town that a name means. Raises ScenarioError, saying what places there are."""
    found = places_called(town.places, name)
    if found:
        return found[0]
    raise ScenarioError(
        f"{town.name} has no place {name!r}.",
        hint="It has " + (", ".join(place.name for place in town.places) or "no places with names") + ".",
    )


def _middle(group: SignalGroup) -> tuple[float, float]:
    """Amid the stop lines of a junction's lights."""
    points = [point for head in group.heads for point in head.stop_line_m]
    return sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points)


def _ruled(town: MapPack, links: tuple[Link, ...]) -> dict[str, str]:
    """Which head rules each SUMO lane before a light."""
    assert town.sumo is not None
    of_link = {(light, index): head for head, (light, indices) in town.sumo.links.items() for index in indices}
    return {link.lane: of_link[link.light, link.index] for link in links if (link.light, link.index) in of_link}


def _parse(scenario: Scenario) -> TownConfig:
    try:
        return TownConfig.model_validate(scenario.config)
    except ValidationError as error:
        faults = "; ".join(f"{'.'.join(map(str, e['loc'])) or 'config'}: {e['msg']}" for e in error.errors())
        raise ScenarioError(
            f"Scenario {scenario.id!r} has a bad town configuration: {faults}.",
            hint="Compare it with a built-in one: chauffeur show scenarios.",
        ) from error
