"""Safe distances along the lane, as pure functions of numbers.

Source: S. Shalev-Shwartz, S. Shammah, A. Shashua, "On a Formal Model of Safe and Scalable Self-driving Cars", 2017,
Def. 1. The bound on acceleration is its discrete form for a vehicle that is stepped by explicit Euler: within a period
it travels at the speed it began with, so a stop takes v^2 / 2b and half a period more.
"""

from __future__ import annotations

import math
from collections.abc import Callable


def rss_gap_m(
    rear_mps: float,
    front_mps: float,
    response_s: float,
    rear_acceleration_mps2: float,
    rear_braking_mps2: float,
    front_braking_mps2: float,
) -> float:
    """Smallest safe gap between bumpers, same direction (RSS Def. 1).

    Args:
        rear_mps, front_mps: Speeds; the front one's below 0 counts as 0.
        response_s: Time in which the rear car may still accelerate.
        rear_acceleration_mps2: Its hardest acceleration in that time.
        rear_braking_mps2: What it is sure to brake with afterwards, positive.
        front_braking_mps2: Hardest braking of the front car, positive.
    """
    rear, front = max(rear_mps, 0.0), max(front_mps, 0.0)
    then = rear + response_s * rear_acceleration_mps2
    travelled = rear * response_s + 0.5 * rear_acceleration_mps2 * response_s**2
    return max(0.0, travelled + then**2 / (2.0 * rear_braking_mps2) - front**2 / (2.0 * front_braking_mps2))


def stopping_m(speed_mps: float, braking_mps2: float, dt_s: float) -> float:
    """Way to a stop under full braking, stepped by explicit Euler.

    Exact where the stop takes whole periods; else up to b dt^2 / 8 short (1 cm), which the margin has to hold.
    """
    return speed_mps**2 / (2.0 * braking_mps2) + 0.5 * speed_mps * dt_s


def braking_gap_m(
    speed_mps: float, lead_mps: float, braking_mps2: float, lead_braking_mps2: float, dt_s: float
) -> float:
    """Smallest gap behind a lead at which full braking, begun now, never touches it, however hard it brakes.

    Args:
        speed_mps, lead_mps: Speeds; a lead that comes towards the car counts as standing.
        braking_mps2: Braking the ego is sure of.
        lead_braking_mps2: Hardest braking of the lead.
        dt_s: Control period.
    """
    lead = max(lead_mps, 0.0)
    closing, stronger = speed_mps - lead, braking_mps2 - lead_braking_mps2
    if 0.0 < closing <= stronger * lead / lead_braking_mps2:
        # The ego brakes better: they are closest when it has become as slow as the lead, before either stands.
        return closing**2 / (2.0 * stronger) + 0.5 * closing * dt_s
    return max(0.0, stopping_m(speed_mps, braking_mps2, dt_s) - lead**2 / (2.0 * lead_braking_mps2))


def greatest_acceleration(
    speed_mps: float, gap_m: float, lead_mps: float, braking_mps2: float, lead_braking_mps2: float, dt_s: float
) -> float:
    """Hardest acceleration, m/s2, for one period after which the gap still is `braking_gap_m` or more.

    Args:
        speed_mps: Own speed, 0 or more.
        gap_m: Clear distance to the lead, what shall be left of it taken off.
        lead_mps, braking_mps2, lead_braking_mps2, dt_s: As there; a place to stop at is a lead that stands.

    Returns:
        At least -braking_mps2: more cannot be asked for. As long as it is obeyed, and the lead brakes no harder than
        assumed, the gap never falls below what braking needs: full braking keeps that balance.
    """
    lead = max(lead_mps, 0.0)
    half = 0.5 * braking_mps2 * dt_s
    room = gap_m + lead**2 / (2.0 * lead_braking_mps2)
    left = room - speed_mps * dt_s
    then = -half + math.sqrt(half * half + 2.0 * braking_mps2 * left) if left > 0.0 else -math.inf
    if then > speed_mps:  # gaining speed: the next period is travelled at the new one
        then = max(speed_mps, -3.0 * half + math.sqrt(9.0 * half * half + 2.0 * braking_mps2 * room))
    stronger, slowed = braking_mps2 - lead_braking_mps2, max(0.0, lead - lead_braking_mps2 * dt_s)
    if stronger > 0.0 and slowed > 0.0:
        half = 0.5 * stronger * dt_s
        left = gap_m + (lead - speed_mps) * dt_s
        closing = -half + math.sqrt(half * half + 2.0 * stronger * left) if left > 0.0 else -math.inf
        if closing <= stronger * slowed / lead_braking_mps2:
            then = min(then, slowed + closing)
    return max(-braking_mps2, (then - speed_mps) / dt_s)


def highest(low: float, high: float, holds: Callable[[float], bool], halvings: int) -> float:
    """The highest number between one for which something holds and one for which it does not, by halving."""
    for _ in range(halvings):
        middle = (low + high) / 2.0
        if holds(middle):
            low = middle
        else:
            high = middle
    return low


def free_gap_m(speed_mps: float, acceleration_mps2: float, braking_mps2: float, dt_s: float) -> float:
    """Gap beyond which `greatest_acceleration` is at least `acceleration_mps2`, whatever the lead does.

    It is what a lead that stands asks for, for the speed one period on; one that drives asks for less, as long as it
    can brake at all.
    """
    then = max(speed_mps, 0.0) + max(acceleration_mps2, 0.0) * dt_s
    return (then + 3.0 * braking_mps2 * dt_s) * then / (2.0 * braking_mps2)
