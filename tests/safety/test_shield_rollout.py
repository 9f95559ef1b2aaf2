"""A command rolled on at a crossing, piece by piece: against plain formulas, small steps and overlapping bodies."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from chauffeur.safety.shield import rollout

Array = NDArray[np.float64]
DT = 0.1
SIZE = (2.5, 1.0)
"""Half length, half width of the ego."""
OTHERS = (3.0, 6.0, 0.5, 4.0)
"""Hardest acceleration, hardest braking, time to respond, the braking others are sure of."""
BRAKING = 8.0
EAST = np.stack([np.arange(0.0, 100.0, rollout.STEP_M), np.zeros(200), np.zeros(200)], axis=1)
"""A way along x."""
NOBODY = np.empty((0, 7))
NO_LANES = np.empty((0, 5))


def bend(radius: float) -> Array:
    """A quarter of a circle to the left."""
    turned = np.arange(0.0, math.pi / 2.0, rollout.STEP_M / radius)
    return np.stack([radius * np.sin(turned), radius * (1.0 - np.cos(turned)), turned], axis=1)


def other(x: float, y: float, heading: float, speed: float) -> tuple[float, ...]:
    """A car of 5 by 2 metres."""
    return x, y, math.cos(heading), math.sin(heading), speed, 2.5, 1.0


def many(*rows: tuple[float, ...]) -> Array:
    return np.array(rows, dtype=np.float64).reshape(len(rows), 7)


def state(x: float = 0.0, y: float = 0.0, heading: float = 0.0, speed: float = 0.0) -> Array:
    return np.array([x, y, heading, speed, 0.0, 0.0])


# Motion ---------------------------------------------------------------------------------------------------------------


def test_nothing_is_driven_faster_than_the_vehicle_goes() -> None:
    fast = state(speed=16.0)
    rollout.move(fast, 5.0, 0.0, DT)
    assert fast[3] == pytest.approx(15.9)
    braked = state(speed=16.0)
    rollout.move(braked, -8.0, 0.0, DT)
    assert braked[3] == pytest.approx(15.2)
    at_the_top = state(speed=15.0)
    rollout.move(at_the_top, 5.0, 0.0, DT)
    assert at_the_top[3] == pytest.approx(15.5)


def test_wheel_and_turn_have_bounds() -> None:
    full, more = state(speed=8.0), state(speed=8.0)
    rollout.move(full, 0.0, math.pi / 2.0, DT)
    rollout.move(more, 0.0, 3.0, DT)
    assert more.tolist() == full.tolist()
    for sign in (-1.0, 1.0):
        spun, bounded = state(speed=8.0), state(speed=8.0)
        spun[5], bounded[5] = sign * 9.0, sign * 2.0 * math.pi
        rollout.move(spun, 0.0, 0.0, DT)
        rollout.move(bounded, 0.0, 0.0, DT)
        assert spun.tolist() == bounded.tolist()


@settings(deadline=None)
@given(
    x=st.floats(-5.0, 25.0), y=st.floats(-5.0, 25.0), guess=st.integers(-1, 30), radius=st.sampled_from([10.0, 20.0])
)
def test_the_nearest_point_is_nearest(x: float, y: float, guess: int, radius: float) -> None:
    way = bend(radius)
    distances = np.hypot(way[:, 0] - x, way[:, 1] - y)
    found = rollout.nearest(way, x, y, min(guess, len(way) - 1))
    if guess < 0:
        assert distances[found] == distances.min()
        return
    # from a guess it goes downhill to where no neighbour is nearer
    assert all(distances[one] >= distances[found] - 1e-12 for one in (found - 1, found + 1) if 0 <= one < len(way))
    assert distances[found] <= distances[min(guess, len(way) - 1)] + 1e-12


@settings(deadline=None)
@given(speed=st.floats(0.0, 14.0), across=st.floats(-3.0, 3.0), heading=st.floats(-1.5, 1.5))
def test_every_law_steers_within_its_wheel_and_towards_the_way(speed: float, across: float, heading: float) -> None:
    here = state(20.0, across, heading, speed)
    light, none, best, whole = (rollout.wheel(law, here, EAST, 40, 0.0, DT) for law in range(rollout.LAWS))
    for turns in (-7, 3):
        round_and_round = state(20.0, across, heading + turns * 2.0 * math.pi, speed)
        assert rollout.wheel(3, round_and_round, EAST, 40, 0.0, DT) == pytest.approx(whole, abs=1e-9)
    assert none == 0.0
    assert abs(light) <= 0.3
    assert abs(whole) <= math.pi / 4.0 + 1e-12
    assert light == pytest.approx(max(-0.3, min(0.3, whole)))
    assert best in (0.0, -0.2, 0.2, -0.4, 0.4, -0.6, 0.6, -0.78, 0.78)
    if abs(heading) > 0.25:  # more than the way is come back to at
        assert whole * heading < 0.0
    if heading == 0.0 and abs(across) > 0.1 and speed > 0.0:
        assert whole * across < 0.0


def test_the_way_is_looked_at_a_tenth_of_a_second_ahead() -> None:
    way = bend(10.0)
    x, y, heading = way[10]
    for speed, points in ((1.0, 0), (5.0, 1), (14.0, 3)):
        ahead = math.atan2(0.0, 1.0) + way[10 + points, 2]
        rate = 5.0 * (ahead - heading)
        slip = math.asin(max(-1.0, min(1.0, 2.5 / speed * rate)))
        expected = max(-math.pi / 4.0, min(math.pi / 4.0, math.atan(2.0 * math.tan(slip))))
        assert rollout.wheel(3, state(x, y, heading, speed), way, 10, 0.0, DT) == pytest.approx(expected, abs=1e-9)
    end = len(way) - 1
    x, y, heading = way[end]
    assert rollout.wheel(3, state(x, y, heading, 14.0), way, end, 0.0, DT) == pytest.approx(0.0, abs=1e-9)


@given(across=st.floats(-1.0, 1.0), heading=st.floats(-0.6, 0.6), speed=st.floats(1.0, 12.0))
@settings(max_examples=30, deadline=None)
def test_the_best_of_nine_wheels_leaves_the_car_straightest_on_its_way(
    across: float, heading: float, speed: float
) -> None:
    start = state(20.0, across, heading, speed)

    def cost(wheel: float) -> float:
        trial = start.copy()
        rollout.move(trial, -1.0, wheel, DT)
        wanted = max(-0.2, min(0.2, -0.3 * trial[1]))
        return abs(trial[2] + 0.15 * trial[5] - wanted) + 0.05 * abs(wheel)

    wheels = (0.0, -0.2, 0.2, -0.4, 0.4, -0.6, 0.6, -0.78, 0.78)
    best = rollout.wheel(2, start, EAST, 40, -1.0, DT)
    assert cost(best) == pytest.approx(min(cost(wheel) for wheel in wheels))


@given(
    across=st.floats(-3.0, 3.0), heading=st.floats(-0.6, 0.6), speed=st.floats(-0.99, 0.99),
    acceleration=st.floats(-8.0, 8.0),
)  # fmt: skip
@settings(max_examples=50, deadline=None)
def test_below_walking_pace_no_wheel_is_better_than_none(
    across: float, heading: float, speed: float, acceleration: float
) -> None:
    assume(abs(speed + acceleration * DT) < 1.0)
    start = state(20.0, across, heading, speed)
    start[4:] = 0.2, -0.3
    assert rollout.wheel(2, start, EAST, 40, acceleration, DT) == 0.0
    straight = start.copy()
    rollout.move(straight, acceleration, 0.0, DT)
    for wheel in (-0.78, 0.2, 0.78):
        turned = start.copy()
        rollout.move(turned, acceleration, wheel, DT)
        assert turned.tolist() == straight.tolist()


# How far others get ---------------------------------------------------------------------------------------------------


def rolled(speed: float, time_s: float, acceleration: float, low: float, high: float) -> float:
    """Way in small steps, at a speed kept between two bounds."""
    step, way = 1e-3, 0.0
    for _ in range(round(time_s / step)):
        then = max(low, min(high, speed + acceleration * step))
        way += (speed + then) / 2.0 * step
        speed = then
    return way


@given(speed=st.floats(0.0, 30.0), time_s=st.integers(0, 40).map(lambda n: n / 10.0))
@settings(max_examples=25, deadline=None)
def test_the_farthest_and_the_least_another_gets(speed: float, time_s: float) -> None:
    farthest = rolled(speed, time_s, 3.0, 0.0, max(14.0, speed))
    assert rollout.reach_m(speed, time_s, 3.0) == pytest.approx(farthest, abs=1e-2)
    assert rollout.least_m(speed, time_s, 6.0) == pytest.approx(rolled(speed, time_s, -6.0, 0.0, 99.0), abs=1e-2)


@given(speed=st.floats(0.0, 20.0), time_s=st.integers(0, 40).map(lambda n: n / 10.0))
@settings(max_examples=25, deadline=None)
def test_one_who_follows_accelerates_until_it_responds_and_then_brakes(speed: float, time_s: float) -> None:
    blind = min(time_s, 0.5)
    way = rolled(speed, blind, 3.0, 0.0, 99.0) + rolled(speed + 3.0 * blind, time_s - blind, -4.0, 0.0, 99.0)
    assert rollout.following_m(speed, time_s, 3.0, 0.5, 4.0) == pytest.approx(way, abs=2e-2)


# Where anybody crosses ------------------------------------------------------------------------------------------------


def test_the_stretch_where_one_may_be_met_is_as_wide_as_both_and_something_more() -> None:
    """Half its width 1 m, half the ego's length 2.5 m turned by a right angle, 1.5 m of slack: 5 m to either side."""
    north = many(other(20.25, -30.0, math.pi / 2.0, 8.0))
    first, last, hold = rollout.stretch(EAST, 10, SIZE, north, 6.0)
    assert (first * rollout.STEP_M, last * rollout.STEP_M, hold) == (15.5, 25.0, math.inf)
    both = many(other(20.25, -30.0, math.pi / 2.0, 8.0), other(30.25, 30.0, -math.pi / 2.0, 8.0))
    first, last, _ = rollout.stretch(EAST, 10, SIZE, both, 6.0)
    assert (first * rollout.STEP_M, last * rollout.STEP_M) == (15.5, 35.0)
    assert rollout.stretch(EAST, 10, SIZE, both[::-1].copy(), 6.0)[:2] == (first, last)


