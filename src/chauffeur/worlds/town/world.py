"""A town: SUMO's traffic round an ego that is moved by a bicycle model of its own, at 20 Hz.

The ego's way is told to SUMO, so that its traffic yields to the ego; lights run the cycles of the map pack; people on
foot, and what a scenario puts on the road, are seen by the traffic as small vehicles. Contacts are overlaps of boxes.
All chance comes from one seed: the same scenario and seed give the same trip to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from chauffeur.concept import AgentKind, Command, Observation, Scenario, ScenarioError, SignalState, VehicleState
from chauffeur.concept.utterance import Colour
from chauffeur.control.kinematic_bicycle import LINCOLN_MKZ, BicycleState, advanced
from chauffeur.geometry import LaneId, Pose, overlap
from chauffeur.worlds.base import EGO
from chauffeur.worlds.skeleton import finite
from chauffeur.worlds.town.brakes import TrafficBrakes
from chauffeur.worlds.town.colours import drawn_colour
from chauffeur.worlds.town.mirror import TownMirror
from chauffeur.worlds.town.pack import MapPack
from chauffeur.worlds.town.people import People
from chauffeur.worlds.town.scene import DT_S, SEES_M, TownScene
from chauffeur.worlds.town.staged import Staged, StagedActor, lanes_onward
from chauffeur.worlds.town.sumo import EGO_NAME, MAKES, Link, Mover, Sumo
from chauffeur.worlds.town.traffic import Traffic

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
_NEAR_LANE_M: Final = 3.0
_AMID_M: Final = 0.5


@dataclass(slots=True)
class _Actor:
    """A road user or thing that a scenario put on the road."""

    id: int
    kind: AgentKind
    pose: Pose
    speed_mps: float
    length_m: float
    width_m: float
    colour: Colour | None


class TownWorld(TownScene):
    """A town, stepped at 20 Hz. One a process at a time: the one reset last drives, and the others say so."""

    def __init__(self, town: MapPack | None = None) -> None:
        """Args: the town to drive in, whatever scenarios say; by default they do."""
        super().__init__(town)
        self._sumo: Sumo | None = None
        self._state = BicycleState(Pose(0.0, 0.0, 0.0), 0.0)

    def reset(self, scenario: Scenario, seed: int | None = None) -> Observation:
        """Set up a town, its traffic and the ego.

        Raises:
            ScenarioError: The configuration is malformed, a place or way does not exist, or SUMO cannot run.
            MissingExtraError: SUMO is not installed.
        """
        trip = self._begin(scenario, seed)
        town, config, start, rng = trip.town, trip.config, trip.start, trip.rng
        if town.sumo is None:
            raise ScenarioError(
                f"The map pack {town.name!r} has no SUMO network.", hint="Build it again: chauffeur maps build."
            )
        self._net = town.sumo
        self.close()
        self._sumo = Sumo(town.sumo.path, DT_S, trip.simulator_seed)
        self._brakes = TrafficBrakes(self._sumo, DT_S)
        pose = town.road[start.lane].centre.at(start.station_m)
        rear = pose.ahead(-LINCOLN_MKZ.rear_to_middle_m)
        self._state = BicycleState(rear, config.ego_speed)
        self._touched = frozenset[int]()
        self._crashed = False
        self._ids: dict[str, int] = {}
        self._colour_seed = trip.simulator_seed
        self._colours: dict[int, Colour | None] = {}
        self._lane_places: dict[str, tuple[tuple[str, float, float], LaneId | None]] = {}
        self._actors: dict[int, _Actor] = {}
        self._next_actor = FIRST_ACTOR
        self._links = self._sumo.links()
        self._link_lanes = _ruled(town, self._links)
        self._phases: list[int] = []
        self._lights_until_s = 0.0
        self._states: dict[str, SignalState] = {}
        self._lane_lights: dict[LaneId, SignalState] = {}
        self._in_traffic: dict[int, str] = {}
        self._puppets = 0
        self._told: tuple[str, ...] = ()
        self._people = People(town.road, town.crossings, config.people, FIRST_WALKER, rng)
        self._mind_lights()
        self._take_seat()
        way = self._edges_ahead() or [self._edge_of(start.lane)]
        self._sumo.place(EGO_NAME, LINCOLN_MKZ.length_m, LINCOLN_MKZ.width_m, way, SEES_M)
        self._mind_lights()
        self._tell_traffic(first=True)
        self._sumo.step()
        self._traffic = Traffic(self._sumo, config.vehicles, rng)
        self._staged = Staged(town.road, start, self.drive)
        self._stage_ids = tuple(self._set_out(one) for one in config.stage)
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
        finite(command)
        assert self._sumo is not None, "reset first"
        asked = -LINCOLN_MKZ.most_braking_mps2 if self._stopped else command.acceleration_mps2
        before = self._state
        self._state = advanced(before, asked, command.steering_rad, DT_S, LINCOLN_MKZ)
        self._tick += 1
        self._locate()
        self._people.step(DT_S, self._lane_lights, self._road_users())
        self._staged.step(self._tick * DT_S, DT_S, self._state.middle(LINCOLN_MKZ))
        self._mind_lights()
        self._tell_traffic()
        self._sumo.step()
        self._traffic.mind()
        self._look_round()
        self._mind_the_place(self._ego())
        return Command(self._state.acceleration_mps2, self._state.steering_rad)

    def mirror(self) -> TownMirror:
        """A copy for another process, which needs no simulator."""
        return TownMirror(self._given)

    @property
    def mean_traffic_mps(self) -> float:
        """Mean speed of the traffic at this instant."""
        assert self._sumo is not None
        return self._sumo.mean_speed_mps()

    @property
    def vehicles(self) -> int:
        """Number of vehicles in traffic."""
        return self._traffic.count

    # The stage of a scenario ------------------------------------------------------------------------------------------

    def spawn(self, kind: AgentKind, pose: Pose, speed_mps: float = 0.0, colour: Colour | None = None) -> int:
        """Put a road user or a thing on the road, its middle at a pose; returns its id. Raises ScenarioError.

        A road user without a colour has one drawn.
        """
        if kind not in _SIZES:
            raise ScenarioError(f"A town has no road user of the kind {kind!r}.", hint=f"Say {', '.join(_SIZES)}.")
        number, self._next_actor = self._next_actor, self._next_actor + 1
        shown = colour or self._colour_of(number, kind)
        self._actors[number] = _Actor(number, kind, pose, speed_mps, *_SIZES[kind], shown)
        self._look_round()
        return number

    @property
    def staged(self) -> tuple[int, ...]:
        """Ids of the scenario's stage, in its order."""
        return self._stage_ids

    def _set_out(self, actor: StagedActor) -> int:
        """Put one of the scenario's stage on the road; returns its id. Raises ScenarioError."""
        pose = self._staged.pose_of(actor)
        if not actor.drives:
            number = self.spawn(actor.agent_kind, pose, actor.speed_mps if actor.at_once else 0.0, actor.colour)
            if actor.kind == "van":
                make = MAKES["van"]
                self._actors[number].length_m, self._actors[number].width_m = make.length_m, make.width_m
            self._staged.add(actor, number)
            return number
        road = self.town.road
        place = road.locate(pose.x_m, pose.y_m, pose.heading_rad, ("driving",))
        edge = "" if place is None else self._sumo_lane(place.lane, place.station_m)
        apart = place is None or abs(place.offset_m) > _NEAR_LANE_M
        if place is None or apart or not edge or edge.startswith(":") or actor.kind not in MAKES:
            raise ScenarioError(f"A {actor.kind} cannot set out {actor.ahead_m:g} m ahead: there is no lane for it.")
        assert self._sumo is not None
        edges: list[str] = []
        for lane in lanes_onward(road, place.lane, actor.turns):
            names = (name.rpartition("_")[0] for name in self._net.lanes.get(lane, ()))
            edges += [name for name in names if name and not name.startswith(":") and name not in edges[-1:]]
        name = f"s{len(self._ids) + 1}"
        number = self._ids[name] = len(self._ids) + 1
        self._colours[number] = actor.colour or drawn_colour(self._colour_seed, number, actor.agent_kind)
        first = edges.index(edge.rpartition("_")[0])
        self._sumo.put(name, actor.kind, edges[first:], edge, pose, actor.speed_mps)
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
        """Agent on the carriageway as SUMO's traffic sees it: a small vehicle."""
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

    # Looking ----------------------------------------------------------------------------------------------------------

    @property
    def _stopped(self) -> bool:
        assert self._config is not None
        return self._crashed and self._config.contact_ends

    @property
    def _off_road(self) -> bool:
        middle = self._state.middle(LINCOLN_MKZ)
        return self.town.road.ground.off_road(middle.x_m, middle.y_m)

    @property
    def _over(self) -> bool:
        config = self._config
        assert config is not None
        late = self._tick * DT_S >= config.duration_s
        there = self._at_goal if config.lanes else config.goal is not None and self.arrived
        at_goal = there and not self._heads_elsewhere
        return self._stopped or self._off_road or late or at_goal

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
                self._lane, self._ego_station = name, station
                return
        place = road.locate(middle.x_m, middle.y_m, middle.heading_rad, ("driving",))
        if place is not None:
            self._lane, self._ego_station = place.lane, place.station_m

    def _road_users(self) -> tuple[VehicleState, ...]:
        return (self._ego(), *(one for one in self._others if one.kind != "pedestrian"))

    def _look_round(self) -> None:
        """Update the agents around, and contacts with the ego."""
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
                    colour=self._colour_of(number, make.kind),
                )
            )
        self._brakes.mind(self._ego(), movers)
        for walker in self._people.walkers:
            one = self._people.state(walker)
            if abs(one.x_m - middle.x_m) < SEES_M and abs(one.y_m - middle.y_m) < SEES_M:
                found.append(replace(one, colour=self._colour_of(one.id, one.kind)))
        for actor in self._actors.values():
            p = actor.pose
            if math.hypot(p.x_m - middle.x_m, p.y_m - middle.y_m) < SEES_M:
                size = actor.length_m, actor.width_m
                lane = None
                if actor.kind != "pedestrian":
                    place = self.town.road.locate(p.x_m, p.y_m, p.heading_rad, ("driving",))
                    lane = None if place is None or abs(place.offset_m) > _NEAR_LANE_M else place.lane
                state = VehicleState(actor.id, actor.kind, p.x_m, p.y_m, p.heading_rad, actor.speed_mps, *size, lane)
                found.append(replace(state, colour=actor.colour))
        self._mind_contacts(found)

    def _colour_of(self, number: int, kind: AgentKind) -> Colour | None:
        if number not in self._colours:
            self._colours[number] = drawn_colour(self._colour_seed, number, kind)
        return self._colours[number]

    def _on_another_level(self, lane: LaneId | None, x_m: float, y_m: float, ego: Pose) -> bool:
        """True if an agent in a lane is over the ego, or under it."""
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
        """True if a place is well inside a lane: of those that follow one another no other is closer."""
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


def _ruled(town: MapPack, links: tuple[Link, ...]) -> dict[str, str]:
    """Signal head that rules each SUMO lane before a light."""
    assert town.sumo is not None
    of_link = {(light, index): head for head, (light, indices) in town.sumo.links.items() for index in indices}
    return {link.lane: of_link[link.light, link.index] for link in links if (link.light, link.index) in of_link}
