"""LaMPilot's scores (seed Eq. 1-8) as its code computes them: the `origin` ruler.

Where code and paper differ, the code's way is taken and said: the time to collision looks at every vehicle in every
lane along the ego's own lane, its score is floored at -100 instead of 0, and the other two are not floored.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from chauffeur.concept import Metric
from chauffeur.control import guard_zero

TTC_SAFE_S = 2.0
SPEED_STD_FULL_MPS = 10.0
TIME_LIMIT_S = 60.0
WEIGHTS = {"ttc": 0.5, "speed_variance": 0.3, "time_efficiency": 0.2}
COLLISION_WEIGHT = 500.0


def time_to_collision_s(ego: Any, others: list[Any]) -> float:
    """LaMPilot's TTC: centre gap along the ego's lane over the closing speed, least over all vehicles; -1 for none.

    Lateral distance is not looked at, and a vehicle with exactly the ego's speed is skipped.
    """
    speed = float(ego.speed)
    heading = float(ego.heading)
    lane = ego.lane
    own_s = lane.local_coordinates(ego.position)[0]
    ttc = -1.0
    for other in others:
        if other is ego or speed == other.speed:
            continue
        distance = lane.local_coordinates(other.position)[0] - own_s
        along = other.speed * math.cos(other.heading - heading)
        time = distance / guard_zero(speed - along)
        if time >= 0:
            ttc = min(ttc, time) if ttc > 0 else time
    return float(ttc)


@dataclass(slots=True)
class Scorer:
    """Collects one sample a control period and scores the episode."""

    speeds_mps: list[float] = field(default_factory=list[float])
    ttcs_s: list[float] = field(default_factory=list[float])

    def observe(self, ego: Any, vehicles: list[Any]) -> None:
        """Sample the present instant."""
        self.speeds_mps.append(float(ego.speed))
        self.ttcs_s.append(time_to_collision_s(ego, vehicles))

    @property
    def ttc_score(self) -> float:
        """Points: 100 without conflict closer than 2 s, else 100 - 1/TTC, not below -100."""
        conflicts = [t for t in self.ttcs_s if t > 0]
        if not conflicts or min(conflicts) > TTC_SAFE_S:
            return 100.0
        return max(100.0 - 1.0 / min(conflicts), -100.0)

    @property
    def speed_variance_score(self) -> float:
        """Points: 100 (1 - std(speed) / 10 m/s)."""
        return 100.0 * (1.0 - float(np.std(self.speeds_mps)) / SPEED_STD_FULL_MPS) if self.speeds_mps else 100.0

    @property
    def time_efficiency_score(self) -> float:
        """Points: 100 (1 - t / 60 s)."""
        return 100.0 * (1.0 - len(self.speeds_mps) / 10 / TIME_LIMIT_S)

    def score(self, *, success: bool) -> float:
        """Points of the episode: weighted sum, not below 0; 0 without success."""
        if not success:
            return 0.0
        return max(
            0.0,
            self.ttc_score * WEIGHTS["ttc"]
            + self.speed_variance_score * WEIGHTS["speed_variance"]
            + self.time_efficiency_score * WEIGHTS["time_efficiency"],
        )

    def metrics(self, *, success: bool) -> tuple[Metric, ...]:
        """The episode's metrics; the three parts apply to successes only, as LaMPilot averages them."""
        return (
            Metric("lampilot-ttc-v1", self.ttc_score, "points", success),
            Metric("lampilot-speed-variance-v1", self.speed_variance_score, "points", success),
            Metric("lampilot-time-efficiency-v1", self.time_efficiency_score, "points", success),
            Metric("lampilot-score-v1", self.score(success=success), "points"),
        )


def driving_score(completion: float, mean_score_of_successes: float, collision: float) -> float:
    """Aggregate: completion x mean score of successes - 500 x collision rate; rates in 0..1."""
    return completion * mean_score_of_successes - COLLISION_WEIGHT * collision
