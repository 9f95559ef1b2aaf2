"""The border to a vehicle: numbers are checked here once more, whatever checked them before."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept import Parameters
from chauffeur.concept.units import MPS_PER_KMH, kmh
from chauffeur.worlds.ros.base import VehicleRefusalError

SLOWEST_MPS: Final = 0.0
"""A speed of 0 is a stop; driving backwards is not asked of a vehicle by a sentence."""

ROUNDING: Final = 1e-9
"""Slack at a bound, so that a limit reached by way of km/h is not refused for its last bit."""


@dataclass(frozen=True, slots=True)
class VehicleLimits:
    """Limits on what is published to one vehicle, from its configuration file.

    Attributes:
        max_speed_mps: Highest target speed.
        look_ahead_m: Shortest and longest look-ahead. Never 0: Autoware.AI's follower then no longer stops at the end
            of its path.
        look_ahead_ratio_s: Smallest and largest look-ahead per speed.
    """

    max_speed_mps: float
    look_ahead_m: tuple[float, float] = (3.0, 30.0)
    look_ahead_ratio_s: tuple[float, float] = (0.5, 4.0)


@dataclass(frozen=True, slots=True)
class CheckedWish:
    """Parameters that passed the border: every number is finite and within the vehicle's limits."""

    speed_mps: float
    look_ahead_m: float
    look_ahead_ratio_s: float
    lane: Literal[-1, 0, 1]


def checked(parameters: Parameters, limits: VehicleLimits) -> CheckedWish:
    """The wish, if every number of it may be published to this vehicle. Nothing is clipped: a number outside its range
    means that a check before this one failed, and its neighbours are not to be trusted either.

    Raises:
        VehicleRefusalError: It names the first number that is wrong, and its range.
    """
    speed = _number("target speed", parameters.target_speed_mps, "m/s")
    most = limits.max_speed_mps
    if not SLOWEST_MPS <= speed <= most + ROUNDING:
        raise VehicleRefusalError(
            f"A target speed of {speed:g} m/s ({kmh(speed):g} km/h) is not published to this vehicle.",
            hint=f"Its configuration allows 0 to {most:g} m/s ({kmh(most):g} km/h).",
        )
    look_ahead = _within("look-ahead", parameters.look_ahead_m, limits.look_ahead_m, "m")
    ratio = _within("look-ahead ratio", parameters.look_ahead_ratio, limits.look_ahead_ratio_s, "s")
    if type(parameters.lane) is not int or parameters.lane not in (-1, 0, 1):
        raise VehicleRefusalError(
            f"A lane wish of {str(parameters.lane)[:40]!r} is none.", hint="Use -1 (left), 0 (stay) or 1 (right)."
        )
    if parameters.route:
        raise VehicleRefusalError(
            f"A route ({str(parameters.route)[:40]!r}) is not published to this vehicle.",
            hint="The vehicle's own planner chooses the way.",
        )
    return CheckedWish(_as_meant(min(speed, most)), look_ahead, ratio, parameters.lane)


def _as_meant(speed_mps: float) -> float:
    """The tenth of a km/h that a speed was rounded up from, else the speed: planners round to hundredths of m/s, by
    which 20 km/h becomes 20.016."""
    meant = round(kmh(speed_mps), 1) * MPS_PER_KMH
    return meant if 0.0 < speed_mps - meant < _ROUNDED_MPS else speed_mps


_ROUNDED_MPS: Final = 0.01
"""Most that rounding up to hundredths adds."""


def _within(what: str, value: object, bounds: tuple[float, float], unit: str) -> float:
    number = _number(what, value, unit)
    low, high = bounds
    if not low - ROUNDING <= number <= high + ROUNDING:
        raise VehicleRefusalError(
            f"A {what} of {number:g} {unit} is not published to this vehicle.",
            hint=f"Its configuration allows {low:g} to {high:g} {unit}.",
        )
    return min(max(number, low), high)


def _number(what: str, value: object, unit: str) -> float:
    """The value as a finite number; `object`, because whoever made the parameters may have put anything there."""
    try:
        if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
            return float(value)
    except OverflowError:
        pass  # an integer beyond the float range is no speed either
    raise VehicleRefusalError(
        f"The {what} is {str(value)[:40]!r}, not a number of {unit}.", hint="Give a plain number."
    )
