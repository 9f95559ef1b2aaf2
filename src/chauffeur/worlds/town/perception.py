"""Answers to the driving APIs' questions in a town, over its road graph."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from chauffeur.concept import LaneId, Observation, SignalState, Turn, VehicleState
from chauffeur.control.idm import IdmParameters, idm_acceleration
from chauffeur.geometry import JunctionWay, Lane, RoadGraph, choice_ahead
from chauffeur.worlds.base import EGO
from chauffeur.worlds.over_graph import ObservedPerception
from chauffeur.worlds.town.driver import TOWN_IDM, TownDriver
from chauffeur.worlds.town.pack import Place, places_called

_REACH_M: Final = 120.0
_PEOPLE_M: Final = 60.0
_ASIDE_M: Final = 5.0
_ON_WAY_M: Final = 1.6
"""A road user whose middle is so near to the middle of the way is on it."""
_DRIFTS_MPS: Final = 0.25
_CHANGE_M: Final = 15.0
"""Room that a change of lanes needs at least."""


class TownPerception(ObservedPerception):
    """Perception of the present instant of a town; stays valid as it is stepped."""

    def __init__(
        self,
        road: RoadGraph,
        look: Callable[[], Observation],
        driver: TownDriver,
        places: Sequence[Place] = (),
    ) -> None:
        super().__init__(look)
        self._graph, self._look, self._driver, self._places = road, look, driver, places
        self.look = look
        self._choices: dict[
            tuple[LaneId, ...], tuple[LaneId, float, Mapping[Turn, tuple[JunctionWay, ...]]] | None
        ] = {}

    @property
    def _road(self) -> RoadGraph:
        return self._graph

    def has_lane(self, lane: LaneId) -> bool:
        """True if the town has this lane, for cars."""
        found = self._road.get(lane)
        return found is not None and found.kind == "driving"

    def lane_of(self, vehicle_id: int) -> LaneId:
        """Closest lane of a vehicle."""
        one = self.vehicle(vehicle_id)
        if one.lane is not None:
            return one.lane
        place = self._road.locate(one.x_m, one.y_m, one.heading_rad, ("driving",))
        if place is None:
            raise KeyError(vehicle_id)
        return place.lane

    def adjacent_lane(self, lane: LaneId, offset: int) -> LaneId | None:
        """Lane `offset` places to the right (negative: left); None beyond the edge."""
        beside = None if offset == 0 else self._road.neighbour(lane, offset)
        return beside if beside is not None and self._road[beside].kind == self._road[lane].kind else None

    def neighbours(self, lane: LaneId) -> tuple[int | None, int | None]:
        """Nearest vehicle ahead of and behind the ego in a lane, or in what follows and precedes it."""
        ahead: tuple[float, int | None] = (_REACH_M, None)
        behind: tuple[float, int | None] = (_REACH_M, None)
        for one in (*self._look().others, *self._look().objects):
            if one.kind in ("pedestrian", "stop_sign"):
                continue
            gap = self._along(lane, one)
            if gap is None:
                continue
            if 0.0 < gap < ahead[0]:
                ahead = gap, one.id
            elif gap <= 0.0 and -gap < behind[0]:
                behind = -gap, one.id
        return ahead[1], behind[1]

    def distance_along(self, from_id: int, to_id: int) -> float:
        """Centre-to-centre distance along the first one's lane; negative if behind."""
        one, other = self.vehicle(from_id), self.vehicle(to_id)
        if from_id == EGO:
            line = self._driver.stretch.line
            here = line.nearest(one.x_m, one.y_m, self._driver.station_m - 5.0, self._driver.station_m + 10.0)
            return line.nearest(other.x_m, other.y_m, here - _REACH_M, here + _REACH_M) - here
        lane = self._road[self.lane_of(from_id)]
        line = lane.centre
        return line.nearest(other.x_m, other.y_m) - line.nearest(one.x_m, one.y_m)

    def cross_traffic_lanes(self, from_left: bool) -> tuple[LaneId, ...]:
        """Lanes that lead into the next junction from the left (or right), and on across the ego's way there."""
        way = self._next_junction()
        if way is None:
            return ()
        heading = float(way.centre.headings[0])
        found: list[LaneId] = []
        for name in self._road.conflicts(way.id):
            other = self._road[name]
            across = math.sin(float(other.centre.headings[0]) - heading)
            if abs(across) < 0.5 or (across < 0.0) != from_left:  # who comes from the left drives to the right
                continue
            found += [one.id for one in self._road.predecessors(name)]
            found.append(name)
        return tuple(dict.fromkeys(found))

    def stop_sign_ahead(self, served: frozenset[int]) -> tuple[int, float] | None:
        """(id, distance) of the nearest stop sign ahead on the ego's way that is not in `served`."""
        found = self._driver.stop_sign
        return None if found is None or found[0] in served else found

    def front_blocker(self, served: frozenset[int]) -> int | None:
        """Nearest vehicle, person or stop sign not in `served`, ahead on the ego's way."""
        lead, sign = self._driver.lead, self.stop_sign_ahead(served)
        if lead is not None and (sign is None or lead.distance_m < sign[1]):
            return lead.vehicle
        return None if sign is None else sign[0]

    def idm_entering(self, follower_id: int, leader_id: int, time_headway_s: float) -> float:
        """IDM acceleration of `follower` if `leader` drove right ahead of it and it wished its present speed."""
        follower, leader = self.vehicle(follower_id), self.vehicle(leader_id)
        parameters = IdmParameters(
            TOWN_IDM.acceleration_mps2, TOWN_IDM.deceleration_mps2, 4.0, TOWN_IDM.jam_distance_m, time_headway_s
        )
        gap = self.distance_along(follower_id, leader_id) - (follower.length_m + leader.length_m) / 2.0
        return idm_acceleration(
            follower.speed_mps, max(follower.speed_mps, 1.0), parameters, gap, follower.speed_mps - leader.speed_mps
        )

    # Streets ----------------------------------------------------------------------------------------------------------

    def gap_ahead(self) -> tuple[float, float] | None:
        """(m between the bumpers, its speed) of who or what is ahead on the way; None without."""
        return self._driver.gap_ahead

    def light_ahead(self) -> tuple[SignalState, float] | None:
        """(what it shows, m to its stop line) of the next traffic light that rules the way; None without."""
        return self._driver.light_ahead()

    def person_ahead(self) -> float | None:
        """Distance to the nearest person on foot on the way or close to it; None without."""
        seen, line, here = self._look(), self._driver.stretch.line, self._driver.station_m
        nearest: float | None = None
        for one in seen.others:
            if one.kind != "pedestrian" or math.hypot(one.x_m - seen.ego.x_m, one.y_m - seen.ego.y_m) > _PEOPLE_M:
                continue
            station = line.nearest(one.x_m, one.y_m, here, here + _PEOPLE_M)
            ahead = station - here - seen.ego.length_m / 2.0
            near = abs(line.offset(one.x_m, one.y_m, station)) < _ASIDE_M
            if near and ahead > 0.0 and (nearest is None or ahead < nearest):
                nearest = ahead
        return nearest

    def on_way(self, vehicle_id: int) -> tuple[float, float, float]:
        """(m from the front bumper to a road user's middle along the way, m to the left of it, m/s to the left)."""
        one = self.vehicle(vehicle_id)
        line, rear = self._driver.stretch.line, self._driver.station_m
        station = line.nearest(one.x_m, one.y_m, rear - _PEOPLE_M, rear + _REACH_M)
        pose = line.at(station)
        ahead, aside = pose.sees(one.x_m, one.y_m)
        nose = rear + self._driver.nose_m
        away = ahead if not 0.0 < station < line.length_m else 0.0  # beyond the end of the line that is known
        return station + away - nose, aside, one.speed_mps * math.sin(one.heading_rad - pose.heading_rad)

    def crosses_at(self, vehicle_id: int) -> float | None:
        """Distance to where a road user beside the way comes onto it; None where it does not."""
        ahead, aside, leftward = self.on_way(vehicle_id)
        one = self.vehicle(vehicle_id)
        if abs(aside) < _ON_WAY_M:
            return ahead - one.length_m / 2.0
        if aside * leftward > 0.0 and abs(leftward) > _DRIFTS_MPS:
            return None  # it moves away
        if abs(leftward) <= _DRIFTS_MPS:
            return ahead - one.length_m / 2.0 if abs(aside) < _ASIDE_M else None
        along = math.sqrt(max(0.0, one.speed_mps**2 - leftward**2))
        pose = self._driver.stretch.line.at(self._driver.station_m)
        with_us = 1.0 if math.cos(one.heading_rad - pose.heading_rad) > 0.0 else -1.0
        return ahead + with_us * along * abs(aside / leftward)

    def turn_after(self, vehicle_id: int) -> Turn | None:
        """The way at the next junction that a road user ahead has taken; None while it has taken none."""
        lane, found = self.vehicle(vehicle_id).lane, self._choice()
        if lane is None or found is None:
            return None
        road = self._road
        for turn, ways in found[2].items():
            for way in ways:
                exits = {one.id for one in road.abreast(way.exit)}
                onward = {one.id for name in exits for one in road.successors(name)}
                if lane in way.lanes or lane in exits or lane in onward:
                    return turn
        return None

    def lane_after(self, vehicle_id: int) -> LaneId | None:
        """The lane of a road user on the ego's own street; None where it is on another."""
        lane, own = self.vehicle(vehicle_id).lane, self._look().ego.lane
        if lane is None or own is None or self._road[own].junction or not self._road.places_between(own, lane):
            return None
        return lane if self._road[lane].kind == "driving" else None

    def is_clear(self) -> bool:
        """True if no road user that crosses the way is being let go first."""
        return not self._driver.lets_go_first

    def junction_ahead(self) -> tuple[float, tuple[Turn, ...]] | None:
        """(m, ways on from the street) of the next junction with a choice of ways; None without."""
        found, ego = self._choice(), self._look().ego
        if found is None or ego.lane is None:
            return None
        done = self._road[ego.lane].centre.nearest(ego.x_m, ego.y_m)
        return max(0.0, found[1] - done - ego.length_m / 2.0), tuple(found[2])

    def _choice(self) -> tuple[LaneId, float, Mapping[Turn, tuple[JunctionWay, ...]]] | None:
        """The next junction on the way where it parts, as `choice_ahead` tells it."""
        lanes, own = self._driver.lanes_ahead(), self._road.get(self._look().ego.lane)
        if own is None or not lanes:
            return None
        if own.id not in lanes:
            lanes = (own.id, *lanes)
        elif lanes[0] != own.id:
            lanes = lanes[lanes.index(own.id) :]
        if lanes not in self._choices:
            self._choices = {lanes: choice_ahead(self._road, lanes)}
        return self._choices[lanes]

    def lane_beside(self, side: int) -> LaneId | None:
        """The lane to the right (negative: left) that the ego may change into from its own; None without."""
        own = self.lane_of(EGO)
        beside = (one for one, room in self._road.changes(own) if room >= _CHANGE_M)
        return next((one for one in beside if (self._road.places_between(own, one) or 0) * side > 0), None)

    def place_ahead(self, name: str) -> float | None:
        """Distance to a place by its name or kind; None where it does not lie ahead on this way."""
        at_m, ego = 0.0, self._look().ego
        meant = places_called(self._places, name)
        for i, lane in enumerate(self._driver.lanes_ahead()):
            own = self._road[lane]
            done = own.centre.nearest(ego.x_m, ego.y_m) if i == 0 else 0.0
            for place in meant:
                ahead = at_m + place.station_m - done
                if ahead >= 0.0 and (place.lane == lane or self._road.places_between(lane, place.lane) is not None):
                    return ahead
            at_m += own.length_m - done
        return None

    def _next_junction(self) -> Lane | None:
        stretch = self._driver.stretch
        at, _ = stretch.lane_at(self._driver.station_m)
        return next((lane for lane in stretch.lanes[at:] if lane.junction), None)

    def _along(self, lane: LaneId, other: VehicleState) -> float | None:
        """Distance from the ego to an agent in a lane, the one before or the one after it; None if in none."""
        own, ego = self._road[lane], self._look().ego
        if other.lane is None:
            return None
        here = own.centre.nearest(ego.x_m, ego.y_m)
        if other.lane == lane:
            return own.centre.nearest(other.x_m, other.y_m) - here
        if other.lane in own.successors:
            return own.length_m - here + self._road[other.lane].centre.nearest(other.x_m, other.y_m)
        if lane in self._road[other.lane].successors:
            its = self._road[other.lane]
            return its.centre.nearest(other.x_m, other.y_m) - its.length_m - here
        return None
