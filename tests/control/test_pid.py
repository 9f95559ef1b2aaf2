"""PID: tracks, keeps its bounds, does not wind up."""

from __future__ import annotations

import pytest

from chauffeur.control.pid import PidGains, PidLimits, PidState, pid_follow, pid_step

DT = 0.05
GAINS = PidGains(0.6, 0.02, 0.05)


def drive(gains: PidGains, limits: PidLimits, target: float, seconds: float, drag: float = 0.0) -> list[float]:
    speed, state, speeds = 0.0, PidState(), list[float]()
    for _ in range(round(seconds / DT)):
        asked, state = pid_step(gains, limits, state, target - speed, DT)
        speed += (asked - drag) * DT
        speeds.append(speed)
    return speeds


def test_it_is_equation_24_where_nothing_binds() -> None:
    gains, wide = PidGains(0.5, 0.1, 0.3), PidLimits(-100.0, 100.0, 1e9, 0.0, 1e9)
    first, state = pid_step(gains, wide, PidState(), 2.0, DT)
    second, _ = pid_step(gains, wide, state, 1.5, DT)
    assert first == pytest.approx(0.5 * 2.0 + 0.1 * 2.0 * DT)
    assert second == pytest.approx(0.5 * 1.5 + 0.1 * (2.0 + 1.5) * DT + 0.3 * (1.5 - 2.0) / DT)


def test_it_reaches_a_speed_and_holds_it_against_drag() -> None:
    speeds = drive(GAINS, PidLimits(), 50 / 3.6, 120.0, drag=0.1)
    assert speeds[-1] == pytest.approx(50 / 3.6, abs=0.05)
    assert max(speeds) < 50 / 3.6 + 0.5


def test_a_long_saturation_does_not_wind_up() -> None:
    """Without anti-windup the error of the acceleration, some 40 m, times 0.06 would overshoot by metres a second."""
    speeds = drive(PidGains(0.3, 0.06, 0.0), PidLimits(), 50 / 3.6, 60.0)
    assert max(speeds) < 50 / 3.6 + 1.0
    wound = drive(PidGains(0.3, 0.06, 0.0), PidLimits(zone_mps=1e9), 50 / 3.6, 60.0)
    assert max(wound) > 50 / 3.6 + 1.5


@pytest.mark.parametrize("error", [1e9, -1e9])
def test_output_and_its_rate_are_bounded(error: float) -> None:
    limits, state = PidLimits(), PidState(started=1.0)
    for _ in range(100):
        before = state.output_mps2
        asked, state = pid_step(PidGains(9.0, 9.0, 9.0), limits, state, error, DT)
        assert limits.low_mps2 <= asked <= limits.high_mps2
        assert abs(asked - before) <= limits.rise_mps3 * DT + 1e-12


def test_after_somebody_else_braked_it_returns_without_a_jump() -> None:
    _, state = pid_step(GAINS, PidLimits(), PidState(), 5.0, DT)
    held = pid_follow(state, -3.0)
    asked, _ = pid_step(GAINS, PidLimits(), held, 5.0, DT)
    assert asked <= -3.0 + PidLimits().rise_mps3 * DT + 1e-12
    assert pid_follow(state, state.output_mps2 + 1.0) == state
