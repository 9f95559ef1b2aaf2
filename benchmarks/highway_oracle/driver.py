"""The low-level driver of LaMPilot's roads: IDM along the lane, lane keeping across it, route following at its end."""

from __future__ import annotations

from dataclasses import replace

from chauffeur.concept import Command, LaneId, Setpoints, Turn
from chauffeur.control import (
    LAMPILOT_STEERING,
    full_scale,
    lane_keeping_steering,
)
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway.driver import route_of
from chauffeur.worlds.highway.network import LaneKey
from highway_oracle.perception import ReferencePerception
from highway_oracle.scenes import Scene, key_of, name_of


class ReferenceDriver:
    """LaMPilot's autopilot. Its only state is the route, planned when a turn is first wished."""

    def __init__(self, scene: Scene, perception: ReferencePerception) -> None:
        self._scene = scene
        self._perception = perception
        self._turn: Turn | None = None
        self._route: list[LaneKey] = []

    def initial_setpoints(self) -> Setpoints:
        """Keep the present speed and lane."""
        ego = self._scene.ego
        return Setpoints(target_speed_mps=float(ego.speed), target_lane=name_of(ego.lane_index))

    def settle(self, setpoints: Setpoints) -> Setpoints:
        """Wishes with defaults filled in and the lane moved on to the next one where it ends."""
        start = self.initial_setpoints()
        speed = start.target_speed_mps if setpoints.target_speed_mps is None else setpoints.target_speed_mps
        lane = setpoints.target_lane or start.target_lane
        assert lane is not None
        if setpoints.turn is not None and setpoints.turn != self._turn:
            self._plan_route(setpoints.turn)
        ego, network = self._scene.ego, self._scene.road.network
        if network.get_lane(key_of(lane)).after_end(ego.position):
            lane = name_of(network.next_lane(key_of(lane), route=self._route, position=ego.position))
        if speed == setpoints.target_speed_mps and lane == setpoints.target_lane:
            return setpoints
        return replace(setpoints, target_speed_mps=speed, target_lane=lane)

    def command(self, setpoints: Setpoints) -> Command:
        """Acceleration and steering for settled wishes, after LaMPilot's full-scale mapping (control/actuation.py)."""
        actuation = self._scene.actuation
        acceleration, steering = self.controls(setpoints)
        return Command(
            acceleration_mps2=full_scale(acceleration, actuation.max_acceleration_mps2),
            steering_rad=0.0 - full_scale(steering, actuation.max_steering_rad),  # highway-env's is to the right
        )

    def controls(self, setpoints: Setpoints) -> tuple[float, float]:
        """IDM acceleration, m/s2, and lane-keeping steering angle, rad, before the full-scale mapping."""
        assert setpoints.target_speed_mps is not None
        assert setpoints.target_lane is not None
        return self._longitudinal(setpoints, setpoints.target_speed_mps), self._lateral(setpoints.target_lane)

    def _longitudinal(self, setpoints: Setpoints, target_speed_mps: float) -> float:
        blocker = self._perception.front_blocker(setpoints.served_stops)
        return self._perception.idm(EGO, blocker, target_speed_mps, setpoints.time_headway_s)

    def _lateral(self, lane: LaneId) -> float:
        ego = self._scene.ego
        geometry = self._scene.road.network.get_lane(key_of(lane))
        s, offset = geometry.local_coordinates(ego.position)
        heading_ahead = geometry.heading_at(s + ego.speed * LAMPILOT_STEERING.preview_s)
        return lane_keeping_steering(
            float(ego.speed), float(ego.heading), float(offset), float(heading_ahead), LAMPILOT_STEERING
        )

    def _plan_route(self, turn: Turn) -> None:
        self._turn = turn
        here = key_of(name_of(self._scene.ego.lane_index))
        legs = route_of(self._scene.road.network, here[:2], turn)
        self._route = [here, *((a, b, 0) for a, b in legs[1:])]
