"""A town as it is seen and asked at an instant, whoever moves it: what its simulation and its copies share."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from chauffeur.concept import Observation, Scenario, ScenarioError, Signal, SignalState, VehicleState
from chauffeur.control.kinematic_bicycle import LINCOLN_MKZ
from chauffeur.geometry import LaneId, LanePlace, Route, plan_route
from chauffeur.worlds.path_follower import Chassis
from chauffeur.worlds.places import Destination
from chauffeur.worlds.skeleton import WorldBase, set_up
from chauffeur.worlds.town.driver import TOWN_CAPABILITIES, TownDriver
from chauffeur.worlds.town.instant import TownInstant
from chauffeur.worlds.town.pack import MapPack, SignalGroup, places_called
from chauffeur.worlds.town.perception import TownPerception
from chauffeur.worlds.town.sumo import engine_name
from chauffeur.worlds.town.trip import TownConfig, TownTrip, goal_in

DT_S: Final = 0.05
SEES_M: Final = 100.0
"""Distance beyond which agents are not shown."""
_SLOWING_MPS2: Final = 1.5
"""Another way begins where the car could stop by then: a turn nearer than that could not be taken."""
_ROOM_M: Final = 4.0
_AT_GOAL_M: Final = 3.0
_STANDS_MPS: Final = 0.1
STANDS_S: Final = 1.0
"""A car has stopped at a place once it has been slower than 0.1 m/s for so long: a passenger can get out."""
_LEFT_M: Final = 8.0
"""A place has been left when the car is so far from where it stood."""


class TownScene(WorldBase[TownPerception, TownDriver]):
    """Road, lights, driver and perception of a trip. Who and what is where, its heirs say."""

    capabilities = TOWN_CAPABILITIES
    dt_s = DT_S
    """Control period, s."""
    car = LINCOLN_MKZ
    """The ego."""

    def __init__(self, town: MapPack | None = None) -> None:
        """Args: the town to drive in, whatever scenarios say; by default they do."""
        self._given = town
        self._town: MapPack | None = None
        self._config: TownConfig | None = None
        self._route: Route | None = None
        self._lane: LaneId | None = None
        self._ego_station = 0.0
        self._tick = 0
        self._others: tuple[VehicleState, ...] = ()
        self._forced: dict[str, SignalState] = {}
        self._place = ""
        """The place that was set out for."""
        self._stood: tuple[str, float, float] | None = None
        """The place that was reached, and where the car stood."""
        self._still_s = 0.0
        """Time the car has stood, s."""

    @property
    def engine(self) -> str:
        """SUMO and its version. Its figures are no CARLA driving scores."""
        return engine_name()

    @property
    def chassis(self) -> Chassis:
        """The ego's size, axles and bounds."""
        return Chassis.of(self.car)

    @property
    def town(self) -> MapPack:
        """Map pack of the trip. Raises ScenarioError before the first reset."""
        return set_up(self._town)

    # Places -----------------------------------------------------------------------------------------------------------

    def head_for(self, place: str) -> None:
        """Set out for a place of the town from where the ego is. Raises ScenarioError: no such place, no way there."""
        assert self._driver is not None
        self._route = self._way_to(goal_in(self.town, place), place)
        self._driver.head_for(self._route)
        self._place, self._stood, self._shown = place, None, None

    def leave(self) -> None:
        """Be held by no goal any more: the road leads on."""
        assert self._driver is not None
        self._driver.roam()
        self._place, self._stood, self._route, self._shown = "", None, None, None

    def reached(self) -> str | None:
        """The place that was set out for, while the car stands there."""
        return None if self._stood is None else self._stood[0]

    def destination(self) -> Destination | None:
        """Destination of the ego; None without one, or once it is reached."""
        driver, road = self._driver, self.town.road
        if driver is None or not driver.has_goal or self._stood is not None:
            return None
        route = driver.route
        end = road[route.lanes[-1]].centre.at(route.goal_m)
        here = next((i for i, lane in enumerate(route.lanes) if lane == self._lane), None)
        if here is not None:
            route = Route(route.lanes[here:], self._ego_station, route.goal_m)
        named = places_called(self.town.places, self._place) if self._place else ()
        return Destination(named[0].name if named else "", end.x_m, end.y_m, max(0.0, route.length_m(road)))

    @property
    def arrived(self) -> bool:
        """True if the ego has come to a stand at its goal."""
        return self._stood is not None or (self._still_s >= STANDS_S and self._at_goal)

    @property
    def _at_goal(self) -> bool:
        """True if the ego is at the end of its way to a goal, moving or not."""
        driver = self._driver
        if driver is None or self._route is None or not driver.has_goal or not driver.stretch.goal:
            return False
        return driver.station_m + LINCOLN_MKZ.rear_to_middle_m > driver.stretch.end_m - _AT_GOAL_M

    def _mind_the_place(self, ego: VehicleState) -> None:
        """Note when the car has come to a stand at the place that was set out for, and when it has left."""
        driver = self.driver()
        self._still_s = self._still_s + DT_S if ego.speed_mps < _STANDS_MPS else 0.0
        if self._stood is not None:
            _, x, y = self._stood
            if abs(ego.x_m - x) + abs(ego.y_m - y) > _LEFT_M:
                self._stood = None
        elif self._place and not driver.has_goal:
            self._place = ""  # another way was wished since
        elif self._place and self.arrived:
            self._stood, self._place = (self._place, ego.x_m, ego.y_m), ""

    def _way_to(self, goal: LanePlace, name: str) -> Route:
        """The way to a place; it begins where the car can still choose it, or else where the car is."""
        assert self._lane is not None
        assert self._driver is not None
        road, ego = self.town.road, self.observe().ego
        here = LanePlace(self._lane, self._ego_station, 0.0)
        ahead_m = self._ego_station + ego.speed_mps**2 / (2.0 * _SLOWING_MPS2) + _ROOM_M
        before: list[LaneId] = []
        lanes = self._driver.lanes_ahead()
        for lane in lanes[lanes.index(here.lane) :] if here.lane in lanes and ego.speed_mps > 1.0 else ():
            if ahead_m <= road[lane].length_m:
                onward = plan_route(road, LanePlace(lane, ahead_m, 0.0), goal)
                if onward is not None:
                    return Route((*before, *onward.lanes), here.station_m, onward.goal_m)
                break
            ahead_m -= road[lane].length_m
            before.append(lane)
        route = plan_route(road, here, goal)
        if route is None:
            raise ScenarioError(f"No way leads to {name!r} from here.", hint="Choose another place.")
        return route

    @property
    def _heads_elsewhere(self) -> bool:
        """True if the passenger wished for another place than the scenario's goal."""
        return bool(self._place) or self._stood is not None

    # Looking ----------------------------------------------------------------------------------------------------------

    def _begin(self, scenario: Scenario, seed: int | None) -> TownTrip:
        """Be at the start of a trip, before anything moves; its driver is `_take_seat`'s."""
        trip = TownTrip.of(scenario, seed, self._given)
        self._town, self._config, self._route = trip.town, trip.config, trip.route
        self._lane, self._ego_station = trip.start.lane, trip.start.station_m
        self._tick, self._others, self._forced, self._shown = 0, (), {}, None
        self._place, self._stood, self._driver = "", None, None
        self._still_s = 0.0
        self._signal_places = [_middle(group) for group in trip.town.signals]
        return trip

    def _take_seat(self) -> TownDriver:
        """The driver and the perception of the trip."""
        town = self.town
        self._driver = driver = TownDriver(town.road, LINCOLN_MKZ, DT_S, self.observe, self._route)
        self._perception = TownPerception(town.road, self.observe, driver, town.places)
        self._shown = None
        return driver

    def mirrored(self) -> bytes:
        """The present instant, for copies in other processes."""
        return TownInstant(
            tick=self._tick,
            ego=self._ego(),
            others=self._others,
            lane=self._lane,
            station_m=self._ego_station,
            off_road=self._off_road,
            over=self._over,
            forced=self._forced,
            place=self._place,
            stood=self._stood,
            course=self.driver().course,
        ).encode()

    def _ego(self) -> VehicleState:
        raise NotImplementedError

    @property
    def _off_road(self) -> bool:
        raise NotImplementedError

    @property
    def _over(self) -> bool:
        """True if nothing will move any more."""
        raise NotImplementedError

    def _look(self) -> Observation:
        town, sign = self.town, None if self._driver is None else self._driver.stop_sign
        ego = self._ego()
        return Observation(
            time_s=round(self._tick * DT_S, 6),
            tick=self._tick,
            kind="town",
            ego=ego,
            others=self._others,
            objects=(),
            road=town.road,
            front=None if self._driver is None else self._driver.lead,
            stop_sign_m=None if sign is None else sign[1],
            off_road=self._off_road,
            ended=self._over,
            signals=self._signals_near(ego),
            signs=town.signs,
            route=self._route if self._driver is None else self._driver.route,
        )

    def _signals_near(self, ego: VehicleState) -> tuple[Signal, ...]:
        found: list[Signal] = []
        for group, (x, y) in zip(self.town.signals, self._signal_places, strict=True):
            if abs(x - ego.x_m) < SEES_M and abs(y - ego.y_m) < SEES_M:
                for one in group.signals(self._tick * DT_S):
                    forced = self._forced.get(one.id)
                    found.append(one if forced is None else replace(one, state=forced, remaining_s=None))
        return tuple(found)


def _middle(group: SignalGroup) -> tuple[float, float]:
    """Amid the stop lines of a junction's lights."""
    points = [point for head in group.heads for point in head.stop_line_m]
    return sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points)
