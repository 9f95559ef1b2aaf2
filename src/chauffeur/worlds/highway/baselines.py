"""LaMPilot's MOBIL baseline: lane choice without any instruction (paper Tab. IV, rows IDM and MOBIL).

The IDM baseline needs no code: it is the driver with its initial set-points.
"""

from __future__ import annotations

from dataclasses import replace

from chauffeur.concept import LaneId, Setpoints
from chauffeur.control import LAMPILOT_EGO, LaneChangeOutlook, MobilParameters, should_change
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway.instant import RoadPerception


class MobilBaseline:
    """Chooses the target lane by MOBIL each period.

    As in LaMPilot, a target lane without a vehicle ahead is judged by the vehicle ahead in the present lane, forbidden
    lanes count as lanes, and there is no delay between changes.
    """

    def __init__(self, perception: RoadPerception, parameters: MobilParameters | None = None) -> None:
        self._perception = perception
        self._parameters = parameters or MobilParameters()

    def choose(self, setpoints: Setpoints) -> Setpoints:
        """Settled set-points with the lane MOBIL prefers."""
        here = self._perception.lane_of(EGO)
        for offset in (-1, 1):
            lane = self._perception.adjacent_lane(here, offset)
            if lane is not None and should_change(self._outlook(lane, setpoints), self._parameters):
                setpoints = replace(setpoints, target_lane=lane)
        return setpoints

    def _outlook(self, lane: LaneId, setpoints: Setpoints) -> LaneChangeOutlook:
        new_front, new_rear = self._perception.neighbours(lane)
        old_front, _ = self._perception.neighbours(self._perception.lane_of(EGO))
        follower_now = follower_after = None
        if new_rear is not None:
            follower_now = self._perception.traffic_idm(new_rear, new_front)
            follower_after = self._perception.traffic_idm(new_rear, EGO)
        return LaneChangeOutlook(
            own_now=self._own(old_front, setpoints),
            own_after=self._own(new_front, setpoints),
            follower_now=follower_now,
            follower_after=follower_after,
        )

    def _own(self, front: int | None, setpoints: Setpoints) -> float:
        assert setpoints.target_speed_mps is not None
        blocker = self._perception.front_blocker(setpoints.served_stops) if front is None else front
        return self._perception.idm(EGO, blocker, setpoints.target_speed_mps, LAMPILOT_EGO.time_headway_s)
