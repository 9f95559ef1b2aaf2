"""The formulas of the shield: against bisection, against ad-rss where it is installed, and as an invariant."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from chauffeur.safety.shield.gaps import braking_gap_m, free_gap_m, greatest_acceleration, rss_gap_m

DT = 0.1
BRAKING, OTHERS = 8.0, 6.0

SHORT_M = BRAKING * DT**2 / 8.0 + 1e-6
"""What a stop that ends within a period may be off."""

speeds = st.floats(0.0, 40.0)
gaps = st.floats(0.0, 150.0)


@given(speed=speeds, gap=st.floats(-20.0, 200.0), lead=speeds)
def test_the_bound_is_the_greatest_that_still_stops(speed: float, gap: float, lead: float) -> None:
    def left(acceleration: float) -> float:
        """What the gap exceeds its need by, a period later, if the lead brakes as hard as it can."""
        after = max(0.0, speed + acceleration * DT)
        slowed = max(0.0, lead - OTHERS * DT)
        travelled = max(speed, after) * DT if lead == 0.0 else speed * DT
        return gap + lead * DT - travelled - braking_gap_m(after, slowed, BRAKING, OTHERS, DT)

    bound = greatest_acceleration(speed, gap, lead, BRAKING, OTHERS, DT)
    assert bound >= -BRAKING
    if bound > -BRAKING and speed + bound * DT >= 0.0:
        assert left(bound) >= -1e-6
        if lead == 0.0:
            assert left(bound + 0.01) < 1e-3


BRAKES = st.sampled_from([(8.0, 6.0), (8.0, 7.5), (8.0, 8.0), (6.0, 8.0)])
"""Of the ego and of the lead: better, a little better, as good, worse."""


def allowed(speed: float, then: float, gap: float, lead: float, braking: float, others: float) -> bool:
    """Whether a speed a period later still leaves the ego room, however the lead brakes: both ways one can meet it."""
    travelled = max(speed, then) * DT  # who gains speed travels the next period at the new one
    stopped = gap + lead**2 / (2.0 * others) - travelled >= then**2 / (2.0 * braking) + 0.5 * then * DT
    stronger, slowed = braking - others, max(0.0, lead - others * DT)
    if stronger <= 0.0 or slowed == 0.0:
        return stopped
    # The better brakes: they are closest when it is as slow as the lead, if that is before the lead stands.
    room = gap + (lead - speed) * DT

    def fits(closing: float) -> bool:
        return closing**2 / (2.0 * stronger) + 0.5 * closing * DT <= room

    if room <= 0.0:
        return False
    stands_first = fits(stronger * slowed / others)
    return stopped and (stands_first or then <= slowed or fits(then - slowed))


@given(speed=speeds, gap=st.floats(0.0, 60.0), lead=speeds, brakes=BRAKES)
def test_the_bound_is_the_greatest_behind_a_lead_that_moves_too(
    speed: float, gap: float, lead: float, brakes: tuple[float, float]
) -> None:
    bound = greatest_acceleration(speed, gap, lead, *brakes, DT)
    assert bound >= -brakes[0]
    for off in (-1e-6, 1e-6):
        then = speed + (bound + off) * DT
        if then >= 0.0 and bound + off > -brakes[0]:
            assert allowed(speed, then, gap, lead, *brakes) is (off < 0.0), (bound, off)


@given(speed=speeds, lead=speeds, brakes=BRAKES, near=st.floats(-1.0, 3.0))
def test_the_bound_is_the_greatest_where_it_matters(
    speed: float, lead: float, brakes: tuple[float, float], near: float
) -> None:
    """About as near as braking allows."""
    gap = max(0.0, braking_gap_m(speed, lead, *brakes, DT) + near)
    bound = greatest_acceleration(speed, gap, lead, *brakes, DT)
    for off in (-1e-6, 1e-6):
        then = speed + (bound + off) * DT
        if then >= 0.0 and bound + off > -brakes[0]:
            assert allowed(speed, then, gap, lead, *brakes) is (off < 0.0), (bound, off)


def test_without_any_room_left_it_is_full_braking() -> None:
    """Though as slow as the lead, or hardly moving, it has nothing to spare."""
    assert greatest_acceleration(10.0, 0.0, 10.0, BRAKING, OTHERS, DT) == -BRAKING
    assert greatest_acceleration(0.5, 0.05, 0.0, BRAKING, OTHERS, DT) == -BRAKING
    assert greatest_acceleration(1.75, 0.04, 1.32, 9.0, 4.0, DT) == -9.0, "the lead is slow, and brakes much worse"


@given(speed=speeds, lead=speeds, gap=gaps, draws=st.lists(st.floats(0.0, 1.0), min_size=80, max_size=80))
def test_who_obeys_it_never_touches_whatever_the_lead_does(
    speed: float, lead: float, gap: float, draws: list[float]
) -> None:
    """A lead that brakes or accelerates at will within its bounds, an ego that always takes the greatest it may."""
    if gap < braking_gap_m(speed, lead, BRAKING, OTHERS, DT):
        return  # unsafe from the beginning: nobody promises anything
    for draw in draws:
        acceleration = greatest_acceleration(speed, gap, lead, BRAKING, OTHERS, DT)
        acceleration = max(acceleration, -speed / DT)
        gap += (lead - speed) * DT
        speed = max(0.0, speed + acceleration * DT)
        lead = max(0.0, lead + (-OTHERS + draw * 9.0) * DT)
        assert gap >= -SHORT_M


@given(rear=speeds, front=speeds)
def test_a_safe_gap_grows_with_the_rear_speed_and_shrinks_with_the_front_one(rear: float, front: float) -> None:
    gap = rss_gap_m(rear, front, 0.5, 3.0, 4.0, 8.0)
    assert gap >= 0.0
    assert rss_gap_m(rear + 1.0, front, 0.5, 3.0, 4.0, 8.0) >= gap
    assert rss_gap_m(rear, front + 1.0, 0.5, 3.0, 4.0, 8.0) <= gap


def test_a_gap_by_hand() -> None:
    """10 m/s behind 10 m/s, 1 s response at 2 m/s2, 4 against 8 m/s2: 11 + 12^2/8 - 10^2/16 m."""
    assert rss_gap_m(10.0, 10.0, 1.0, 2.0, 4.0, 8.0) == pytest.approx(11.0 + 18.0 - 6.25)
    assert rss_gap_m(0.0, 30.0, 1.0, 2.0, 4.0, 8.0) == 0.0
    assert rss_gap_m(10.0, -3.0, 0.0, 2.0, 5.0, 8.0) == pytest.approx(10.0)


def test_no_room_means_full_braking() -> None:
    assert greatest_acceleration(20.0, -1.0, 0.0, BRAKING, OTHERS, DT) == -BRAKING
    assert greatest_acceleration(20.0, 1.0, -5.0, BRAKING, OTHERS, DT) == -BRAKING
    assert math.isfinite(greatest_acceleration(0.0, 0.0, 0.0, BRAKING, OTHERS, DT))


def test_a_gap_for_braking_by_hand() -> None:
    """4 m/s faster than a lead at 26 m/s, 8 against 6 m/s2: closest after 2 s, 4 m and half a period nearer."""
    assert braking_gap_m(30.0, 26.0, 8.0, 6.0, 0.1) == pytest.approx(4.0 + 0.2)
    assert braking_gap_m(20.0, 0.0, 8.0, 6.0, 0.1) == pytest.approx(25.0 + 1.0)
    assert braking_gap_m(20.0, 20.0, 5.0, 6.0, 0.0) == pytest.approx(40.0 - 400.0 / 12.0)
    assert braking_gap_m(10.0, 20.0, 8.0, 6.0, 0.1) == 0.0
    assert braking_gap_m(20.5, 20.0, 8.0, 6.0, 0.1) == pytest.approx(0.0625 + 0.025)
    assert braking_gap_m(8.0, 6.0, 8.0, 6.0, 0.1) == pytest.approx(1.0 + 0.1), "the lead stands at that very instant"
    assert braking_gap_m(1.0, 1.0, 8.0, 6.0, 0.1) == pytest.approx(1.0 / 16.0 + 0.05 - 1.0 / 12.0)


def test_ad_rss_agrees_on_the_safe_gap() -> None:
    oracle = pytest.importorskip("ad_rss", reason="ad-rss, the oracle of this test, is not installed (extra `oracle`)")
    import numpy as np

    rng = np.random.default_rng(5)
    for rear, front in rng.uniform(0.0, 40.0, (300, 2)):
        theirs = oracle.physics.Distance(0.0)
        assert oracle.rss.structured.calculateSafeLongitudinalDistanceSameDirection(
            _state(oracle, float(front)), _state(oracle, float(rear)), theirs
        )
        assert rss_gap_m(rear, front, 0.5, 3.0, 4.0, 8.0) == pytest.approx(theirs.mDistance, abs=1e-6)


def _state(oracle: Any, speed: float) -> Any:
    """A vehicle of ad-rss at a speed along its lane: it refuses to calculate unless every field is set."""
    unit = oracle.physics
    state = oracle.rss.core.RelativeObjectState()
    state.object_type = oracle.rss.world.ObjectType.OtherVehicle
    dynamics = state.dynamics
    for part, values in (
        (dynamics.alpha_lon, {"accel_max": 3.0, "brake_max": -8.0, "brake_min": -4.0, "brake_min_correct": -3.0}),
        (dynamics.alpha_lat, {"accel_max": 0.2, "brake_min": -0.8}),
    ):
        for name, value in values.items():
            setattr(part, name, unit.Acceleration(value))
    dynamics.lateral_fluctuation_margin = dynamics.min_longitudinal_safety_distance = unit.Distance(0.0)
    dynamics.response_time = unit.Duration(0.5)
    dynamics.max_speed_on_acceleration = unit.Speed(100.0)
    settings = dynamics.unstructured_settings
    for name in (name for name in dir(settings) if name.startswith(("vehicle_", "pedestrian_", "drive_"))):
        value = getattr(settings, name)
        if not isinstance(value, int):
            setattr(settings, name, type(value)(0.1))
    place = state.unstructured_object_state
    place.yaw = place.steering_angle = unit.Angle(0.0)
    place.yaw_rate = unit.AngularVelocity(0.0)
    place.dimension.length, place.dimension.width = unit.Distance(5.0), unit.Distance(2.0)
    place.center_point.x = place.center_point.y = unit.Distance(0.0)
    place.speed_range.minimum = place.speed_range.maximum = unit.Speed(speed)
    lane = state.structured_object_state
    lane.velocity.speed_lon_min = lane.velocity.speed_lon_max = unit.Speed(speed)
    lane.velocity.speed_lat_min = lane.velocity.speed_lat_max = unit.Speed(0.0)
    lane.distance_to_enter_intersection, lane.distance_to_leave_intersection = unit.Distance(0.0), unit.Distance(1e3)
    lane.has_priority, lane.is_in_correct_lane = False, True
    return state


@given(speed=speeds, lead=st.floats(-5.0, 60.0), wanted=st.floats(0.0, 5.0), more=st.floats(1e-6, 150.0), brakes=BRAKES)
def test_beyond_the_free_gap_no_lead_bounds_an_acceleration(
    speed: float, lead: float, wanted: float, more: float, brakes: tuple[float, float]
) -> None:
    braking, others = brakes
    free = free_gap_m(speed, wanted, braking, DT)
    assert greatest_acceleration(speed, free + more, lead, braking, others, DT) >= wanted - 1e-6


@given(speed=speeds, wanted=st.floats(0.1, 5.0))
def test_the_free_gap_is_what_a_lead_that_stands_asks_for(speed: float, wanted: float) -> None:
    free = free_gap_m(speed, wanted, BRAKING, DT)
    assume(free > 0.5)
    assert greatest_acceleration(speed, free - 0.5, 0.0, BRAKING, OTHERS, DT) < wanted
