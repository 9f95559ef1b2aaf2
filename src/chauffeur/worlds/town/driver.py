"""The town's low-level driver: along a route, by the lights and signs, letting first who goes first.

Speed: IDM towards the limit, the wish and what bends allow, and behind who is ahead. It stops, as gently as can be, at
red lights and stop signs, before junctions whose exit is blocked, and before the place where somebody else will be
first; it waits before the stop line, not behind it. Steering: pure pursuit along the line of `way.Stretch`, and over to
the next lane in a gap where the route needs it or a wish asks for it. With nobody's wishes it is a careful driver.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

from chauffeur.concept import (
    Capabilities,
    Command,
    LaneId,
    Lead,
    Observation,
    Setpoints,
    SignalState,
    VehicleState,
)
from chauffeur.control.idm import IdmParameters, free_acceleration, idm_acceleration
from chauffeur.control.kinematic_bicycle import KinematicBicycle
from chauffeur.control.pure_pursuit import pursuit_steering
from chauffeur.geometry import (
    JunctionWay,
    Lane,
    Polyline,
    Pose,
    RoadGraph,
    Route,
    Turn,
    choice_ahead,
)
from chauffeur.worlds.town.course import Course
from chauffeur.worlds.town.foresight import Foresight, Meeting
from chauffeur.worlds.town.gaps import COMING_S, NEAR_M, GapAcceptance
from chauffeur.worlds.town.stop_lines import OVER_M, SIGHT_M, STANDING_MPS, StopLineRules, StopPoint
from chauffeur.worlds.town.way import RouteCorridor, Stretch, blended, first_m, free_route

TOWN_CAPABILITIES: Final = Capabilities(
    roads=("town",),
    policies=("program", "parameters", "trajectory"),
    lane_changes=True,
    turns=True,
    stop_signs=True,
    places=True,
    horizon_s=600.0,
)
"""Of every world that this driver drives in."""
TOWN_IDM: Final = IdmParameters(1.8, 2.2, 4.0, 2.5, 1.4)
_FREE_ROUTE_M: Final = 600.0
_ONWARD_M: Final = 150.0
"""A free way is drawn out when so much of it is left."""
_LOOK_S: Final = 0.6
_LEAST_LOOK_M: Final = 3.2
_SIDE_M: Final = 0.35
_MOST_BRAKING_MPS2: Final = 8.0
_CLOSE_M: Final = 1.0
"""Gap to which a car with its tail over a stop line draws up to the one ahead."""
_BEFORE_M: Final = 2.2
"""Distance before an agent's way at which the front bumper stops."""
_BEFORE_PERSON_M: Final = 3.0
_GIVES_WAY_MPS: Final = 0.5
"""Speed up to which an agent before a car in its way counts as waiting for it."""
_CLEAR_S: Final = 1.2
"""Time by which a car that goes first misses a crossing agent."""
_AFTER_S: Final = 0.4
_ACCELERATING_MPS2: Final = 1.5
_CHANGE_LEAST_M: Final = 14.0
_CHANGE_S: Final = 3.5
_ROOM_M: Final = 12.0
"""Distance before a lane's end at which a car waits for a gap, with room left to change lanes."""
_SEAM_M: Final = 45.0
"""A change that is begun before a seam of the road ends at most so far beyond it."""
_LANE_BESIDE_M: Final = 5.0
_HERE_M: Final = 3.0
_LOST_M: Final = 3.0
_EVERY: Final = 2
"""The others are looked at every so many periods."""
_KERB_M: Final = 2.6
_WAITS_M: Final = 3.8
"""Distance from the line within which a standing agent may be about to cross."""
_PEOPLE_MPS: Final = 4.5