def test_one_that_has_passed_the_way_is_not_met_on_it() -> None:
    """Its half length 2.5 m, the ego's 2.5 m, 1.5 m of slack: 6.5 m behind it."""
    for y, met in ((6.4, True), (6.6, False)):
        first, last, _ = rollout.stretch(EAST, 10, SIZE, many(other(20.0, y, math.pi / 2.0, 8.0)), 6.0)
        assert (first >= 0) is met
        assert (last >= 0) is met


def test_a_stretch_begins_at_the_tail_and_ends_45_m_on() -> None:
    """The ego is at 40 m; somebody crosses within 5 m to either side."""
    for x, met in ((31.0, True), (29.0, False), (88.0, True), (90.1, False)):
        north = many(other(x, -30.0, math.pi / 2.0, 8.0))
        found = rollout.stretch(EAST, 80, SIZE, north, 6.0)[:2]
        assert (found != (-1, -1)) is met, x


def test_a_lead_may_stop_its_braking_way_on() -> None:
    lead = other(30.0, 0.5, 0.1, 6.0)
    first, last, hold = rollout.stretch(EAST, 20, SIZE, many(lead), 6.0)
    assert (first, last) == (-1, -1)
    assert hold == pytest.approx(30.0 - 2.5 + 36.0 / 12.0)
    assert rollout.stretch(EAST, 20, SIZE, many(lead, other(25.0, 0.0, 0.0, 0.0)), 6.0)[2] == pytest.approx(22.5)
    assert rollout.stretch(EAST, 60, SIZE, many(lead), 6.0)[2] == math.inf, "it is behind"
    assert rollout.stretch(EAST, 20, SIZE, many(other(30.0, 2.1, 0.0, 6.0)), 6.0)[2] == math.inf, "it is beside"


