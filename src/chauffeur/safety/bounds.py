"""Wishes within limits, whoever wished them: numbers only, so that the control process needs nothing else."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from chauffeur.concept import Limits, Observation, Setpoints
from chauffeur.concept.units import MPS_PER_KMH

LEAST_MPS: Final = 60.0 * MPS_PER_KMH
SHARE_OF_LIMIT: Final = 0.6
AHEAD_M: Final = 100.0
"""Traffic that far ahead says how fast one can drive."""


def bounded(
    setpoints: Setpoints, limits: Limits, speed_limit_mps: float, least_mps: float = 0.0
) -> tuple[Setpoints, tuple[str, ...]]:
    """The wishes, with numbers brought within the limits, and the names of what was changed.

    Args:
        setpoints: As the policy states them.
        limits: Of the person and the operator.
        speed_limit_mps: Of the lane that is driven.
        least_mps: Least speed a policy may ask for there, within the limits; 0 where there is none.
    """
    most_mps = max(0.0, limits.most_mps(speed_limit_mps))  # below 0, or no number: the car stops
    changed: list[str] = []
    speed = setpoints.target_speed_mps
    least_mps = min(max(0.0, least_mps), most_mps)
    if speed is not None and not least_mps <= speed <= most_mps:
        # a speed that is no number stops the car
        speed = most_mps if speed > most_mps else 0.0 if math.isnan(speed) else least_mps
        changed.append("target_speed")
    headway = setpoints.time_headway_s
    if not limits.min_time_headway_s <= headway <= limits.max_time_headway_s:
        # a headway that is no number becomes the longest
        headway = limits.min_time_headway_s if headway < limits.min_time_headway_s else limits.max_time_headway_s
        changed.append("time_headway")
    if not changed:
        return setpoints, ()
    return replace(setpoints, target_speed_mps=speed, time_headway_s=headway), tuple(changed)


def least_speed_mps(observation: Observation, limits: Limits | None = None) -> float | None:
    """The least speed that may be asked for where the ego is; None where there is none: off a highway, on its shoulder.

    Args:
        observation: The instant.
        limits: Of the person: a lower cap of theirs is no crawl.
    """
    lane = observation.road.get(observation.ego.lane)
    if not observation.road.uninterrupted or lane is None or lane.emergency or lane.closed:
        return None
    least = min(LEAST_MPS, SHARE_OF_LIMIT * lane.speed_limit_mps)
    cap = None if limits is None else limits.max_speed_mps
    ahead = (
        () if observation.front is None or observation.front.distance_m > AHEAD_M else (observation.front.speed_mps,)
    )
    return max(0.0, min((least, *ahead, *(() if cap is None else (cap,)))))


def least_target_mps(observation: Observation, setpoints: Setpoints, limits: Limits) -> float:
    """The least speed that wishes may ask for now; 0 where there is none, and on the way onto a shoulder."""
    aim = observation.road.get(setpoints.target_lane)
    return 0.0 if aim is not None and aim.emergency else least_speed_mps(observation, limits) or 0.0


def shoulder_at_right(observation: Observation) -> bool:
    """True if the ego is on a shoulder, or can get to one lane by lane to the right."""
    own = observation.road.get(observation.ego.lane)
    return own is not None and any(
        lane.emergency and lane.index >= own.index for lane in observation.road.abreast(own.id)
    )
