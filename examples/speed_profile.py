"""A policy kind of one's own, with what drives it: speeds to drive, each for the same time, in the lane as it is.

    [project.entry-points."chauffeur.executors"]
    speed-profile = "speed_profile:SpeedProfileExecutor"

With this in a package of yours, a planner may answer with a `SpeedProfile`. It passes the checks, is bounded by the
limits and watched by the shield like every other policy: only `fault` and the executor are yours to write.
"""

import math
from dataclasses import dataclass

from chauffeur.concept import Setpoints
from chauffeur.executors.base import DriverLed, HeldSetpoints

HEADWAY_S = 1.5


@dataclass(frozen=True)
class SpeedProfile:
    """Speeds, m/s, each driven for `period_s` seconds."""

    speeds_mps: tuple[float, ...]
    period_s: float
    kind: str = "speed-profile"


class SpeedProfileExecutor(DriverLed):
    """States the set-points of each period; the world's own driver follows them, and keeps the gap."""

    @staticmethod
    def fault(policy, observation, limits):
        """What is wrong with a policy of this kind, in words; empty for nothing. Asked before it is driven."""
        if not policy.speeds_mps or not math.isfinite(policy.period_s) or policy.period_s <= 0.0:
            return "The profile has no speeds, or no time to drive them for."
        lane = observation.road.get(observation.ego.lane)
        most = math.inf if lane is None else limits.most_mps(lane.speed_limit_mps)
        wrong = [speed for speed in policy.speeds_mps if not 0.0 <= speed <= most]
        return f"A speed of {wrong[0]} m/s is not between 0 and {most:.1f} m/s." if wrong else ""

    def start(self, policy, observation, limits, origin=None):
        """Take over a checked profile."""
        self._profile, self._begun_s = policy, observation.time_s

    def tick(self):
        """What is asked for in this period."""
        now, profile = self._world.observe(), self._profile
        index = int((now.time_s - self._begun_s) / profile.period_s + 1e-9)
        over = index >= len(profile.speeds_mps)
        self._status = "finished" if over else "running"
        self._setpoints = Setpoints(profile.speeds_mps[-1 if over else index], HEADWAY_S, now.ego.lane)
        return HeldSetpoints(self._setpoints, state=self._status)


EXAMPLE = SpeedProfile((20.0, 22.0), 3.0)
"""`chauffeur check executor speed_profile:SpeedProfileExecutor --policy speed_profile:EXAMPLE` drives it."""
