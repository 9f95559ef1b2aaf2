"""The driving APIs of towns at run time: lights, signs, people, junctions, places, and the paper's stop and proceed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final, cast

from chauffeur.concept import STOP_ZONE_M, DataError, Setpoints
from chauffeur.language.ground import ground, reference_of
from chauffeur.programs.binding import DrivingApis
from chauffeur.programs.catalogue import NOTHING_AHEAD_M, Api, apis_of
from chauffeur.programs.errors import BadArgumentValueError
from chauffeur.worlds.base import EGO, Driver, StreetPerception

_MOVES_MPS: Final = 0.3
_OFF_WAY_M: Final = 2.5
"""A road user whose middle is so far beside the way has left it."""
_FAR_M: Final = 60.0
_BEHIND_M: Final = 3.0
"""Gap in which one stands behind or before a vehicle: its tyres are seen, and it can still be driven round."""
_BEFORE_WAY_M: Final = 3.5
_BEFORE_JUNCTION_M: Final = 1.0
_BRAKES_MPS2: Final = 1.2
_CREEP_MPS: Final = 0.8
_THERE_M: Final = 0.35


class TownApis(DrivingApis):
    """The APIs as a program in a town sees them."""

    def __init__(
        self, perception: StreetPerception, driver: Driver, setpoints: Setpoints, *, stop_zone_m: float = STOP_ZONE_M
    ) -> None:
        """See DrivingApis."""
        super().__init__(perception, driver, setpoints, stop_zone_m=stop_zone_m)
        self._came_from: dict[int, float] = {}
        """On which side of the way a road user was when it was first asked about: +1 left, -1 right."""

    @property
    def apis(self) -> Mapping[str, Api]:
        """See DrivingApis."""
        return apis_of("town")

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

    # Road users -------------------------------------------------------------------------------------------------------

    def _agent(self, label: float) -> int | None:
        try:
            return self._street.vehicle(int(label)).id
        except KeyError:
            return None

    def _see(self, kind: str, colour: str, state: str, side: str) -> int | None:
        try:
            meant = reference_of(kind, colour, state, side)
        except DataError as error:
            raise BadArgumentValueError(f"see: {error}") from None
        found = [
            one for one in ground(meant, self._street.look()).targets if one.kind == "agent" and one.forward_m > 0.0
        ]
        return found[0].agent if found else None

    def _in_sight(self, veh: int | None) -> bool:
        try:
            return veh is not None and self._street.vehicle(veh).id == veh
        except KeyError:
            return False

    def _get_distance_to(self, veh: int) -> tuple[bool, float]:
        ahead_m, _, _ = self._street.on_way(veh)
        near_m = ahead_m - self._street.vehicle(veh).length_m / 2.0
        return (True, max(0.0, near_m)) if ahead_m > 0.0 else (False, NOTHING_AHEAD_M)

    def _is_moving(self, veh: int) -> bool:
        return self._street.vehicle(veh).speed_mps > _MOVES_MPS

    def _has_gone(self, veh: int | None) -> bool:
        if veh is None or not self._in_sight(veh):
            return True
        ahead_m, aside_m, leftward_mps = self._street.on_way(veh)
        came_from = self._came_from.setdefault(veh, math.copysign(1.0, aside_m))
        if self._behind(veh, ahead_m) or ahead_m > _FAR_M:
            return True
        away = abs(aside_m) > _OFF_WAY_M and aside_m * leftward_mps > 0.0 and abs(leftward_mps) > _MOVES_MPS
        return away or aside_m * came_from < -_OFF_WAY_M

    def _has_passed(self, veh: int | None) -> bool:
        return veh is None or not self._in_sight(veh) or self._behind(veh, self._street.on_way(veh)[0])

    def _behind(self, veh: int, ahead_m: float) -> bool:
        return ahead_m < -self._street.vehicle(EGO).length_m - self._street.vehicle(veh).length_m / 2.0

    def _is_clear(self) -> bool:
        return self._street.is_clear()

    def _follow_agent(self, veh: int) -> list[float]:
        street = self._street
        turn, lane = street.turn_after(veh), street.lane_after(veh)
        if turn is not None:
            self.setpoints = replace(self.setpoints, turn=turn)
        elif lane is not None:
            self.setpoints = replace(self.setpoints, target_lane=lane)
        return self._at(self._get_speed_limit())

    def _stop_behind(self, veh: int) -> list[float]:
        return self._stop_at(veh, -self._street.vehicle(veh).length_m / 2.0 - _BEHIND_M)

    def _stop_beside(self, veh: int) -> list[float]:
        return self._stop_at(veh, self._street.vehicle(EGO).length_m / 2.0)

    def _stop_beyond(self, veh: int) -> list[float]:
        own_m = self._street.vehicle(EGO).length_m
        return self._stop_at(veh, self._street.vehicle(veh).length_m / 2.0 + _BEHIND_M + own_m)

    def _stop_at(self, veh: int, beyond_m: float) -> list[float]:
        """Come to a stand with the front bumper so far beyond the middle of a road user, along the way."""
        return self._within(self._street.on_way(veh)[0] + beyond_m)

    def _give_way_to(self, veh: int) -> list[float]:
        street = self._street
        at_m = street.crosses_at(veh)
        junction = street.junction_ahead()
        if at_m is None or at_m < -_BEHIND_M:
            return self._at(self._get_speed_limit())
        if street.vehicle(veh).kind != "pedestrian" and junction is not None and junction[0] < at_m:
            return self._within(junction[0] - _BEFORE_JUNCTION_M)
        return self._within(at_m - _BEFORE_WAY_M)

    def _within(self, left_m: float) -> list[float]:
        """The speed from which the ego comes to a stand comfortably on so much of its way."""
        if left_m < _THERE_M:
            return self._at(0.0)
        return self._at(min(self._get_speed_limit(), max(_CREEP_MPS, math.sqrt(2.0 * _BRAKES_MPS2 * left_m))))

    def _encode(self, api: Api, result: Any) -> Any:
        if isinstance(result, tuple):  # numbers, flags and words of ours: nothing to hand out
            return cast("tuple[Any, ...]", result)
        return super()._encode(api, result)
