"""Wishes within limits, whoever wished them: numbers only, so that the control process needs nothing else."""

from __future__ import annotations

import math
from dataclasses import replace

from chauffeur.concept import Limits, Wishes


def bounded(
    wishes: Wishes, limits: Limits, speed_limit_mps: float, least_mps: float = 0.0
) -> tuple[Wishes, tuple[str, ...]]:
    """The wishes, with numbers brought within the limits, and the names of what was changed.

    Args:
        wishes: As the policy states them.
        limits: Of the person and the operator.
        speed_limit_mps: Of the lane that is driven.
        least_mps: Least speed a policy may ask for there, within the limits; 0 where there is none.
    """
    most_mps = max(0.0, limits.most_mps(speed_limit_mps))  # below 0, or no number: the car stops
    changed: list[str] = []
    speed = wishes.target_speed_mps
    least_mps = min(max(0.0, least_mps), most_mps)
    if speed is not None and not least_mps <= speed <= most_mps:
        # a speed that is no number stops the car
        speed = most_mps if speed > most_mps else 0.0 if math.isnan(speed) else least_mps
        changed.append("target_speed")
    headway = wishes.time_headway_s
    if not limits.min_time_headway_s <= headway <= limits.max_time_headway_s:
        # a headway that is no number becomes the longest
        headway = limits.min_time_headway_s if headway < limits.min_time_headway_s else limits.max_time_headway_s
        changed.append("time_headway")
    if not changed:
        return wishes, ()
    return replace(wishes, target_speed_mps=speed, time_headway_s=headway), tuple(changed)