@pytest.mark.parametrize(("turned", "along"), [(39.0, True), (41.0, False), (180.0, False)])
def test_what_is_turned_by_less_than_40_degrees_drives_along(turned: float, along: bool) -> None:
    row = many(other(30.0, 0.0, math.radians(turned), 6.0))
    first, _, hold = rollout.stretch(EAST, 20, SIZE, row, 6.0)
    assert (math.isinf(hold), first >= 0) == (not along, not along)
    behind = state(50.0, 0.0, math.radians(turned), 8.0)
    assert rollout.followed(behind, many(other(30.0, 0.0, 0.0, 8.0))) is along


# Where others go ------------------------------------------------------------------------------------------------------

ALIGNED = math.cos(math.radians(40.0))
NORTHWARDS = (10.0, 0.0, math.pi / 2.0, math.cos(math.pi / 2.0), 1.0)
"""A lane along x = 10."""


def seen(x: float, y: float, heading: float, speed: float) -> tuple[float, ...]:
    """A car of 5 by 2 metres, as an observation has it."""
    return x, y, heading, speed, 5.0, 2.0


def expected(*cars: tuple[float, ...], on: tuple[int, ...]) -> list[list[float]]:
    """The rows of cars around an ego at the origin, on no lane (-1) or the one northwards (0)."""
    numbers = np.array([seen(0.0, 0.0, 0.0, 5.0), *cars])
    return rollout.expected(numbers, np.array(on, dtype=np.int64), np.array([NORTHWARDS]), ALIGNED, 40.0).tolist()


