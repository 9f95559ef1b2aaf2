"""The driving APIs of towns at run time: lights, signs, people, junctions, places, and the paper's stop and proceed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, cast

from chauffeur.concept import STOP_ZONE_M, Setpoints
from chauffeur.programs.binding import DrivingApis
from chauffeur.programs.catalogue import NOTHING_AHEAD_M, TOWN_APIS, Api
from chauffeur.worlds.base import Driver, StreetPerception


class TownApis(DrivingApis):
    """The APIs as a program in a town sees them."""

    def __init__(
        self, perception: StreetPerception, driver: Driver, setpoints: Setpoints, *, stop_zone_m: float = STOP_ZONE_M
    ) -> None:
        """See DrivingApis."""
        super().__init__(perception, driver, setpoints, stop_zone_m=stop_zone_m)

    @property
    def apis(self) -> Mapping[str, Api]:
        """See DrivingApis."""
        return TOWN_APIS

    @property
    def _street(self) -> StreetPerception:
        return cast("StreetPerception", self._perception)

    def _check_front_vehicle(self) -> tuple[bool, float, float]:
        ahead = self._street.gap_ahead()
        return (False, NOTHING_AHEAD_M, 0.0) if ahead is None else (True, *ahead)

    def _check_speed_limit(self) -> float:
        return self._get_speed_limit()

    def _check_traffic_light(self) -> tuple[str, float]:
        return self._street.light_ahead() or ("none", NOTHING_AHEAD_M)

    def _check_stop_sign(self) -> tuple[bool, float]:
        sign = self._street.stop_sign_ahead(self.setpoints.served_stops)
        return (False, NOTHING_AHEAD_M) if sign is None else (True, sign[1])

    def _check_people(self) -> tuple[bool, float]:
        ahead_m = self._street.person_ahead()
        return (False, NOTHING_AHEAD_M) if ahead_m is None else (True, ahead_m)

    def _get_distance_to_junction(self) -> float:
        junction = self._street.junction_ahead()
        return NOTHING_AHEAD_M if junction is None else junction[0]

    def _can_go(self, side: str) -> bool:
        junction = self._street.junction_ahead()
        return junction is not None and side.strip().casefold() in junction[1]

    def _get_distance_to_place(self, name: str) -> float:
        ahead_m = self._street.place_ahead(name)
        return -1.0 if ahead_m is None else ahead_m

    def _change_lane_left(self) -> bool:
        return self._change_lane(-1)

    def _change_lane_right(self) -> bool:
        return self._change_lane(1)

    def _change_lane(self, side: int) -> bool:
        beside = self._street.lane_beside(side)
        if beside is None:
            return False
        self.setpoints = replace(self.setpoints, target_lane=beside)
        return True

    def _stop(self) -> list[float]:
        return self._at(0.0)

    def _proceed(self, speed: float) -> list[float]:
        return self._at(speed)

    def _at(self, speed_mps: float) -> list[float]:
        self.setpoints = replace(self.setpoints, target_speed_mps=speed_mps)
        return [speed_mps]

    def _encode(self, api: Api, result: Any) -> Any:
        if isinstance(result, tuple):  # numbers, flags and words of ours: nothing to hand out
            return cast("tuple[Any, ...]", result)
        return super()._encode(api, result)
