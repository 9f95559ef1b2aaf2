"""The test track: its plants are the library's, its manoeuvres the paper's, and it obeys the contract of worlds."""

from __future__ import annotations

import math
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from chauffeur.concept import Command, ScenarioError
from chauffeur.worlds.base import EGO, World
from chauffeur.worlds.track import BUILT_IN, FRICTION, MANOEUVRES, TrackWorld, track_scenario
from chauffeur.worlds.track.manoeuvres import manoeuvre

pytest.importorskip("vehiclemodels")

from chauffeur.worlds.track.dynamics import (
    PLANTS,
    Plant,
    dynamics,
    initial_state,
    parameters,
)


def world_of(name: str, weather: str = "sunny", noise: float = 0.0, plant: Plant = "std") -> TrackWorld:
    scenario = track_scenario(name, weather, plant)  # type: ignore[arg-type]
    world = TrackWorld()
    world.reset(replace(scenario, config={**scenario.config, "noise": noise}))
    return world


@pytest.mark.parametrize("plant", PLANTS)
def test_compiled_dynamics_are_the_librarys(plant: Plant) -> None:
    theirs = getattr(import_module(f"vehiclemodels.vehicle_dynamics_{plant}"), f"vehicle_dynamics_{plant}")
    rng, ours = np.random.default_rng(3), dynamics(plant)
    for speed in (0.0, 0.3, 5.0, 14.0):
        for _ in range(10):
            state = initial_state(plant, 0.0, 0.0, 0.1, speed)
            state = state + rng.normal(size=len(state)) * 0.01
            state[3] = abs(state[3])
            inputs = rng.normal(size=2)
            expected = theirs(state.tolist(), inputs.tolist(), parameters())
            assert ours(state.copy(), inputs, 1.0) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_manoeuvres_are_the_papers() -> None:
    for name in MANOEUVRES:
        world = world_of(name)
        shot = world.observe()
        assert isinstance(world, World)
        if name == "left_turn":
            assert shot.ego.speed_mps == pytest.approx(30 / 3.6)
            tightest = max(abs(manoeuvre(name).path.curvature(s, 2.0)) for s in range(45, 60))
            assert tightest == pytest.approx(1 / 23.89, rel=0.01)
            end = manoeuvre(name).path.at(1e9).heading_rad
            assert end == pytest.approx(math.pi / 2, abs=0.01)
            assert shot.others == ()
        else:
            (lead,) = shot.others
            gap = lead.x_m - shot.ego.x_m - (lead.length_m + shot.ego.length_m) / 2.0
            assert gap == pytest.approx(30.0, abs=1e-6)
            assert lead.speed_mps == 0.0
            assert shot.ego.speed_mps == pytest.approx(0.0 if name == "acceleration" else 50 / 3.6)


def test_the_lead_vehicle_accelerates_as_described() -> None:
    world = world_of("acceleration")
    start = world.observe().others[0].x_m
    for _ in range(240):
        world.step(Command(0.0, 0.0))
    lead = world.observe().others[0]
    rise = 12.5 / 1.26
    assert lead.speed_mps == pytest.approx(45 / 3.6)
    assert lead.x_m - start == pytest.approx(0.5 * 12.5 * rise + 12.5 * (12.0 - rise))
    assert world.observe().ego.speed_mps == 0.0


def test_same_seed_same_trip_and_another_seed_another() -> None:
    trips: list[list[float]] = []
    for seed in (1, 1, 2):
        world = TrackWorld()
        world.reset(track_scenario("lane_change", "sunny"), seed)
        for _ in range(20):
            world.step(Command(0.0, 0.01))
        ego = world.observe().ego
        trips.append([ego.x_m, ego.y_m, ego.heading_rad])
    assert trips[0] == trips[1] != trips[2]


def test_a_positive_angle_steers_to_the_left_after_a_lag() -> None:
    world = world_of("left_turn")
    world.step(Command(0.0, 0.3))
    first = world.observe().ego
    assert 0.0 < first.steering_rad <= 0.4 * 0.05 + 1e-9, "the wheel turns at 0.4 rad/s at most"
    for _ in range(10):
        world.step(Command(0.0, 0.3))
    ego = world.observe().ego
    assert ego.y_m > 0.0
    assert ego.yaw_rate_radps > 0.0


def test_snow_takes_grip() -> None:
    stops: list[float] = []
    for weather in FRICTION:
        world = world_of("lane_change", weather)
        for _ in range(30):
            world.step(Command(-8.0, 0.0))
        stops.append(world.observe().ego.speed_mps)
    dry, _, _, snow, night = stops
    assert dry == night < 4.0 < snow


def test_driving_into_the_lead_is_a_collision_and_ends_the_world() -> None:
    world = world_of("lane_change")
    while not world.ended:
        world.step(Command(1.0, 0.0))
    assert world.observe().ego.crashed


def test_leaving_the_lanes_is_off_road() -> None:
    world = world_of("lane_change")
    while not world.ended:
        world.step(Command(0.0, -0.1))
    assert world.observe().off_road
    assert not world.observe().ego.crashed


def test_its_driver_follows_the_bend_when_nobody_wishes_anything() -> None:
    world = world_of("left_turn", noise=1.0)
    driver = world.driver()
    wishes = driver.initial_setpoints()
    while not world.ended:
        wishes = driver.settle(wishes)
        world.step(driver.command(wishes))
    final = world.observe()
    assert not final.off_road
    assert final.ego.heading_rad == pytest.approx(math.pi / 2, abs=0.05)
    assert world.perception().vehicle(EGO) == final.ego


def test_a_bad_configuration_is_refused_in_words() -> None:
    bad = replace(BUILT_IN[0], config={"manoeuvre": "drift"})
    with pytest.raises(ScenarioError, match="bad track configuration: manoeuvre"):
        TrackWorld().reset(bad)
    with pytest.raises(ScenarioError, match="no scenario"):
        TrackWorld().step(Command(0.0, 0.0))