@settings(deadline=None)
@given(x=st.floats(7.0, 13.0), y=st.floats(-99.0, 99.0), turned=st.floats(-0.6, 0.6), speed=st.floats(-2.0, 20.0))
def test_along_a_straight_lane_one_goes_on_as_the_lane_does(x: float, y: float, turned: float, speed: float) -> None:
    """As wide as its body, turned as it is, and half of what it is beside the middle; its own place is covered."""
    ((px, py, c, s, v, long, wide),) = expected(seen(x, y, math.pi / 2.0 + turned, speed), on=(0,))
    assert (px, py) == pytest.approx(((x + 10.0) / 2.0, y))
    assert (c, s, v, long) == (math.cos(math.pi / 2.0), 1.0, max(speed, 0.0), 2.5)
    assert wide == pytest.approx(1.0 + abs(x - 10.0) / 2.0 + 2.5 * abs(math.sin(turned)))


def test_who_is_on_no_such_lane_goes_straight_on_and_is_minded_up_to_40_m() -> None:
    on_a_bend, across = seen(24.0, 32.0, 0.3, 7.0), seen(10.0, 20.0, 0.2, 7.0)
    plain = [[x, y, math.cos(h), math.sin(h), v, 2.5, 1.0] for x, y, h, v, _, _ in (on_a_bend, across)]
    assert expected(on_a_bend, across, on=(-1, 0)) == plain
    far = seen(24.1, 32.0, 0.3, 7.0)
    assert expected(far, across, on=(-1, 0)) == plain[1:]
    assert expected(on=()) == []


def test_somebody_follows_who_comes_from_behind_in_the_same_stream() -> None:
    here = state(50.0, 0.0, 0.1, 8.0)
    behind, ahead, beside = (other(x, y, 0.0, 8.0) for x, y in ((30.0, 1.4), (70.0, 0.0), (30.0, -1.6)))
    crossing = other(50.0, -20.0, math.pi / 2.0, 8.0)
    assert rollout.followed(here, many(behind))
    assert rollout.followed(here, many(ahead, crossing, behind))
    assert not rollout.followed(here, many(ahead, beside, crossing))
    assert not rollout.followed(here, NOBODY)


# Where somebody may be ------------------------------------------------------------------------------------------------


