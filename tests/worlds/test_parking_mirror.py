"""A lot shown to another process: the copy is at the same instant to the last bit, and goes on the same way."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.concept import Command, DataError, Scenario, ScenarioError, Setpoints
from chauffeur.driving.actuate import actuate
from chauffeur.worlds.base import EGO, MirroredWorld
from chauffeur.worlds.parking import ParkingWorld


def started(seed: int = 3, **config: object) -> ParkingWorld:
    world = ParkingWorld()
    world.reset(Scenario("lot", "parking", {"cars": 2, "walkers": 3, **config}, seed))
    return world


def drive(world: ParkingWorld, periods: int, place: str = "stadium") -> None:
    setpoints = Setpoints(target_speed_mps=3.5, target_lane=world.spot(place).lane)
    for _ in range(periods):
        driver = world.driver()
        actuate(world, None, driver.command(driver.settle(setpoints)), None, None)


def step_both(one: ParkingWorld, other: ParkingWorld, periods: int) -> None:
    for k in range(periods):
        command = Command(0.3 - 0.01 * k, 0.02 * (k % 7 - 3))
        assert actuate(one, None, command, None, None) == actuate(other, None, command, None, None)
        assert one.observe() == other.observe()


def test_it_keeps_the_contract_and_says_so_before_the_first_reset() -> None:
    assert isinstance(started(), MirroredWorld)
    for ask in (ParkingWorld().mirrored, lambda: ParkingWorld().adopt(b"")):
        with pytest.raises(ScenarioError, match="no scenario"):
            ask()


@pytest.mark.parametrize("seed", [3, 8, 21])
def test_a_copy_is_at_the_instant_shown_and_goes_on_the_same_way(seed: int) -> None:
    world, copy = started(seed), started(seed)
    for _ in range(6):
        drive(world, 25)
        copy.adopt(world.mirrored())
        assert copy.observe() == world.observe()
        assert copy.mirrored() == world.mirrored()
        blocker = world.perception().front_blocker(frozenset())
        assert copy.perception().front_blocker(frozenset()) == blocker
        assert copy.perception().lane_of(EGO) == world.perception().lane_of(EGO)
        assert copy.parked() == world.parked()
    assert copy.spot("exit").name == world.spot("exit").name
    step_both(world, copy, 40)


def test_a_car_that_has_left_is_gone_in_the_copy_and_comes_back_with_an_older_instant() -> None:
    small = {"cars": 1, "walkers": 1, "aisles": 1, "spots_a_row": 2}
    world, copy = started(2, **small), started(2, **small)
    number = world.observe().others[-2].id
    early = world.mirrored()
    for _ in range(500):
        actuate(world, None, Command(-8.0, 0.0), None, None)
    copy.adopt(world.mirrored())
    assert copy.observe() == world.observe()
    with pytest.raises(KeyError):
        copy.perception().vehicle(number)
    copy.adopt(early)
    assert copy.perception().vehicle(number).id == number
    assert copy.observe().tick == 0


def test_a_collision_is_seen_in_the_copy() -> None:
    world, copy = started(1, taken=0.95, cars=0, walkers=0), started(1, taken=0.95, cars=0, walkers=0)
    while not world.ended:
        ego = world.observe().ego
        turns = ego.x_m > 0.0 and ego.heading_rad > -1.2
        actuate(world, None, Command(0.3, -0.5 if turns else 0.0), None, None)
    copy.adopt(world.mirrored())
    assert copy.observe() == world.observe()
    assert copy.ended
    assert sum(other.crashed for other in copy.observe().others) == 1
    step_both(world, copy, 10)


def test_adopting_leaves_no_thread_between_the_two() -> None:
    world, copy = started(5), started(5)
    drive(world, 30)
    copy.adopt(world.mirrored())
    before = copy.observe()
    drive(world, 30)
    assert copy.observe() == before


def spoilt(observation: bytes) -> list[bytes]:
    nan = struct.pack("<d", float("nan"))
    first_car = 53
    return [
        b"",
        observation[:-1],
        observation + b"\0",
        observation[:8] + nan + observation[16:],
        struct.pack("<Q", 1 << 60) + observation[8:],
        observation[:first_car] + struct.pack("<H", 999) + observation[first_car + 2 :],
    ]


@pytest.mark.parametrize("case", range(6))
def test_what_is_no_instant_of_this_lot_leaves_the_copy_as_it_was(case: int) -> None:
    world = started(4)
    drive(world, 20)
    copy = started(4)
    copy.adopt(world.mirrored())
    before, bytes_before = copy.observe(), copy.mirrored()
    bad = spoilt(world.mirrored())[case]
    assert bad != bytes_before
    with pytest.raises(DataError):
        copy.adopt(bad)
    assert copy.observe() == before
    assert copy.mirrored() == bytes_before


def test_an_instant_of_another_lot_is_none_of_this() -> None:
    with pytest.raises(DataError, match="another lot"):
        started(4, cars=0, walkers=0).adopt(started(4).mirrored())


_SHARED = started(6)


@given(st.binary(max_size=300))
@settings(max_examples=60, deadline=None)
def test_no_bytes_do_more_than_be_refused(payload: bytes) -> None:
    world = _SHARED
    before = world.mirrored()
    try:
        world.adopt(payload)
    except DataError:
        assert world.mirrored() == before


def test_after_others_have_driven_the_driver_looks_for_its_way_anew() -> None:
    """As after a plan that was driven with pure pursuit: the way found at the entrance leads elsewhere by then."""
    world, on = started(8), Setpoints(target_speed_mps=3.0)
    driver = world.driver()
    driver.command(driver.settle(on))
    drive_by = world.copy()
    spot = Setpoints(target_speed_mps=3.5, target_lane=world.spot("nearest").lane)
    while drive_by.observe().ego.y_m > -12.0:
        command = drive_by.driver().command(drive_by.driver().settle(spot))
        assert actuate(drive_by, None, command, None, None) == actuate(world, None, command, None, None)
    fresh = world.copy().driver()
    assert driver.command(driver.settle(on)) == fresh.command(fresh.settle(on))
