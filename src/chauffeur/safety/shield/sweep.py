"""Lateral sweep of the ego: one period under a command, then back to its lane.

The same kinematic bicycle and lane keeping as the vehicle's own, so that a command is accepted exactly if the shield
could still bring the car back after it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

from chauffeur.control import LAMPILOT_STEERING, LaneKeepingParameters, lane_keeping_steering
from chauffeur.safety.shield.compiled import compiled
from chauffeur.safety.shield.frame import ShieldBody

_PERIODS = 14
"""Periods of coming back that are looked at; by then the car is back, or goes along its lane."""
_HALF_LENGTH_M = LAMPILOT_STEERING.length_m / 2.0
_APPROACH_RAD = 0.2
"""Angle at which the shield comes back to a lane's centre: a slow car turned further would stick out of the lane."""
_STRAIGHT_RAD = 0.02
_CENTRED_M = 0.1
_SLOWEST_MPS = 1e-2
"""Lane keeping divides by no less."""


def recovery_steering(
    ego: ShieldBody, centre_m: float, speed_mps: float, most_rad: float, curvature: float = 0.0
) -> float:
    """Steering angle, rad, that brings the ego back to a lane's centre; the lane's curvature in 1/m."""
    parameters = _with_wheel(most_rad)
    bend = curvature * speed_mps * parameters.preview_s
    return lane_keeping_steering(speed_mps, ego.heading_rad, ego.d_m - centre_m, bend, parameters)


@lru_cache(maxsize=4)
def _with_wheel(most_rad: float) -> LaneKeepingParameters:
    return replace(LAMPILOT_STEERING, max_steering_rad=most_rad, max_approach_rad=_APPROACH_RAD)


def yaw_rate(speed_mps: float, steering_rad: float) -> float:
    """Rate of turn, rad/s, of the kinematic bicycle."""
    return _turning(speed_mps, _slip(steering_rad))


def _slip(steering_rad: float) -> float:
    """Angle, rad, between the car's heading and where its centre goes."""
    return math.atan(0.5 * math.tan(steering_rad))


def _turning(speed_mps: float, slip_rad: float) -> float:
    return speed_mps * math.sin(slip_rad) / _HALF_LENGTH_M


def swept(
    ego: ShieldBody,
    speed_mps: float,
    size_m: tuple[float, float],
    steering_rad: float,
    centre_m: float,
    most_rad: float,
    dt_s: float,
    curvature: float = 0.0,
) -> tuple[float, float]:
    """(lowest, highest) place across the road, m, that any part of the body reaches.

    Args:
        ego: Where it is.
        speed_mps: Its speed, kept.
        size_m: (length, width).
        steering_rad: Angle held for one period.
        centre_m: Lane centre it then comes back to.
        most_rad: Largest steering angle on the way back.
        dt_s: Control period.
        curvature: Of the lane, 1/m.
    """
    parameters = _with_wheel(most_rad)
    return _swept(
        (ego.d_m, ego.heading_rad, speed_mps, curvature * speed_mps),
        (size_m[0] / 2.0, size_m[1] / 2.0),
        (steering_rad, centre_m, dt_s),
        (
            parameters.lateral_gain_per_s,
            parameters.heading_gain_per_s,
            parameters.preview_s,
            parameters.max_approach_rad,
            parameters.max_steering_rad,
            parameters.length_m / 2.0,
        ),
    )


@compiled
def _clipped(value: float, bound: float) -> float:
    least = value if value < bound else bound
    return least if least > -bound else -bound


@compiled
def _keeping(
    speed: float, heading: float, offset: float, ahead: float, gains: tuple[float, float, float, float, float, float]
) -> float:
    """`control.lane_keeping_steering`, to the last bit."""
    if abs(speed) <= _SLOWEST_MPS:
        speed = _SLOWEST_MPS if speed >= 0.0 else -_SLOWEST_MPS
    approach = _clipped(math.asin(_clipped(-gains[0] * offset / speed, 1.0)), gains[3])
    turn = (ahead + approach - heading + math.pi) % (2.0 * math.pi) - math.pi
    slip = math.asin(_clipped(gains[5] / speed * (gains[1] * turn), 1.0))
    return _clipped(math.atan(2.0 * math.tan(slip)), gains[4])


@compiled
def _swept(
    ego: tuple[float, float, float, float],
    half: tuple[float, float],
    asked: tuple[float, float, float],
    gains: tuple[float, float, float, float, float, float],
) -> tuple[float, float]:
    """`swept` in numbers.

    Args:
        ego: d, heading, speed, and how fast the lane turns under it, rad/s.
        half: Half length, half width.
        asked: Steering angle, lane centre, control period.
        gains: Those of lane keeping, its bounds, and half the length.
    """
    d, heading, speed, bend = ego
    steering, centre, dt_s = asked
    low = high = d
    for period in range(_PERIODS + 1):
        wide = abs(math.sin(heading)) * half[0] + abs(math.cos(heading)) * half[1]
        low = d - wide if d - wide < low else low
        high = d + wide if d + wide > high else high
        offset = d - centre
        if period > 0 and abs(heading) < _STRAIGHT_RAD and abs(offset) < _CENTRED_M:
            break
        angle = _keeping(speed, heading, offset, bend * gains[2], gains) if period > 0 else steering
        slip = math.atan(0.5 * math.tan(angle))
        d += speed * math.sin(heading + slip) * dt_s
        heading += (speed * math.sin(slip) / _HALF_LENGTH_M - bend) * dt_s
    return low, high