def met(
    ego: Array, row: tuple[float, ...], time_s: float, *, standing: bool = False, minded: int = rollout.MINDED
) -> tuple[bool, int]:
    """Whether the ego is where another may be, and how that one is minded from then on."""
    how = np.full(1, minded)
    found = rollout.met(ego, SIZE, time_s, standing, many(row), how, 0.6, 1.0, 1.5, OTHERS)
    return bool(found), int(how[0])


MINDED, FOLLOWS, PAST = rollout.MINDED, rollout.FOLLOWS, rollout.PAST


@settings(deadline=None)
@given(away=st.floats(0.0, 80.0), speed=st.floats(0.0, 14.0), time_s=st.floats(0.0, 3.0), standing=st.booleans())
def test_one_that_comes_is_met_if_it_can_be_there_before_the_ego_is_gone(
    away: float, speed: float, time_s: float, standing: bool
) -> None:
    """Half its length and half the ego's width off; up to a second later, or six if the ego stands."""
    found, how = met(state(), other(0.0, -away, math.pi / 2.0, speed), time_s, standing=standing)
    left = away - 2.5 - 1.0 - rollout.reach_m(speed, time_s + (6.0 if standing else 1.0), 3.0)
    passed = away + 1.0 + 1.0 - rollout.least_m(speed, time_s, 6.0) + 2.5 <= 0.0
    assume(abs(left) > 1e-9)
    assert found is (left < 0.0 and not passed)
    assert how == MINDED


@pytest.mark.parametrize(("across", "is_met"), [(1.0 + 2.5 + 0.59, True), (1.0 + 2.5 + 0.61, False)])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_beside_its_way_nobody_is_met(across: float, is_met: bool, side: float) -> None:
    assert met(state(), other(side * across, -10.0, math.pi / 2.0, 8.0), 1.0)[0] is is_met


def test_one_that_has_certainly_passed_is_not_met_any_more() -> None:
    """At 12 m/s it gets 9 m in a second at least: its rear is 1 m past the ego's side then, or not."""
    assert met(state(), other(0.0, -4.6, math.pi / 2.0, 12.0), 1.0)[0]
    assert not met(state(), other(0.0, -4.4, math.pi / 2.0, 12.0), 1.0)[0]


def test_a_lead_is_minded_elsewhere_and_one_that_comes_back_is_not_a_lead() -> None:
    assert not met(state(), other(3.0, 0.0, 0.0, 0.0), 0.1)[0]
    assert met(state(), other(3.0, 0.0, math.pi, 0.0), 0.1)[0]


@settings(deadline=None)
@given(away=st.floats(0.0, 60.0), speed=st.floats(0.0, 14.0), time_s=st.floats(0.0, 3.0))
def test_one_that_follows_in_the_stream_is_trusted_to_respond(away: float, speed: float, time_s: float) -> None:
    found, how = met(state(), other(-away, 0.0, 0.0, speed), time_s, minded=FOLLOWS)
    left = away - 5.0 - rollout.following_m(speed, time_s, 3.0, 0.5, 4.0)
    passed = away + 2.5 + 1.0 + 2.5 <= rollout.least_m(speed, time_s, 6.0)
    assume(abs(left) > 1e-9 and away > 0.0)
    assert found is (left < 0.0 and not passed)
    assert how == FOLLOWS


def test_one_that_is_merged_in_front_of_is_not_minded_any_more() -> None:
    """It gets 14 m/s times 2.5 s at most: from then on it follows."""
    near, far = other(-39.9, 0.0, 0.0, 14.0), other(-40.1, 0.0, 0.0, 14.0)
    assert met(state(), near, 1.0) == (True, MINDED)
    assert met(state(), far, 1.0) == (False, PAST)
    assert met(state(), near, 1.0, minded=PAST) == (False, PAST)


def test_each_of_several_is_looked_at() -> None:
    rows = many(other(0.0, 40.0, math.pi / 2.0, 5.0), other(0.0, -5.0, math.pi / 2.0, 5.0))
    for order in (rows, rows[::-1].copy()):
        assert rollout.met(state(), SIZE, 1.0, False, order, np.full(2, MINDED), 0.6, 1.0, 1.5, OTHERS)