class TownDriver:
    """Drives one trip."""

    def __init__(
        self,
        road: RoadGraph,
        chassis: KinematicBicycle,
        dt_s: float,
        look: Callable[[], Observation],
        route: Route | None = None,
    ) -> None:
        """Args: the road; the ego's size and axles; control period; the present instant; where to go, if anywhere."""
        self._road, self._chassis, self._dt_s, self._look = road, chassis, dt_s, look
        self._foresight = Foresight(road)
        ego = look().ego
        place = road.locate(ego.x_m, ego.y_m, ego.heading_rad, ("driving",))
        assert place is not None
        self._goal = route is not None
        self._turn: Turn | None = None
        self._turning_at = ""
        self._corridor = RouteCorridor(
            road, route or free_route(road, place.lane, place.station_m, None, _FREE_ROUTE_M)
        )
        first = self._corridor.layer_of(place.lane, 0)
        if first is None:
            first, start = 0, self._corridor.route.lanes[0]
        else:
            start = place.lane
        self._stretch = self._corridor.stretch(first, start)
        self._station = self._first_station(ego)
        self._changing_to: float | None = None
        self._wanted: LaneId | None = None
        self._stop_lines, self._gaps = StopLineRules(chassis.length_m, dt_s), GapAcceptance(road)
        self._meetings: list[Meeting] = []
        self._tick = 0
        self.why = ""
        self.lets_go_first = False
        """True if it waits, or slows down, for a road user whose way crosses its own."""

    def head_for(self, route: Route) -> None:
        """Go somewhere else from here on."""
        ego = self._look().ego
        self._goal, self._turn = True, None
        self._take(route, ego.lane if ego.lane in route.lanes else route.lanes[0], ego)

    def roam(self) -> None:
        """Go on along the road from here on: there is no goal any more."""
        self._goal = False

    @property
    def course(self) -> Course:
        """State that a copy in another process needs."""
        stretch, led = self._stretch, self._stretch.led
        return Course(
            route=self._corridor.route,
            goal=self._goal,
            turn=self._turn,
            turning_at=self._turning_at,
            layer=stretch.layer,
            lanes=tuple(lane.id for lane in stretch.lanes),
            led_m=() if led is None else led.points_m,
            ends=stretch.goal,
            station_m=self._station,
            changing_to_m=self._changing_to,
            ahead=self._ahead,
            sign=self._stop_lines.sign,
        )

    def adopt(self, course: Course) -> None:
        """Be a copy of a driver elsewhere, to answer as it does. Raises KeyError for lanes that the road has not."""
        was = self._stretch, self._stretch.led
        led = () if was[1] is None else was[1].points_m
        corridor = self._corridor
        if course.route != corridor.route:
            corridor = RouteCorridor(self._road, course.route)
        same = (course.layer, course.lanes, course.led_m) == (was[0].layer, tuple(one.id for one in was[0].lanes), led)
        if corridor is not self._corridor or not same or course.ends != was[0].goal:
            lanes = [self._road[lane] for lane in course.lanes]
            first = Polyline.of(course.led_m) if course.led_m else None
            self._stretch = Stretch.of(lanes, course.layer, course.route.goal_m if course.ends else None, first)
        self._corridor, self._goal, self._turn = corridor, course.goal, course.turn
        self._turning_at, self._station, self._changing_to = course.turning_at, course.station_m, course.changing_to_m
        self._meetings = [] if course.ahead is None else [course.ahead]
        self._stop_lines.sign = course.sign

    # What a world asks ------------------------------------------------------------------------------------------------

    @property
    def route(self) -> Route:
        """The present route."""
        return self._corridor.route

    @property
    def stretch(self) -> Stretch:
        """The line that it follows."""
        return self._stretch

    @property
    def station_m(self) -> float:
        """Station of the rear axle along that line, m."""
        return self._station

    def lanes_here(self) -> tuple[LaneId, ...]:
        """The lanes of the line that the car may be in: from its rear axle's to what is a few metres ahead of it."""
        first, _ = self._stretch.lane_at(self._station - 1.0)
        last, _ = self._stretch.lane_at(self._station + self.nose_m + _HERE_M)
        return tuple(lane.id for lane in self._stretch.lanes[first : last + 1])

    def lanes_ahead(self) -> tuple[LaneId, ...]:
        """The lanes of the line from the ego's own on, and those of the route after it."""
        at, _ = self._stretch.lane_at(self._station)
        own = [lane.id for lane in self._stretch.lanes[at:]]
        layer = self._stretch.layer + len(self._stretch.lanes)
        rest = [
            next((lane for lane in self._corridor.layers[i] if lane in self._corridor.changes[i]), "")
            for i in range(layer, len(self._corridor.layers))
        ]
        return (*own, *(lane for lane in rest if lane))

    @property
    def has_goal(self) -> bool:
        """True if its route leads somewhere, and is not just the way on."""
        return self._goal

    @property
    def _ahead(self) -> Meeting | None:
        """The nearest agent ahead on the line, people left out."""
        now = [one for one in self._meetings if one.now and one.other.kind != "pedestrian"]
        return min(now, key=lambda one: one.first_m, default=None)

    @property
    def lead(self) -> Lead | None:
        """The lead vehicle on the line, centre to centre."""
        nearest = self._ahead
        if nearest is None:
            return None
        gap = nearest.first_m - self._station - self.nose_m
        away = gap + (self._chassis.length_m + nearest.other.length_m) / 2.0
        return Lead(nearest.other.id, max(0.0, away), nearest.along_mps) if away > 0.0 else None

    @property
    def gap_ahead(self) -> tuple[float, float] | None:
        """(m between the bumpers, its speed) of who or what is ahead on the line, people left out; None without."""
        nearest = self._ahead
        if nearest is None:
            return None
        return max(0.0, nearest.first_m - self._station - self.nose_m), max(0.0, nearest.along_mps)

    def light_ahead(self) -> tuple[SignalState, float] | None:
        """(state, m from the front bumper to the stop line) of the next light on the line; None where none is near."""
        seen, nose = self._look(), self._station + self.nose_m
        lights = {lane: signal for signal in seen.signals for lane in signal.lanes}
        line_m = partial(self._stop_lines.line_m, self._stretch)
        at, _ = self._stretch.lane_at(self._station - 2.0)
        for i in range(at, len(self._stretch.lanes)):
            start, end = self._stretch.span(i)
            light = lights.get(self._stretch.lanes[i].id)
            if start > nose + 100.0:
                break
            if light is not None and (ahead := line_m(light, start, end) - nose) > -OVER_M:
                return light.state, max(0.0, ahead)
        return None

    @property
    def stop_sign(self) -> tuple[int, float] | None:
        """(number, distance from the ego's centre) of the next stop sign on the line that is not served."""
        return self._stop_lines.sign

    # Wishes -----------------------------------------------------------------------------------------------------------

    def initial_setpoints(self) -> Setpoints:
        """As fast as allowed and sensible, along the route."""
        return Setpoints(target_speed_mps=None, time_headway_s=TOWN_IDM.time_headway_s)

    def settle(self, setpoints: Setpoints) -> Setpoints:
        """Wishes with a speed where they have none, a lane that is left behind forgotten, and one from which the way
        cannot be driven as well as from the lane that is steered for given up for that lane."""
        ego = self._look().ego
        lane = self._road.get(setpoints.target_lane)
        own = self._road.get(ego.lane)
        if lane is not None and own is not None and lane.road != own.road:
            onward = (one.id for one in self._road.successors(lane.id) if one.road == own.road and own.road)
            setpoints = replace(setpoints, target_lane=next(onward, None))
        elif lane is not None and (better := self._steered_for(lane)) is not None:
            setpoints = replace(setpoints, target_lane=better)
        if self._turn is not None and own is not None and own.junction and own.junction == self._turning_at:
            self._turn = None  # in the junction: the wish was for it alone, and the next is for the next one
            setpoints = replace(setpoints, turn=None)
        if setpoints.target_speed_mps is None:
            limit = float(self._stretch.limit_mps[self._stretch.index(self._station)])
            setpoints = replace(setpoints, target_speed_mps=limit)
        return setpoints

    def _steered_for(self, wish: Lane) -> LaneId | None:
        """The lane of the line beside a wished one, where it needs fewer changes for the way; None where it does not,
        or where the way is free and will follow the wish."""
        if not self._goal and self._turn is None:
            return None
        at, lane = self._stretch.lane_at(self._station + self.nose_m)
        if lane.junction or lane.road != wish.road:
            return None
        changes = self._corridor.changes[self._stretch.layer + at]
        return lane.id if changes.get(lane.id, math.inf) < changes.get(wish.id, math.inf) else None

    def command(self, setpoints: Setpoints) -> Command:
        """Acceleration and steering for this period."""
        seen = self._look()
        ego = seen.ego
        self._turn_to(setpoints, ego)
        self._station = self._rear_station(ego, self._station - 1.0, self._station + 8.0)
        self._keep_to_the_road(ego)
        if self._tick % _EVERY == 0:
            self._meetings = self._met(seen)
        self._tick += 1
        self._mind_the_lane(seen, setpoints)
        acceleration = self._acceleration(seen, setpoints)
        rear = Pose(ego.x_m, ego.y_m, ego.heading_rad).ahead(-self._chassis.rear_to_middle_m)
        look = max(_LEAST_LOOK_M, _LOOK_S * ego.speed_mps)
        steering = pursuit_steering(
            rear, self._stretch.line, look, self._station, self._chassis.wheelbase_m, self._chassis.most_steering_rad
        )
        return Command(acceleration, steering)

    # Where ------------------------------------------------------------------------------------------------------------

    @property
    def nose_m(self) -> float:
        """From the rear axle to the front bumper."""
        return self._chassis.rear_to_middle_m + self._chassis.length_m / 2.0

    def _rear_station(self, ego: VehicleState, low_m: float, high_m: float) -> float:
        rear = Pose(ego.x_m, ego.y_m, ego.heading_rad).ahead(-self._chassis.rear_to_middle_m)
        return self._stretch.line.nearest(rear.x_m, rear.y_m, low_m, high_m)

    def _first_station(self, ego: VehicleState) -> float:
        """On a new line, which begins in the ego's lane: its way may come by the same place again later."""
        return self._rear_station(ego, -math.inf, first_m(self._stretch) + _HERE_M)

    def _turn_to(self, setpoints: Setpoints, ego: VehicleState) -> None:
        """Another way at the next junction, where the wish is another than the route; and over, where a free way is."""
        if setpoints.turn is None:
            self._turn = None
        here = self._road.get(ego.lane)
        if here is None or here.junction or self._changing_to is not None:
            return
        beside = None if self._goal and setpoints.turn is None else self._free_beside(here.id, setpoints)
        if beside is None and (setpoints.turn is None or setpoints.turn == self._turn):
            return
        self._turn = setpoints.turn
        lanes = self.lanes_ahead()
        ways = self._wished_ways(lanes)
        if beside is None and any(way.lanes[0] in lanes for way in ways):
            return  # it leads there already
        self._goal &= setpoints.turn is None
        at = max(0.0, here.centre.nearest(ego.x_m, ego.y_m))
        self._take(free_route(self._road, here.id, at, setpoints.turn, _FREE_ROUTE_M, beside), here.id, ego)

    def _wished_ways(self, lanes: Sequence[LaneId]) -> tuple[JunctionWay, ...]:
        """The ways of the wished turn at the next junction with a choice, which is kept in mind; none where none is."""
        choice = choice_ahead(self._road, lanes) if self._turn is not None else None
        ways = () if choice is None or self._turn is None else choice[2].get(self._turn, ())
        self._turning_at = "" if not ways else self._road[ways[0].lanes[0]].junction
        return ways

    def _free_beside(self, lane: LaneId, setpoints: Setpoints) -> LaneId | None:
        """The lane beside that is wished and that the free way does not lead into yet."""
        wish = self._road.get(setpoints.target_lane)
        if wish is None or self._turn is not None or wish.road != self._road[lane].road:
            return None
        step = wish.index - self._road[lane].index
        beside = self._road.neighbour(lane, 1 if step > 0 else -1) if step else None
        if beside is None or beside in self._corridor.route.lanes[:2]:
            return None
        return beside if beside in [one for one, _ in self._road.changes(lane)] else None

    def _take(self, route: Route, lane: LaneId, ego: VehicleState) -> None:
        self._corridor = RouteCorridor(self._road, route)
        self._stretch = self._corridor.stretch(self._corridor.layer_of(lane, 0) or 0, lane)
        self._station = self._first_station(ego)
        self._changing_to = None
        self._wished_ways(self.lanes_ahead())  # the junction may lie behind the end of the way before

    def _keep_to_the_road(self, ego: VehicleState) -> None:
        """The line anew where the car is not on it any more, and the way anew where it has none."""
        end = self._stretch.line.length_m
        complete = self._stretch.goal  # it leads to the end of the route; another ends where lanes have to be changed
        if self._station > end - (_ONWARD_M if complete else 5.0) and self._onwards():
            return
        off = self._stretch.line.offset(ego.x_m, ego.y_m, self._station)
        if abs(off) < _LOST_M or self._changing_to is not None:
            return
        place = self._road.locate(ego.x_m, ego.y_m, ego.heading_rad, ("driving",))
        if place is None:
            return
        at, _ = self._stretch.lane_at(self._station)
        layer = self._corridor.layer_of(place.lane, self._stretch.layer + at)
        if layer is not None:
            self._stretch = self._corridor.stretch(layer, place.lane)
            self._station = self._first_station(ego)

    def _onwards(self) -> bool:
        """The free way drawn out, where the one there was is nearly driven; False where it ends, or leads to a goal."""
        ego = self._look().ego
        here = self._road.get(ego.lane)
        last = self._stretch.lanes[-1]
        if self._goal or here is None or here.junction or self._changing_to is not None or not last.successors:
            return False
        at = max(0.0, here.centre.nearest(ego.x_m, ego.y_m))
        self._take(free_route(self._road, here.id, at, self._turn, _FREE_ROUTE_M), here.id, ego)
        return True

    # Lanes ------------------------------------------------------------------------------------------------------------

    def _mind_the_lane(self, seen: Observation, setpoints: Setpoints) -> None:
        """Begin or end a change of lanes."""
        ego, stretch = seen.ego, self._stretch
        if self._changing_to is not None:
            waits = ego.speed_mps < STANDING_MPS and stretch.end_m - self._station - self.nose_m < _ROOM_M + _HERE_M
            if self._station > self._changing_to or waits:  # who waits for the next change ends this one where it is
                self._changing_to = None
            return
        at, lane = stretch.lane_at(self._station + self.nose_m)
        if lane.junction:
            return
        layer = stretch.layer + at
        changes = self._corridor.changes[layer]
        goal = self._beside(lane.id, changes, setpoints)
        if goal is None:
            return
        other = self._corridor.stretch(layer, goal)
        end = self._beside_until(at, other)
        room = min(end, stretch.end_m if stretch.goal else end) - self._station - self.nose_m
        way = max(_CHANGE_LEAST_M, ego.speed_mps * _CHANGE_S)
        if room < _CHANGE_LEAST_M * 0.6:
            return
        way = min(way, max(room, _CHANGE_LEAST_M * 0.6))
        if not self._gaps.accepts(seen, other):
            return
        rear = Pose(ego.x_m, ego.y_m, ego.heading_rad).ahead(-self._chassis.rear_to_middle_m)
        first = blended(stretch.line, (rear.x_m, rear.y_m), other.line, self._station, way, first_m(other))
        self._stretch = Stretch.of(other.lanes, layer, self._corridor.route.goal_m if other.goal else None, first)
        self._station = self._rear_station(ego, 0.0, 10.0)
        self._changing_to = first.length_m - 2.0
        self._meetings = self._met(seen)

    def _beside_until(self, at: int, other: Stretch) -> float:
        """Station up to which another line runs beside this one, from a lane of this one on: a road is cut into
        sections, and who waits just before a seam has room beyond it."""
        stretch = self._stretch
        first_end = end = stretch.span(at)[1]
        for own, beside in zip(range(at + 1, len(stretch.lanes)), other.lanes[1:], strict=False):
            lane = stretch.lanes[own]
            if lane.junction or beside is lane or not self._road.places_between(lane.id, beside.id):
                break
            end = stretch.span(own)[1]
        return min(end, first_end + _SEAM_M)

    def _beside(self, lane: LaneId, changes: object, setpoints: Setpoints) -> LaneId | None:
        """The lane beside that is to be changed into: as the route needs, else as is wished."""
        assert isinstance(changes, dict)
        own = changes.get(lane, 0)
        sides = [one for side in (-1, 1) if (one := self._road.neighbour(lane, side)) in changes]
        better = [one for one in sides if changes[one] < own]
        if better:
            return better[0]
        wish = self._road.get(setpoints.target_lane)
        if wish is None or wish.id == lane or wish.road != self._road[lane].road:
            return None
        side = 1 if wish.index > self._road[lane].index else -1
        beside = self._road.neighbour(lane, side)
        if beside not in changes or changes[beside] > own:
            return None  # the route would be missed
        return beside

    # Speed ------------------------------------------------------------------------------------------------------------

    def _acceleration(self, seen: Observation, setpoints: Setpoints) -> float:
        ego, stretch = seen.ego, self._stretch
        speed, nose = ego.speed_mps, self._station + self.nose_m
        idm = replace(TOWN_IDM, time_headway_s=max(0.8, setpoints.time_headway_s))
        limit = float(stretch.most_mps[stretch.index(self._station + 0.3 * speed)])
        target = max(0.0, min(limit, _finite(setpoints.target_speed_mps, limit)))
        target = self._slow_for_people(seen, target)
        least = free_acceleration(speed, max(target, 0.05), idm)
        if speed > target:
            least = max(-3.0, (target - speed) / 0.8)
        elif target <= 0.0:
            least = -1.0  # who is to stand does not creep
        self.why = ""
        self.lets_go_first = False
        stops = self._stops(seen, nose)
        follows = replace(idm, jam_distance_m=_CLOSE_M) if self._stop_lines.tail_over else idm
        for meeting in self._meetings:
            if meeting.now and (meeting.along or meeting.along_mps > -0.5 or meeting.other.speed_mps < 0.5):
                gap = meeting.first_m - nose
                if meeting.last_m < nose or gap < -self._chassis.length_m:
                    continue  # beside or behind: to stand there would not help
                lead = max(0.0, meeting.along_mps) if meeting.along else 0.0
                asked = idm_acceleration(speed, max(target, 0.05), follows, max(gap, 0.05), speed - lead)
                if asked < least:
                    least, self.why = asked, f"behind {meeting.other.kind} {meeting.other.id}"
            else:
                stop = self._yields(meeting, nose, speed, target)
                if stop is not None:
                    self.lets_go_first = True
                    stops += [stop, *self._stop_lines.before_yellow(nose, speed)]
        for stop in stops:
            asked = _stopping(speed, stop.at_m - nose, idm)
            if asked < least:
                least, self.why = asked, stop.why
        if speed < 0.3 and least < 0.0:
            least = min(least, -1.0)
        return max(-_MOST_BRAKING_MPS2, min(idm.acceleration_mps2, least))

    def _slow_for_people(self, seen: Observation, target: float) -> float:
        """Slower past people who stand, or come, close to the line."""
        for other in seen.others:
            if other.kind != "pedestrian":
                continue
            ahead, aside = Pose(seen.ego.x_m, seen.ego.y_m, seen.ego.heading_rad).sees(other.x_m, other.y_m)
            if not 0.0 < ahead < 25.0 or abs(aside) > 12.0:
                continue
            station = self._stretch.line.nearest(other.x_m, other.y_m, self._station, self._station + 30.0)
            pose = self._stretch.line.at(station)
            off = pose.sees(other.x_m, other.y_m)[1]
            towards = -math.copysign(1.0, off) * other.speed_mps * math.sin(other.heading_rad - pose.heading_rad)
            waits = other.speed_mps < 0.2 and abs(off) < _WAITS_M
            if waits or abs(off) < _KERB_M or (towards > 0.3 and abs(off) < 6.0):
                target = min(target, _PEOPLE_MPS)
        return target

    # Stops ------------------------------------------------------------------------------------------------------------

    def _stops(self, seen: Observation, nose: float) -> list[StopPoint]:
        """Stop points for the end of the line, lights, signs, and a blocked junction."""
        stretch = self._stretch
        stops = [StopPoint(stretch.end_m - _ROOM_M, "room to change lanes")]
        if stretch.goal:
            stops = [StopPoint(stretch.end_m + self._chassis.length_m / 2.0, "the goal")]
        stops += self._stop_lines.stops(seen, stretch, self._station, nose, self._meetings)
        at, _ = stretch.lane_at(self._station - 2.0)
        for i in range(at, len(stretch.lanes)):
            start, end = stretch.span(i)
            if start > nose + SIGHT_M:
                break
            lane = stretch.lanes[i]
            if lane.junction and start > nose - 0.5 and self._road.conflicts(lane.id):
                blocked = self._blocked(i, start, end)
                if blocked is not None:
                    stops.append(self._stop_lines.clear_of_lines(blocked, nose, seen.ego.speed_mps))
        return stops

    def _wait_line(self, i: int) -> float:
        """Waiting point before a junction: its stop line, else its edge."""
        start, _ = self._stretch.span(i)
        return start - 0.5

    def _blocked(self, i: int, start: float, end: float) -> StopPoint | None:
        """A stop before a junction that could be entered, but not be left."""
        needed = end + self._chassis.length_m + 2.5
        for meeting in self._meetings:
            if meeting.now and meeting.along and start < meeting.first_m < needed and meeting.along_mps < 1.5:
                return StopPoint(self._wait_line(i), "the junction is not clear")
        return None

    # Others -----------------------------------------------------------------------------------------------------------

    def _met(self, seen: Observation) -> list[Meeting]:
        ego, stretch = seen.ego, self._stretch
        reach = min(NEAR_M, 22.0 + 3.0 * ego.speed_mps)
        low = stretch.index(self._station - 1.0)
        high = stretch.index(self._station + self.nose_m + reach) + 1
        here = Pose(ego.x_m, ego.y_m, ego.heading_rad)
        own = self._road.get(ego.lane)
        around: list[VehicleState] = []
        for other in (*seen.others, *seen.objects):
            if other.kind == "stop_sign":
                continue
            ahead, aside = here.sees(other.x_m, other.y_m)
            if ahead * ahead + aside * aside > (reach + 10.0 + COMING_S * other.speed_mps) ** 2:
                continue
            beside = 2.2 if self._changing_to is None else _LANE_BESIDE_M
            behind = ahead < -(ego.length_m + other.length_m) / 2.0 and abs(aside) < beside
            if behind and math.cos(other.heading_rad - ego.heading_rad) > 0.7:
                continue  # who follows minds us; so does who comes up in the lane that is changed into
            if own is not None and other.speed_mps < 0.15 and ahead < -ego.length_m:
                continue
            around.append(other)
        x, y, wider = stretch.swept(self.nose_m)
        line = x[low:high], y[low:high], stretch.heading[low:high]
        half = self._chassis.width_m / 2.0 + _SIDE_M
        return self._foresight.meetings(seen, around, line, float(low), half + wider[low:high])

    def _yields(self, meeting: Meeting, nose: float, speed: float, target: float) -> StopPoint | None:
        """Stop point for an agent whose way crosses, unless one is through before the other comes."""
        person = meeting.other.kind == "pedestrian"
        before = _BEFORE_PERSON_M if person else _BEFORE_M
        at = meeting.first_m - before
        tail = self._chassis.length_m
        if meeting.first_m < nose - 0.5 and not (person and meeting.last_m > nose):
            if meeting.last_m < nose or meeting.along:
                return None  # in the lane of somebody who comes up from behind: to stand there is worst
            if meeting.other.speed_mps < _GIVES_WAY_MPS:
                return None  # in their way already, and they wait for it: be gone
        pace = max(target, 1.0)
        arrives = _time_to(meeting.first_m - nose - 0.5, speed, pace)
        clears = _time_to(meeting.last_m + tail + 1.0 - nose, speed, pace)
        margin = _CLEAR_S + (0.8 if person else 0.0)
        if clears + margin < meeting.enters_s:
            return None
        if not meeting.along and arrives > meeting.leaves_s + _AFTER_S and meeting.leaves_s < 5.5:
            return None
        if meeting.along and meeting.other.speed_mps < 0.15:
            return None
        line = self._waiting(nose, at)
        return StopPoint(line, f"letting {meeting.other.kind} {meeting.other.id} go first")

    def _waiting(self, nose: float, at: float) -> float:
        """Waiting point: before the junction where there would be no room behind its line."""
        stretch = self._stretch
        i, lane = stretch.lane_at(max(at, 0.0))
        if not lane.junction:
            return at
        while i > 0 and stretch.lanes[i - 1].junction:
            i -= 1
        start = self._wait_line(i)
        if start > nose - 0.3 and at < start + self._chassis.length_m + 3.0:
            return min(start, at)
        return at


def _finite(value: float | None, otherwise: float) -> float:
    return value if value is not None and math.isfinite(value) else otherwise


def _time_to(way_m: float, speed: float, pace: float) -> float:
    """Time for a way, accelerating up to a pace."""
    if way_m <= 0.0:
        return 0.0
    if speed >= pace:
        return way_m / max(speed, 0.1)
    gain = (pace - speed) / _ACCELERATING_MPS2
    covered = (speed + pace) / 2.0 * gain
    if covered >= way_m:
        return (-speed + math.sqrt(speed * speed + 2.0 * _ACCELERATING_MPS2 * way_m)) / _ACCELERATING_MPS2
    return gain + (way_m - covered) / pace


def _stopping(speed: float, gap_m: float, idm: IdmParameters) -> float:
    """Acceleration that stops within a distance: comfortably where that does, else as hard as is needed."""
    if gap_m <= 0.15:
        return -_MOST_BRAKING_MPS2 if speed > 0.5 else -2.0
    needed = speed * speed / (2.0 * gap_m)
    if needed > idm.deceleration_mps2:
        return -1.1 * needed
    return idm_acceleration(speed, 1e3, replace(idm, jam_distance_m=0.6, time_headway_s=0.3), gap_m + 0.5, speed)
