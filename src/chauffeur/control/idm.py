"""Intelligent Driver Model: car following.

Source: Treiber, Hennecke, Helbing, "Congested traffic states in empirical observations and microscopic simulations",
Phys. Rev. E 62, 2000. Default parameters are those of LaMPilot's ego vehicle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class IdmParameters:
    """IDM parameters.

    Attributes:
        acceleration_mps2: Maximum acceleration a.
        deceleration_mps2: Comfortable deceleration b, positive.
        exponent: Acceleration exponent delta.
        jam_distance_m: Distance s0 kept at standstill; LaMPilot measures it between centres.
        time_headway_s: Desired time headway T.
    """

    acceleration_mps2: float = 6.0
    deceleration_mps2: float = 6.0
    exponent: float = 4.0
    jam_distance_m: float = 6.0
    time_headway_s: float = 1.5


LAMPILOT_EGO = IdmParameters()


def guard_zero(value: float, eps: float = 1e-2) -> float:
    """`value`, or `eps` with its sign where it is closer to zero than that; for use as a divisor."""
    if abs(value) > eps:
        return value
    return eps if value >= 0 else -eps


def desired_gap_m(speed_mps: float, approach_rate_mps: float, parameters: IdmParameters) -> float:
    """Desired gap s* = s0 + v T + v dv / (2 sqrt(a b)).

    Args:
        speed_mps: Own speed v.
        approach_rate_mps: dv, own speed minus the lead vehicle's, along the own heading.
        parameters: IDM parameters.
    """
    root = 2.0 * math.sqrt(parameters.acceleration_mps2 * parameters.deceleration_mps2)
    return parameters.jam_distance_m + speed_mps * parameters.time_headway_s + speed_mps * approach_rate_mps / root


def free_acceleration(speed_mps: float, target_speed_mps: float, parameters: IdmParameters) -> float:
    """Acceleration on a free road, m/s2: a (1 - (v / v0)^delta)."""
    ratio = max(speed_mps, 0.0) / abs(guard_zero(target_speed_mps))
    return parameters.acceleration_mps2 * (1.0 - ratio**parameters.exponent)


def interaction(gap_m: float, desired_m: float, parameters: IdmParameters) -> float:
    """Braking owed to the lead vehicle, m/s2, positive: a (s* / s)^2. `gap_m` is signed; near zero it is guarded."""
    return parameters.acceleration_mps2 * (desired_m / guard_zero(gap_m)) ** 2


def idm_acceleration(
    speed_mps: float,
    target_speed_mps: float,
    parameters: IdmParameters,
    gap_m: float | None = None,
    approach_rate_mps: float = 0.0,
    shorten_by_m: float = 0.0,
) -> float:
    """IDM acceleration, m/s2, unbounded.

    Args:
        speed_mps: Own speed.
        target_speed_mps: Desired speed in free traffic.
        parameters: IDM parameters.
        gap_m: Distance to the lead vehicle or stop line; None on a free road.
        approach_rate_mps: Own speed minus the lead's.
        shorten_by_m: Taken off the desired gap (LaMPilot stops 3 m closer to a stop sign than to a car).
    """
    acceleration = free_acceleration(speed_mps, target_speed_mps, parameters)
    if gap_m is not None:
        desired = desired_gap_m(speed_mps, approach_rate_mps, parameters) - shorten_by_m
        acceleration -= interaction(gap_m, desired, parameters)
    return acceleration