@pytest.mark.parametrize(
    ("x", "y", "heading", "inside"),
    [
        (50.0, 0.0, math.pi / 2.0, True),
        (50.0, 0.0, math.pi, True),  # against it
        (50.0, 0.0, 0.0, False),  # in its stream
        (50.0, 1.6, 0.0, True),  # too far beside to be in its stream
        (50.0, 2.5, 0.0, True),
        (50.0, 2.7, 0.0, False),  # 1 m is its width, 1 m the ego's, 0.6 m to the side
        (50.0, 4.0, math.pi / 2.0, True),
        (50.0, -4.2, math.pi / 2.0, False),
        (-0.9, 0.0, math.pi / 2.0, True),
        (-1.1, 0.0, math.pi / 2.0, False),
        (100.9, 0.0, math.pi / 2.0, True),
        (101.1, 0.0, math.pi / 2.0, False),
        (102.4, 0.0, math.pi, True),
        (102.6, 0.0, math.pi, False),
    ],
)
def test_to_stand_in_the_lane_of_others(x: float, y: float, heading: float, inside: bool) -> None:
    """A lane of 100 m along x."""
    lanes = np.array([(1e4, 1e4, 1.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.0, 100.0)])
    assert rollout.in_a_lane(state(x, y, heading), SIZE, lanes, 0.6) is inside


@settings(deadline=None)
@given(across=st.floats(-3.0, 3.0), turned=st.floats(-3.0, 3.0))
def test_how_far_a_body_reaches_to_the_side_is_where_its_corners_are(across: float, turned: float) -> None:
    corners = [
        across + math.sin(turned) * long + math.cos(turned) * wide for long in (-2.5, 2.5) for wide in (-1.0, 1.0)
    ]
    body = state(20.0, across, turned)
    assert rollout.beside_m(body, EAST, 40, SIZE) == pytest.approx(max(abs(corner) for corner in corners))


# Whole plans ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Plan:
    """What is foreseen: a command and a plan after it, on the way along x."""

    start: Array
    first: tuple[float, float] = (0.0, 0.0)
    then_mps2: float = -8.0
    law: int = 0
    beyond: int = 0
    hold_m: float = math.inf
    others: Array = field(default_factory=lambda: NOBODY)
    lanes: Array = field(default_factory=lambda: NO_LANES)
    room_m: float = 2.6
    turn_rad: float = 0.7
    followers: bool = False
    periods: int = 40

    def foreseen(self) -> tuple[float, int]:
        at = rollout.nearest(EAST, self.start[0], self.start[1], -1)
        return rollout.rollout(
            self.start, self.first, self.then_mps2, 8.0, self.law, EAST, at, self.beyond, self.hold_m, SIZE,
            self.others, self.lanes, self.room_m, self.turn_rad, 0.6, 1.0, 1.5, self.followers, OTHERS, BRAKING, DT,
            self.periods,
        )  # fmt: skip


WELL = (math.inf, rollout.NONE)


def test_with_nobody_there_a_stop_ends_well_and_the_state_is_not_touched() -> None:
    start = state(10.0, 0.0, 0.0, 8.0)
    before = start.tolist()
    assert Plan(start).foreseen() == WELL
    assert start.tolist() == before


def test_a_body_that_leaves_its_way_or_turns_away_from_it_ends_badly() -> None:
    off = Plan(state(10.0, 0.0, 0.0, 12.0), first=(0.0, 0.78), law=1)
    assert off.foreseen() == (pytest.approx(0.8), rollout.LEFT)
    assert replace(off, law=0).foreseen() == WELL, "it is steered back"
    wide = replace(off, room_m=math.inf)
    assert wide.foreseen() == WELL
    assert replace(wide, turn_rad=0.3).foreseen()[1] == rollout.LEFT


