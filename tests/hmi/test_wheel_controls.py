"""Keys, wheel and pedals as pure functions; the mailbox between network and drive; the fixed rate."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from wheel_rig import SteppedClock

from chauffeur.hmi.wheel.controls import Keys, Positions, WheelGains, command_of, moved, steering_bound_rad
from chauffeur.hmi.wheel.mailbox import Mailbox
from chauffeur.hmi.wheel.pace import DrivePace

DT_S = 0.1
GAINS = WheelGains()
keys = st.integers(0, 15).map(Keys)


def held(key: Keys, periods: int, at: Positions | None = None) -> Positions:
    at = at or Positions()
    for _ in range(periods):
        at = moved(at, key, DT_S, GAINS)
    return at


@given(st.lists(keys, max_size=60), st.floats(-1.0, 45.0))
def test_commands_stay_within_the_vehicles_bounds(pressed: list[Keys], speed_mps: float) -> None:
    at = Positions()
    for key in pressed:
        at = moved(at, key, DT_S, GAINS)
        command = command_of(at, speed_mps, DT_S, GAINS)
        assert -1.0 <= at.wheel <= 1.0 and -1.0 <= at.pedal <= 1.0
        assert math.isfinite(command.acceleration_mps2) and abs(command.acceleration_mps2) <= 10.0
        assert abs(command.steering_rad) <= steering_bound_rad(speed_mps, GAINS) <= GAINS.max_steering_rad


def test_a_tap_is_a_little_and_a_held_key_is_all() -> None:
    tap = held(Keys.RIGHT, 1)
    assert 0 < -command_of(tap, 8.0, DT_S, GAINS).steering_rad < 0.03 * steering_bound_rad(8.0, GAINS)
    assert held(Keys.RIGHT, 7).wheel == 1.0
    assert held(Keys.GAS, 8).pedal == pytest.approx(1.0) and held(Keys.BRAKE, 4).pedal == pytest.approx(-1.0)


def test_a_wheel_left_alone_comes_back_and_a_counter_key_is_faster() -> None:
    full = held(Keys.LEFT, 10)
    assert full.wheel == -1.0
    assert held(Keys.NONE, 4, full).wheel == 0.0
    assert held(Keys.RIGHT, 3, full).wheel == 0.0 < held(Keys.RIGHT, 4, full).wheel
    assert held(Keys.LEFT | Keys.RIGHT, 4, full).wheel == 0.0


def test_the_brake_beats_the_gas_stops_the_car_and_never_backs_it() -> None:
    assert held(Keys.GAS | Keys.BRAKE, 2).pedal < 0
    assert moved(held(Keys.GAS, 8), Keys.BRAKE, DT_S, GAINS).pedal < 0, "the foot leaves the gas at once"
    braking = held(Keys.BRAKE, 9)
    assert command_of(braking, 0.2, DT_S, GAINS).acceleration_mps2 == pytest.approx(-2.0)
    assert command_of(braking, 0.0, DT_S, GAINS).acceleration_mps2 == 0.0
    assert command_of(braking, 20.0, DT_S, GAINS).acceleration_mps2 == -5.0


def test_full_wheel_keeps_the_sideways_acceleration_at_any_speed() -> None:
    for speed in (10.0, 20.0, 31.0):
        angle = steering_bound_rad(speed, GAINS)
        yaw = speed * math.sin(math.atan(0.5 * math.tan(angle))) / 2.5
        assert speed * yaw == pytest.approx(GAINS.max_lateral_mps2, rel=0.02)
    assert steering_bound_rad(0.0, GAINS) == GAINS.max_steering_rad


def test_the_mailbox_keeps_taps_and_tells_wishes_once() -> None:
    clock = SteppedClock()
    mailbox = Mailbox(clock)
    mailbox.press(Keys.LEFT, 1)
    mailbox.press(Keys.NONE, 2)  # pressed and released between two looks
    heard = mailbox.look()
    assert (heard.keys, heard.number) == (Keys.LEFT, 2)
    assert mailbox.look().keys == Keys.NONE
    mailbox.press(Keys.GAS, 3)
    clock.advance(0.4)
    mailbox.wish("pause")
    clock.advance(0.3)
    heard = mailbox.look()
    assert heard.wish == "pause" and heard.silent_s == pytest.approx(0.3) and heard.keys == Keys.GAS
    assert mailbox.look().wish == ""
    mailbox.wish("give_up")
    mailbox.wish("go")
    assert mailbox.look().wish == mailbox.look().wish == "give_up", "giving up is final"


def test_late_periods_are_counted_and_not_caught_up() -> None:
    class Slow(SteppedClock):
        def wait_until(self, at_s: float) -> None:
            self.advance(max(0.0, at_s - self.now_s()))

    clock = Slow()
    pace = DrivePace(clock, DT_S)
    began: list[float] = []
    for work_s in (0.01, 0.01, 0.25, 0.01, 0.125, 0.01):
        pace.await_period(driven=True)
        began.append(round(clock.now_s() - 100.0, 3))
        clock.advance(work_s)
    # 0.25 s of work delays the next period; the one after follows a full period later, none is hurried.
    assert began == [0.1, 0.2, 0.3, 0.55, 0.65, 0.775]
    assert pace.late == 2 and pace.worst_late_s == pytest.approx(0.15)
    clock.advance(1.0)
    pace.await_period(driven=False)
    assert pace.late == 2
