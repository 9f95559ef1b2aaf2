"""The low-level driver of LaMPilot's roads: IDM along the lane, lane keeping across it, route following at its end."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

from chauffeur.concept import Command, Setpoints, Turn
from chauffeur.control import Actuation, full_scale
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway.core import CoreRoad
from chauffeur.worlds.highway.core import layout as at
from chauffeur.worlds.highway.network import LaneNetwork
from chauffeur.worlds.highway.perception import HighwayPerception

DESTINATIONS: dict[Turn, str] = {"left": "o1", "straight": "o2", "right": "o3"}


def route_of(network: LaneNetwork, here: tuple[str, str], turn: Turn) -> list[tuple[str, str]]:
    """Roads of the shortest way to the exit of a turn, the present one first; only that one where there is none."""
    return [here, *pairwise(network.shortest_path(here[1], DESTINATIONS[turn]))]


class HighwayDriver:
    """LaMPilot's autopilot. Its only state is the route, planned when a turn is first wished."""

    def __init__(
        self, core: CoreRoad, perception: HighwayPerception, actuation: Actuation, network: LaneNetwork
    ) -> None:
        self._core = core
        self._perception = perception
        self._actuation = actuation
        self._network = network
        self._turn: Turn | None = None

    def initial_setpoints(self) -> Setpoints:
        """Keep the present speed and lane."""
        speed = float(self._core.floats[EGO, at.SPEED])
        return Setpoints(target_speed_mps=speed, target_lane=self._perception.lane_of(EGO))

    def settle(self, setpoints: Setpoints) -> Setpoints:
        """Wishes with defaults filled in and the lane moved on to the next one where it ends."""
        speed = setpoints.target_speed_mps
        if speed is None:
            speed = float(self._core.floats[EGO, at.SPEED])
        lane = setpoints.target_lane or self._perception.lane_of(EGO)
        if setpoints.turn is not None and setpoints.turn != self._turn:
            self._plan_route(setpoints.turn)
        road = self._core.road
        row = road.rows[lane]
        onward = self._core.next_lane(row)
        if onward == row and speed == setpoints.target_speed_mps and lane == setpoints.target_lane:
            return setpoints
        return replace(setpoints, target_speed_mps=speed, target_lane=road.lane_ids[onward])

    def command(self, setpoints: Setpoints) -> Command:
        """Acceleration and steering for settled set-points by LaMPilot's full-scale mapping (control/actuation.py)."""
        assert setpoints.target_speed_mps is not None
        assert setpoints.target_lane is not None
        blocker = self._perception.front_blocker(setpoints.served_stops)
        acceleration = self._perception.idm(EGO, blocker, setpoints.target_speed_mps, setpoints.time_headway_s)
        steering = self._core.steer(self._core.road.rows[setpoints.target_lane])
        return Command(
            acceleration_mps2=full_scale(acceleration, self._actuation.max_acceleration_mps2),
            steering_rad=0.0 - full_scale(steering, self._actuation.max_steering_rad),  # the core's is to the right
        )

    def _plan_route(self, turn: Turn) -> None:
        self._turn = turn
        road = self._core.road
        start, end, _ = road.keys[road.rows[self._perception.lane_of(EGO)]]
        legs = route_of(self._network, (start, end), turn)
        self._core.plan_route([road.road_rows[leg] for leg in legs])

    def copy(self, core: CoreRoad, perception: HighwayPerception) -> HighwayDriver:
        """The same driver for a copy of the road."""
        twin = HighwayDriver(core, perception, self._actuation, self._network)
        twin._turn = self._turn
        return twin
