"""Quantities that goals, scores and baselines read of a highway world, beyond the driving APIs."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from chauffeur.concept import LaneId, VehicleState
from chauffeur.worlds.base import Perception


class Instant(NamedTuple):
    """The ego at one instant.

    Attributes:
        speed_mps, heading_rad: Its motion.
        x_m, y_m: Its centre.
        lane: Its closest lane.
        front: Vehicle or obstacle ahead in that lane, at any distance; None for none.
        gap_m: Centre-to-centre distance to it along the lane; nan for none.
        front_speed_mps: Its speed; nan for none.
        crashed, on_road: Collision flag; whether the centre is on the lane.
        past_end: Off the road because it ended, not sideways.
        ttc_along_s: Least time to collision as LaMPilot's code has it; -1 for none.
        ttc_plane_s: Least time to the closest approach (paper Eq. 1); -1 for none.
        ttc_lane_s: Least bumper-to-bumper time to collision in the ego's lane or overlapping it; -1 for none.
    """

    speed_mps: float
    heading_rad: float
    x_m: float
    y_m: float
    lane: LaneId
    front: int | None
    gap_m: float
    front_speed_mps: float
    crashed: bool
    on_road: bool
    past_end: bool
    ttc_along_s: float
    ttc_plane_s: float
    ttc_lane_s: float


class RoadPerception(Perception, Protocol):
    """A highway world's perception, compiled or reference."""

    @property
    def emergency_lanes(self) -> frozenset[LaneId]:
        """Lanes for cars in distress only."""
        ...

    def instant(self) -> Instant:
        """The ego now."""
        ...

    def others(self) -> tuple[VehicleState, ...]:
        """Every vehicle and object but the ego."""
        ...

    def reachable(self, lane: LaneId) -> bool:
        """True if the ego may change to a lane from where it is."""
        ...

    def distance_on(self, lane: LaneId, to_id: int) -> float:
        """Signed distance from the ego to another along a given lane, m."""
        ...

    def lane_heading(self, lane: LaneId) -> float:
        """Heading of a lane where the ego is along it, rad."""
        ...

    def idm(self, follower_id: int, leader_id: int | None, target_speed_mps: float, time_headway_s: float) -> float:
        """IDM acceleration, m/s2, of one behind another (None: free road), with LaMPilot's ego parameters."""
        ...

    def traffic_idm(self, follower_id: int, leader_id: int | None) -> float | None:
        """Acceleration, m/s2, that a car of the traffic would choose behind another; None if it is no such car."""
        ...
