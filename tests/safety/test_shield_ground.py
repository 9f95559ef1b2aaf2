"""The last word in a lot: whatever is asked of the car, it touches nobody and stays on the ground."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.concept import Command, Scenario
from chauffeur.driving.actuate import actuate
from chauffeur.safety.shield import FilterResult, GroundShield, shield_for
from chauffeur.worlds.parking import ParkingWorld, overlap

wheels = st.sampled_from([-0.6, -0.3, -0.1, 0.0, 0.1, 0.3, 0.6])
pedals = st.sampled_from([-8.0, -1.0, 0.0, 1.0, 3.0])
stretches = st.lists(st.tuples(st.integers(2, 25), pedals, wheels), min_size=2, max_size=8)


def _lot(seed: int, **config: object) -> ParkingWorld:
    world = ParkingWorld()
    world.reset(Scenario("lot", "parking", dict(config), seed))
    return world


@given(st.integers(0, 50), stretches)
@settings(max_examples=25, deadline=None)
def test_a_car_driven_by_chance_touches_nobody_who_stands_or_walks(
    seed: int, hands: list[tuple[int, float, float]]
) -> None:
    world = _lot(seed, cars=0, walkers=3, ego_speed=4.0)
    shield = GroundShield(world, world.dt_s)
    for periods, pedal, wheel in hands:
        for _ in range(periods):
            actuate(world, world.observe(), Command(pedal, wheel), None, shield)
            final = world.observe()
            assert not final.ego.crashed
            assert not final.off_road
            assert final.ego.speed_mps < 15.0 / 3.6 + 1.0 + 1e-6


def test_straight_at_the_parked_cars_it_stops_in_front_of_them() -> None:
    world = _lot(1, taken=0.95, cars=0, walkers=0)
    shield = GroundShield(world, world.dt_s)
    rules: set[str] = set()
    for _ in range(300):
        ego = world.observe().ego
        turns = ego.x_m > 0.0 and ego.heading_rad > -math.radians(70.0)
        done = actuate(world, world.observe(), Command(0.3, -0.5 if turns else 0.0), None, shield)
        rules |= {change.rule for change in done.interventions}
    final = world.observe()
    assert not final.ego.crashed
    assert final.ego.speed_mps < 0.2
    assert "room" in rules
    assert any(overlap(final.ego.box.grown(0.5), other.box) for other in final.others), "not sooner than needed"


def test_what_is_well_is_let_through_and_what_is_no_number_is_not() -> None:
    world = _lot(3, cars=0, walkers=0)
    shield = shield_for(world)
    assert isinstance(shield, GroundShield)
    fine = Command(0.4, 0.02)
    assert shield.filter(world.observe(), fine) == FilterResult(fine)
    guarded = shield.filter(world.observe(), Command(math.nan, 0.0))
    assert guarded.command.acceleration_mps2 == -8.0
    assert guarded.interventions[0].rule == "finite"
    fast = shield.filter(world.observe(), Command(90.0, 0.0))
    assert fast.interventions[0].rule == "speed"
    assert fast.command.acceleration_mps2 == pytest.approx((15.0 / 3.6 + 1.0 - 3.0) / world.dt_s)