def test_one_that_is_off_its_way_already_may_be_as_far_off_as_it_is() -> None:
    assert Plan(state(10.0, 4.0, 0.0, 0.0)).foreseen() == WELL
    assert Plan(state(10.0, 0.0, 1.5, 0.0)).foreseen() == WELL
    away = Plan(state(10.0, 4.0, 0.5, 4.0), law=1)
    assert away.foreseen() == (pytest.approx(0.1), rollout.LEFT)


def test_a_stop_in_the_lane_of_others_ends_badly_though_it_is_empty() -> None:
    """8 m/s take 4 m and a period to a stop."""
    for x, ends in ((20.0, WELL[1]), (25.0, rollout.MET)):
        lanes = np.array([(30.0, -50.0, 0.0, 1.0, 100.0)])
        assert Plan(state(x, 0.0, 0.0, 8.0), lanes=lanes).foreseen()[1] == ends


def test_a_stop_where_one_crosses_ends_badly_when_it_may_be_there() -> None:
    crosser = many(other(30.0, -20.0, math.pi / 2.0, 8.0))
    time_s, why = Plan(state(25.0, 0.0, 0.0, 8.0), others=crosser).foreseen()
    assert why == rollout.MET
    assert 0.1 <= time_s <= 1.1
    assert Plan(state(20.0, 0.0, 0.0, 8.0), others=crosser).foreseen() == WELL


def test_who_clears_a_crossing_has_to_be_through_in_time() -> None:
    clear = Plan(state(20.0, 0.0, 0.0, 4.0), then_mps2=2.0, beyond=70, periods=70)
    assert clear.foreseen() == WELL
    assert replace(clear, periods=20).foreseen() == (pytest.approx(2.0), rollout.LATE)
    near = many(other(30.0, -25.0, math.pi / 2.0, 8.0))
    assert replace(clear, others=near).foreseen()[1] == rollout.MET
    far = many(other(30.0, -80.0, math.pi / 2.0, 8.0))
    assert replace(clear, others=far).foreseen() == WELL


def test_who_is_beyond_at_the_end_is_through_even_before_things_settle() -> None:
    clear = Plan(state(20.0, 0.0, 0.0, 4.0), then_mps2=2.0, beyond=39, periods=10)
    assert clear.foreseen() == WELL
    assert replace(clear, beyond=60).foreseen()[1] == rollout.LATE


def test_a_crossing_is_cleared_no_faster_than_told() -> None:
    """From 8 m/s on it coasts: 32 m in 4 s, not 48."""
    clear = Plan(state(10.0, 0.0, 0.0, 8.0), then_mps2=2.0, periods=40)
    assert replace(clear, beyond=round(41.0 / rollout.STEP_M)).foreseen() == WELL
    assert replace(clear, beyond=round(43.0 / rollout.STEP_M)).foreseen()[1] == rollout.LATE


def test_behind_a_lead_that_may_stop_a_plan_stops_too_and_is_late() -> None:
    clear = Plan(state(10.0, 0.0, 0.0, 4.0), then_mps2=2.0, beyond=60, periods=70)
    assert clear.foreseen() == WELL
    held = replace(clear, hold_m=25.0, lanes=np.array([(20.0, -50.0, 0.0, 1.0, 100.0)]))
    assert held.foreseen()[1] == rollout.MET, "it stands in the lane before the lead"
    short = replace(held, hold_m=16.0)
    assert short.foreseen() == WELL, "it stands before that lane"


def test_one_that_follows_in_the_stream_counts_where_followers_do() -> None:
    """It is 1 m behind, and as fast: if the ego stops hard it cannot."""
    behind = many(other(4.0, 0.0, 0.0, 8.0))
    stop = Plan(state(10.0, 0.0, 0.0, 8.0), others=behind)
    assert stop.foreseen() == WELL
    assert replace(stop, followers=True).foreseen()[1] == rollout.MET
    ahead = many(other(30.0, 0.0, 0.0, 8.0))
    assert replace(stop, others=ahead, followers=True).foreseen() == WELL


