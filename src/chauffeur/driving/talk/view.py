"""The road and the scene as a screen shows them: from what control shows every process, and from its report."""

from __future__ import annotations

from collections import OrderedDict
from typing import Final

from chauffeur.concept import DataError, LaneId, Observation, VehicleState
from chauffeur.concept.paint import css_colour
from chauffeur.concept.scene import stop_sign_of
from chauffeur.driving.live.messages import MessageError, MirroredInstant, Report
from chauffeur.driving.live.mirror import mirror_of
from chauffeur.driving.live.ring import Reader, Ring
from chauffeur.driving.live.settings import Settings
from chauffeur.driving.talk.messages import Road, RoadLane, Scene, ShownBody, ShownGoal, ShownLight
from chauffeur.driving.talk.seat_view import SeatWindow
from chauffeur.worlds.places import TownPlaces

_INSTANTS: Final = 100
"""Instants that are kept, 5 to 10 s of them: plans are judged a moment after they were seen."""
_LEAST_MPS: Final = 1.0
_TOWN_SHARE: Final = 2.0
"""Lights, turns and traffic double the time that the limits would allow."""


class View:
    """Follows a drive; each `look` says what is new."""

    def __init__(self, settings: Settings, observations: Ring) -> None:
        """Look on.

        Args:
            settings: Of the drive.
            observations: What control shows.
        """
        self._starts = settings.starts
        self._world = mirror_of(settings.starts[0].scenario)
        self._world.reset(self._starts[0].scenario, self._starts[0].seed)
        self._world.adopt(self._world.mirrored())  # what is slow the first time is done before anything moves
        self._world.observe()
        self._observations = Reader(observations, old=True)
        self._instants: OrderedDict[tuple[int, int], Observation] = OrderedDict()
        self._trip = 0

    def at(self, trip: int, tick: int) -> Observation | None:
        """An instant of the last seconds; None where it was not seen."""
        return self._instants.get((trip, tick))

    def offer(self, window: SeatWindow) -> None:
        """The newest instant to the view from the seat."""
        if self._instants:
            window.offer(self._world, self._starts[self._trip - 1].seed, next(reversed(self._instants.values())))

    def look(self, report: Report | None) -> tuple[Road | None, Scene | None]:
        """The road where it is another one, and the scene where there is a new one.

        Args:
            report: Control's newest.
        """
        before = self._trip
        seen: MirroredInstant | None = None
        # Every instant, and not the newest alone: a plan was judged in one of them.
        for message in self._observations.news()[0]:
            seen = self._follow(message.payload) or seen
        if seen is None:
            return None, None
        observation = self._instants[seen.trip, seen.tick]
        return (_road(observation) if self._trip != before else None), self._scene(seen, observation, report)

    def _follow(self, payload: bytes) -> MirroredInstant | None:
        """Be at an instant; None where it is none."""
        try:
            shown = MirroredInstant.decode(payload)
            if not 1 <= shown.trip <= len(self._starts):
                return None
            if shown.trip != self._trip:
                start = self._starts[shown.trip - 1]
                self._world.reset(start.scenario, start.seed)
            self._world.adopt(shown.world)
        except (MessageError, DataError):
            return None
        self._trip = shown.trip
        self._instants[shown.trip, shown.tick] = self._world.observe()
        while len(self._instants) > _INSTANTS:
            self._instants.popitem(last=False)
        return shown

    def _scene(self, seen: MirroredInstant, observation: Observation, report: Report | None) -> Scene:
        lane = observation.ego.lane
        limit = 0.0 if lane is None else self._world.perception().speed_limit(lane)
        told = report if report is not None and report.trip == seen.trip else None
        wished = None if told is None else observation.road.get(told.setpoints.target_lane)
        return Scene(
            time_s=round(seen.tick * self._world.dt_s, 3),
            taken_over=seen.handovers % 2 == 1,
            ego=_body(observation.ego),
            others=tuple(
                _body(each) for each in (*observation.others, *observation.objects) if each.kind != "stop_sign"
            ),
            acceleration_mps2=0.0 if told is None else told.applied.acceleration_mps2,
            steering_rad=0.0 if told is None else told.applied.steering_rad,
            limit_mps=limit,
            target_mps=None if told is None else told.setpoints.target_speed_mps,
            headway_s=0.0 if told is None else told.setpoints.time_headway_s,
            lane=None if told is None else told.setpoints.target_lane,
            place=None if wished is None else wished.index,
            level="hold" if told is None else told.level,
            wish="" if told is None else told.plan,
            line=None if told is None else told.line,
            shield="" if told is None else " ".join(change.reason for change in told.interventions),
            missed=0 if told is None else told.missed,
            lights=tuple(ShownLight(light.state, light.stop_line_m) for light in observation.signals),
            street=_street(observation),
            goal=self._goal(observation),
        )

    def _goal(self, observation: Observation) -> ShownGoal | None:
        there = self._world.destination() if isinstance(self._world, TownPlaces) else None
        if there is None:
            return None
        left_s = round(_left_s(observation, there.left_m), 1)
        return ShownGoal(there.name, there.x_m, there.y_m, round(there.left_m, 1), left_s, _ahead(observation))


def _body(state: VehicleState) -> ShownBody:
    return ShownBody(
        state.id,
        state.kind,
        state.x_m,
        state.y_m,
        state.heading_rad,
        state.length_m,
        state.width_m,
        state.speed_mps,
        None if state.colour is None else css_colour(state.colour),
    )


def _street(observation: Observation) -> str:
    """The name of the street; in a junction that of the one it leads into."""
    road, lane = observation.road, observation.road.get(observation.ego.lane)
    if lane is None or lane.street:
        return "" if lane is None else lane.street
    onward = road.onward(lane.id) if lane.junction else None
    return "" if onward is None else onward.street


def _road(observation: Observation) -> Road:
    lanes = tuple(
        RoadLane(
            lane.id,
            lane.width_m,
            lane.road,
            lane.index,
            lane.emergency,
            lane.centre.points_m,
            lane.kind,
            lane.junction,
            lane.street,
        )
        for lane in observation.road.lanes
    )
    signs = (stop_sign_of(one) for one in observation.objects if one.kind == "stop_sign")
    return Road(observation.kind, lanes, (*observation.signs, *signs))


def _left_s(observation: Observation, left_m: float) -> float:
    """How long a way takes at the limits of its lanes from here on, s; lights and traffic add to it."""
    route, road = observation.route, observation.road
    lanes = () if route is None else tuple(road[lane] for lane in _ahead(observation))
    length_m = sum(lane.length_m for lane in lanes)
    free_s = sum(lane.length_m / max(lane.speed_limit_mps, _LEAST_MPS) for lane in lanes)
    return left_m * free_s / length_m * _TOWN_SHARE if length_m else 0.0


def _ahead(observation: Observation) -> tuple[LaneId, ...]:
    """The lanes of the way from the ego's on; all of them where it is on none."""
    lanes = () if observation.route is None else observation.route.lanes
    here = observation.ego.lane
    return lanes[lanes.index(here) :] if here in lanes else lanes
