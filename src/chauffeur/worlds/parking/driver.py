"""The low-level driver of a lot: a path to where the wished lane is, followed with pure pursuit and a gap."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

from chauffeur.concept import Command, LaneId, Observation, Setpoints
from chauffeur.worlds.parking.lot import LIMIT_MPS
from chauffeur.worlds.parking.routes import Way
from chauffeur.worlds.path_follower import LOT_BEND_MPS2, Chassis, Follower, Look

OWN_LOOK: Final = Look(look_ahead_m=3.0, look_ahead_ratio_s=1.0)
"""Pure pursuit where nobody wishes for other parameters."""
JAM_M: Final = 1.0
"""Clear distance to somebody who stands."""


class ParkingDriver:
    """Drives to a wished lane; a spot is one. Its only state is the way there, taken anew if others drove meanwhile."""

    def __init__(
        self, chassis: Chassis, dt_s: float, now: Callable[[], Observation], way_to: Callable[[LaneId | None], Way]
    ) -> None:
        """Args: the car; its control period; the present instant; the way to a lane, or on along the present one."""
        self._follower = Follower(chassis, dt_s, jam_m=JAM_M, bend_mps2=LOT_BEND_MPS2)
        self._now = now
        self._way_to = way_to
        self._aim: tuple[LaneId | None] | None = None
        self._asked = 0

    def initial_setpoints(self) -> Setpoints:
        """Keep the present speed, and drive on: to the exit, where nothing else is wished."""
        return Setpoints(target_speed_mps=self._now().ego.speed_mps)

    def settle(self, setpoints: Setpoints) -> Setpoints:
        """Wishes with the present speed filled in, and no more than the lot allows."""
        speed = setpoints.target_speed_mps
        if speed is None:
            speed = self._now().ego.speed_mps
        speed = max(0.0, min(speed, LIMIT_MPS))
        return setpoints if speed == setpoints.target_speed_mps else replace(setpoints, target_speed_mps=speed)

    def command(self, setpoints: Setpoints) -> Command:
        """Acceleration and steering for settled set-points."""
        assert setpoints.target_speed_mps is not None
        observation = self._now()
        if self._aim != (setpoints.target_lane,) or observation.tick > self._asked + 1:
            self._aim = (setpoints.target_lane,)
            way = self._way_to(setpoints.target_lane)
            self._follower.take(way.path, way.room_m)
        self._asked = observation.tick
        others = (*observation.others, *observation.objects)
        return self._follower.command(
            observation.ego, others, OWN_LOOK, setpoints.target_speed_mps, setpoints.time_headway_s
        )
