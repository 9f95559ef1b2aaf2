"""Wishes within limits, whoever wished them: numbers only, so that the control process needs nothing else."""

from __future__ import annotations

from dataclasses import replace

from chauffeur.concept import Limits, Wishes


def bounded(wishes: Wishes, limits: Limits, speed_limit_mps: float) -> tuple[Wishes, tuple[str, ...]]:
    """The wishes, with numbers brought within the limits, and the names of what was changed.

    Args:
        wishes: As the policy states them.
        limits: Of the person and the operator.
        speed_limit_mps: Of the lane that is driven.
    """
    most_mps = max(0.0, limits.most_mps(speed_limit_mps))  # below 0, or no number: the car stops
    changed: list[str] = []
    speed = wishes.target_speed_mps
    if speed is not None and not 0.0 <= speed <= most_mps:
        speed = most_mps if speed > most_mps else 0.0  # a speed that is no number stops the car
        changed.append("target_speed")
    headway = wishes.time_headway_s
    if not limits.min_time_headway_s <= headway <= limits.max_time_headway_s:
        # a headway that is no number becomes the longest
        headway = limits.min_time_headway_s if headway < limits.min_time_headway_s else limits.max_time_headway_s
        changed.append("time_headway")
    if not changed:
        return wishes, ()
    return replace(wishes, target_speed_mps=speed, time_headway_s=headway), tuple(changed)
