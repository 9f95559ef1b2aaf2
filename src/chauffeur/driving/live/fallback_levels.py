"""What is driven when no fresh set-points come: fallback levels down to a minimal-risk manoeuvre, one at a time.

follow  the policy's set-points are fresh
hold    they are not, but the plan they come from was checked and has not expired: they go on for a moment
keep    stay in the lane, no faster than now, with a generous gap
slow    slow down, and make for the shoulder where the road has one
stop    stand

Ages are counted in the vehicle's own time. A fresh wish leads back to the top at once; a plan that failed or expired
skips the level that would hold its set-points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from chauffeur.concept import LaneId, Observation, Setpoints
from chauffeur.concept.units import MPS_PER_KMH
from chauffeur.driving.fallback import keep_lane_and_gap
from chauffeur.driving.live.messages import FallbackLevel, LiveSetpoints

FALLBACK_LEVELS: Final[tuple[FallbackLevel, ...]] = ("follow", "hold", "keep", "slow", "stop")


@dataclass(frozen=True, slots=True)
class FallbackTimings:
    """When the next lower level is taken.

    Attributes:
        fresh_s: Oldest wish that is followed as it is: three control periods at 10 Hz.
        hold_s: How long a wish is held: what a policy process needs to be started anew.
        keep_s: How long lane and gap are kept after that.
        slow_s: How long the car is slow at most before it stops.
        slow_mps: Speed of the level `slow`, 30 km/h.
    """

    fresh_s: float = 0.3
    hold_s: float = 2.0
    keep_s: float = 6.0
    slow_s: float = 10.0
    slow_mps: float = 30.0 * MPS_PER_KMH


class FallbackLevels:
    """Chooses the level, period by period."""

    def __init__(self, table: FallbackTimings | None = None) -> None:
        self._table = FallbackTimings() if table is None else table
        self._entered_s: float | None = None
        """When the set-points were let go of, in vehicle time."""
        self._kept_mps = 0.0

    @property
    def patience_s(self) -> float:
        """How long a wish is held, and how long a first one is waited for."""
        return self._table.hold_s

    def choose(
        self, at_s: float, wish: LiveSetpoints | None, age_s: float, observation: Observation, *, expired: bool = False
    ) -> tuple[FallbackLevel, Setpoints]:
        """The level and its set-points.

        Args:
            at_s: Vehicle time.
            wish: The newest one heard in this trip.
            age_s: Its age.
            observation: The instant.
            expired: Whether its plan may not be followed any more.
        """
        table = self._table
        usable = wish is not None and not expired and wish.state != "failed"
        if wish is not None and usable and age_s <= table.hold_s:
            self._entered_s = None
            return ("follow" if age_s <= table.fresh_s else "hold"), wish.setpoints
        if self._entered_s is None:
            self._entered_s, self._kept_mps = at_s, max(0.0, observation.ego.speed_mps)
        base = Setpoints() if wish is None else wish.setpoints
        gone_s = at_s - self._entered_s
        wished = base.target_speed_mps
        speed = self._kept_mps if wished is None else min(wished, self._kept_mps)
        safe = keep_lane_and_gap(base, speed, observation.ego.lane)
        if gone_s < table.keep_s:
            return "keep", safe
        lane = _towards_shoulder(observation)
        slow = observation.ego.speed_mps <= table.slow_mps + 0.5
        if gone_s < table.keep_s + table.slow_s and not (slow and lane == observation.ego.lane):
            return "slow", replace(safe, target_speed_mps=min(speed, table.slow_mps), target_lane=lane)
        return "stop", replace(safe, target_speed_mps=0.0, target_lane=lane)


def _towards_shoulder(observation: Observation) -> LaneId | None:
    """The next lane on the way to an emergency lane beside; the ego's own where there is none."""
    own = observation.ego.lane
    if own is None:
        return None
    steps = [
        step
        for lane in observation.road.abreast(own)
        if lane.emergency and (step := observation.road.places_between(own, lane.id)) is not None
    ]
    nearest = min(steps, key=abs, default=0)
    return own if nearest == 0 else observation.road.neighbour(own, 1 if nearest > 0 else -1)