def test_when_it_stands_the_tyres_carry_a_turn_on() -> None:
    """Half a second of the turn: at 1 rad/s the body is turned by 0.5 rad more than when it came to stand."""
    still = state(10.0, 0.0, 0.0, 0.0)
    assert Plan(still, turn_rad=0.2).foreseen() == WELL
    spinning = still.copy()
    spinning[5] = 3.0
    stop = Plan(spinning, law=1, turn_rad=0.6)
    assert stop.foreseen()[1] == rollout.LEFT
    assert replace(stop, turn_rad=math.inf, room_m=math.inf).foreseen() == WELL
    sliding = still.copy()
    sliding[4] = 6.0
    aside = Plan(sliding, law=1, room_m=1.5, turn_rad=math.inf)
    assert aside.foreseen()[1] == rollout.LEFT
    assert replace(aside, room_m=math.inf).foreseen() == WELL


# What ends well, does -------------------------------------------------------------------------------------------------


def overlap(one: tuple[float, float, float], another: tuple[float, float, float]) -> bool:
    """Whether two cars of 5 by 2 metres, by (x, y, heading), overlap: no axis of theirs separates them."""
    corners = []
    for x, y, heading in (one, another):
        c, s = math.cos(heading), math.sin(heading)
        corners.append([(x + c * a - s * b, y + s * a + c * b) for a in (-2.5, 2.5) for b in (-1.0, 1.0)])
    for heading in (one[2], one[2] + math.pi / 2.0, another[2], another[2] + math.pi / 2.0):
        c, s = math.cos(heading), math.sin(heading)
        (low, high), (from_, to) = (
            (min(c * x + s * y for x, y in body), max(c * x + s * y for x, y in body)) for body in corners
        )
        if high < from_ or to < low:
            return False
    return True


@settings(max_examples=60, deadline=None)
@given(
    x=st.floats(5.0, 28.0),
    speed=st.floats(0.0, 10.0),
    asked=st.floats(-8.0, 5.0),
    then=st.sampled_from([-8.0, 2.0, 5.0]),
    away=st.floats(5.0, 60.0),
    their_speed=st.floats(0.0, 14.0),
    angle=st.floats(0.8, 2.3),
    draws=st.lists(st.floats(-6.0, 3.0), min_size=70, max_size=70),
)
def test_whoever_crosses_does_not_touch_a_car_whose_plan_ends_well(
    x: float, speed: float, asked: float, then: float, away: float, their_speed: float, angle: float,
    draws: list[float],
) -> None:  # fmt: skip
    """It goes straight on, and brakes or accelerates at will within its bounds."""
    c, s = math.cos(angle), math.sin(angle)
    row = other(30.0 - away * c, -away * s, angle, their_speed)
    asked = max(asked, -speed / DT)
    start = state(x, 0.0, 0.0, speed)
    at = rollout.nearest(EAST, x, 0.0, -1)
    _, last, _ = rollout.stretch(EAST, at, SIZE, many(row), OTHERS[1])
    plan = Plan(start, (asked, 0.0), then, others=many(row), beyond=last + 5, periods=25 if then < 0.0 else 70)
    if plan.foreseen() != WELL:
        return
    ego, gone = start.copy(), 0.0
    for period, draw in enumerate(draws):
        acceleration = asked if period == 0 else then if then < 0.0 or ego[3] < 8.0 else 0.0
        rollout.move(ego, max(acceleration, -ego[3] / DT), 0.0, DT)
        faster = max(0.0, min(14.0, their_speed + draw * DT))
        gone += (their_speed + faster) / 2.0 * DT
        their_speed = faster
        place = row[0] + gone * c, row[1] + gone * s, angle
        assert not overlap((ego[0], ego[1], ego[2]), place), (period, ego[0], place)


def test_warming_up_loads_all_that_is_called_from_outside() -> None:
    rollout.warm_up()
    names = ("nearest", "stretch", "expected", "followed", "wheel", "rollout", "move")
    forms = {name: getattr(getattr(rollout, name), "signatures", ["as it is, uncompiled"]) for name in names}
    assert all(forms.values()), forms
