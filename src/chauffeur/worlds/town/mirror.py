"""A copy of a town for another process, which has its map and no simulator."""

from __future__ import annotations

from typing import NoReturn

from chauffeur.concept import Command, DataError, Observation, Scenario, ScenarioError, VehicleState
from chauffeur.control.kinematic_bicycle import LINCOLN_MKZ
from chauffeur.worlds.base import EGO
from chauffeur.worlds.town.instant import TownInstant
from chauffeur.worlds.town.scene import TownScene


class TownMirror(TownScene):
    """A town never stepped: its trips begin as the simulated ones do, and go on by instants that it is shown."""

    def reset(self, scenario: Scenario, seed: int | None = None) -> Observation:
        """Start a trip, with no other agent in sight. Raises ScenarioError as the simulated town does."""
        trip = self._begin(scenario, seed)
        pose = trip.town.road[trip.start.lane].centre.at(trip.start.station_m)
        size = LINCOLN_MKZ.length_m, LINCOLN_MKZ.width_m
        speed = trip.config.ego_speed
        self._self = VehicleState(EGO, "car", pose.x_m, pose.y_m, pose.heading_rad, speed, *size, trip.start.lane)
        self._is_off, self._is_over = False, False
        self._take_seat()
        return self.observe()

    def mirror(self) -> TownMirror:
        """Another copy."""
        return TownMirror(self._given)

    def adopt(self, observation: bytes) -> None:
        """Be at an instant. Raises DataError if it is none of this trip; the copy then stays as it was."""
        instant = TownInstant.decode(observation)
        lanes = [instant.lane, instant.ego.lane, *(one.lane for one in instant.others)]
        if instant.ego.id != EGO or any(lane is not None and lane not in self.town.road for lane in lanes):
            raise DataError("An instant of another town.")
        try:
            self.driver().adopt(instant.course)
        except (KeyError, IndexError, ValueError) as error:
            raise DataError("A driver on roads of another town.") from error
        self._tick, self._self, self._others = instant.tick, instant.ego, instant.others
        self._lane, self._ego_station = instant.lane, instant.station_m
        self._is_off, self._is_over, self._forced = instant.off_road, instant.over, instant.forced
        self._place, self._stood = instant.place, instant.stood
        self._route = instant.course.route if instant.course.goal else None
        self._shown = None

    def step(self, command: Command) -> NoReturn:
        """Nothing: a copy only looks on. Raises ScenarioError."""
        del command
        raise ScenarioError("A copy of a town is not driven.", hint="Step the world that it copies.")

    def _ego(self) -> VehicleState:
        return self._self

    @property
    def _off_road(self) -> bool:
        return self._is_off

    @property
    def _over(self) -> bool:
        return self._is_over
