"""Longitudinal PID on the speed error (paper Eq. 24), with anti-windup and a filtered derivative.

Values are named tuples of floats and the functions are pure, so that a sweep over thousands of gain sets may compile
them (numba) as they stand.
"""

from __future__ import annotations

from typing import NamedTuple


class PidGains(NamedTuple):
    """Gains of Eq. 24: m/s2 per m/s, m/s2 per m, and m/s2 per m/s2 of speed error."""

    kp: float
    ki: float
    kd: float


class PidLimits(NamedTuple):
    """Bounds on the output, and the filter of the derivative.

    Attributes:
        low_mps2, high_mps2: Output range; low is negative.
        rise_mps3: Largest rate of the output, either way (comfort; braking for somebody does not pass here).
        filter_s: Time constant of the first-order filter on the error's derivative.
        zone_mps: Errors larger than this are not summed up: a whole acceleration from a stand would overshoot by as
            much as it has summed up.
    """

    low_mps2: float = -4.0
    high_mps2: float = 2.5
    rise_mps3: float = 4.0
    filter_s: float = 0.2
    zone_mps: float = 2.0


class PidState(NamedTuple):
    """Memory of the controller between two steps; `started` is 0 before the first."""

    integral_m: float = 0.0
    error_mps: float = 0.0
    slope_mps2: float = 0.0
    output_mps2: float = 0.0
    started: float = 0.0


def pid_step(
    gains: PidGains, limits: PidLimits, state: PidState, error_mps: float, dt_s: float
) -> tuple[float, PidState]:
    """Acceleration for one period (Eq. 24), and the state after it.

    The integral stands still while the output is held at a bound that it would push further into (clamping), and while
    the error is large (integral separation).

    Args:
        gains: Row one of the action matrix.
        limits: Bounds of the output.
        state: As the step before left it.
        error_mps: Target speed minus speed.
        dt_s: Period.
    """
    slope = state.slope_mps2
    if state.started > 0.0:
        slope += dt_s / (limits.filter_s + dt_s) * ((error_mps - state.error_mps) / dt_s - slope)
    integral = state.integral_m
    if abs(error_mps) <= limits.zone_mps:
        integral += error_mps * dt_s
    free = gains.kp * error_mps + gains.ki * integral + gains.kd * slope
    low, high = limits.low_mps2, limits.high_mps2
    if state.started > 0.0:
        low = max(low, state.output_mps2 - limits.rise_mps3 * dt_s)
        high = min(high, state.output_mps2 + limits.rise_mps3 * dt_s)
    output = min(max(free, low), high)
    if (output < free and error_mps > 0.0) or (output > free and error_mps < 0.0):
        integral = state.integral_m
    return output, PidState(integral, error_mps, slope, output, 1.0)


def pid_follow(state: PidState, applied_mps2: float) -> PidState:
    """The state when somebody else decided the acceleration (a gap, a shield): no wind-up, no jump on return."""
    if applied_mps2 >= state.output_mps2:
        return state
    return PidState(min(state.integral_m, 0.0), state.error_mps, state.slope_mps2, applied_mps2, state.started)
