"""Lane keeping: a lateral-position controller cascaded into a heading controller, on a kinematic bicycle.

Source: the low-level controller of the highway-env package (E. Leurent, 2018), with LaMPilot's gains.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from chauffeur.control.idm import guard_zero
from chauffeur.geometry import wrap_to_pi


@dataclass(frozen=True, slots=True)
class LaneKeepingParameters:
    """Gains and bounds.

    Attributes:
        lateral_gain_per_s: Lateral speed asked per metre of offset.
        heading_gain_per_s: Heading rate asked per radian of heading error.
        preview_s: How far ahead, in time, the lane's heading is read.
        max_approach_rad: Largest angle at which the lane centre is approached.
        max_steering_rad: Bound of the steering angle.
        length_m: Vehicle length; axles are at its ends.
    """

    lateral_gain_per_s: float = 1.0 / 0.6
    heading_gain_per_s: float = 1.0 / 0.2
    preview_s: float = 0.1
    max_approach_rad: float = math.pi / 4
    max_steering_rad: float = math.pi / 3
    length_m: float = 5.0


LAMPILOT_STEERING = LaneKeepingParameters()


def _clip(value: float, bound: float) -> float:
    return max(-bound, min(bound, value))


def lane_keeping_steering(
    speed_mps: float, heading_rad: float, offset_m: float, lane_heading_rad: float, parameters: LaneKeepingParameters
) -> float:
    """Steering angle, rad, that brings the vehicle onto the lane centre.

    Args:
        speed_mps: Own speed.
        heading_rad: Own heading.
        offset_m: Signed lateral offset from the lane centre, in the lane's frame.
        lane_heading_rad: Lane heading `preview_s` ahead of the vehicle.
        parameters: Gains and bounds.
    """
    speed = guard_zero(speed_mps)
    lateral_speed = -parameters.lateral_gain_per_s * offset_m
    approach = _clip(math.asin(_clip(lateral_speed / speed, 1.0)), parameters.max_approach_rad)
    heading_rate = parameters.heading_gain_per_s * wrap_to_pi(lane_heading_rad + approach - heading_rad)
    slip = math.asin(_clip(parameters.length_m / 2.0 / speed * heading_rate, 1.0))
    return _clip(math.atan(2.0 * math.tan(slip)), parameters.max_steering_rad)
