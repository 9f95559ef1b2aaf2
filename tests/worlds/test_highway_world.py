from __future__ import annotations

import math
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import chauffeur.worlds.highway.gym
from chauffeur.concept import Command, DataError, Scenario, ScenarioError, Setpoints
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.fitness import fit_to_begin
from chauffeur.worlds.highway.scenarios import BUILT_IN

BY_ID = {s.id: s for s in BUILT_IN}


def _drive(world: HighwayWorld, setpoints: Setpoints, steps: int) -> Setpoints:
    driver = world.driver()
    for _ in range(steps):
        setpoints = driver.settle(setpoints)
        world.step(driver.command(setpoints))
    return setpoints


def test_another_seed_is_another_traffic() -> None:
    world = HighwayWorld()
    assert world.reset(BY_ID["cruise"], 1).others != world.reset(BY_ID["cruise"], 2).others


def test_huge_seeds_are_fine() -> None:
    world = HighwayWorld()
    assert world.reset(BY_ID["cruise"], 10**42) == world.reset(BY_ID["cruise"], 10**42)


def test_observation_agrees_with_perception() -> None:
    world = HighwayWorld()
    observation = world.reset(BY_ID["following"])
    perception = world.perception()
    assert observation.ego == perception.vehicle(EGO)
    assert observation.front is not None
    front, _ = perception.neighbours(perception.lane_of(EGO))
    assert front == observation.front.vehicle
    assert perception.distance_along(EGO, front) == observation.front.distance_m
    assert observation.front.speed_mps == perception.vehicle(front).speed_mps
    assert {v.id for v in observation.others} | {o.id for o in observation.objects} | {EGO} == set(
        range(len(observation.others) + len(observation.objects) + 1)
    )


def test_an_instant_is_looked_at_once_and_never_after_it_is_gone() -> None:
    world, elsewhere = HighwayWorld(), HighwayWorld()
    start = world.reset(BY_ID["overtake"])
    assert world.observe() is start
    twin = world.copy()
    world.driver().command(world.driver().settle(Setpoints(20.0, turn="left")))
    assert world.observe() is start, "to ask changes nothing"
    with pytest.raises(ValueError, match="finite"):
        world.step(Command(math.nan, 0.0))
    assert world.observe() is start
    world.step(Command(1.0, 0.0))
    then = world.observe()
    assert then is world.observe()
    assert (then.tick, twin.observe()) == (1, start)
    assert then.others != start.others
    twin.step(Command(1.0, 0.0))
    assert twin.observe() == then
    assert elsewhere.reset(BY_ID["overtake"]) == start
    elsewhere.adopt(world.mirrored())
    assert elsewhere.observe() == then
    with pytest.raises(DataError):
        elsewhere.adopt(b"")
    assert elsewhere.observe() == then
    assert world.reset(BY_ID["overtake"]) == start


def test_lane_edges() -> None:
    world = HighwayWorld()
    world.reset(BY_ID["emergency-lane"])
    perception = world.perception()
    lane = perception.lane_of(EGO)
    assert lane == "a-b:1"
    assert perception.adjacent_lane(lane, -1) == "a-b:0"
    assert perception.adjacent_lane("a-b:0", -1) is None
    assert perception.adjacent_lane("a-b:3", 1) is None
    assert not perception.has_lane("a-b:9")
    assert not perception.has_lane("nowhere-b:0")
    emergency = [view for view in world.observe().road.lanes if view.emergency]
    assert [view.id for view in emergency] == ["a-b:3"]
    with pytest.raises(KeyError):
        perception.vehicle(999)


def test_lane_wish_is_followed() -> None:
    world = HighwayWorld()
    world.reset(BY_ID["emergency-lane"])
    _drive(world, replace(world.driver().initial_setpoints(), target_lane="a-b:3"), 60)
    assert world.perception().lane_of(EGO) == "a-b:3"
    assert abs(world.observe().ego.y_m + 12.0) < 0.3


def test_intersection_stops_at_the_sign_until_it_is_served() -> None:
    world = HighwayWorld()
    observation = world.reset(BY_ID["quiet-intersection"])
    assert observation.stop_sign_m == pytest.approx(85.0)
    setpoints = replace(world.driver().initial_setpoints(), turn="straight")
    setpoints = _drive(world, setpoints, 250)
    waiting = world.observe()
    assert abs(waiting.ego.speed_mps) < 1.0
    assert waiting.stop_sign_m is not None
    sign = world.perception().stop_sign_ahead(frozenset())
    assert sign is not None
    assert world.perception().stop_sign_ahead(frozenset({sign[0]})) is None
    assert world.perception().front_blocker(frozenset()) == sign[0]


def test_served_stop_lets_the_car_cross_straight() -> None:
    world = HighwayWorld()
    empty = {"type": "dt-intersection-v0", "num_vehicles_left": 0, "num_vehicles_right": 0}
    world.reset(Scenario("empty", "highway", empty, 1))
    sign = world.perception().stop_sign_ahead(frozenset())
    assert sign is not None
    driver = world.driver()
    setpoints = replace(driver.initial_setpoints(), turn="straight", served_stops=frozenset({sign[0]}))
    seen = set()
    for _ in range(200):
        setpoints = driver.settle(setpoints)
        world.step(driver.command(setpoints))
        seen.add(world.perception().lane_of(EGO))
        if world.ended:
            break
    assert "il2-o2:0" in seen


@pytest.mark.parametrize(
    ("config", "message"),
    [
        ({"type": "moon"}, "Unknown road type"),
        ({"type": "ramp-merge-v0", "vehicles_density": 0}, "vehicles_density"),
        ({"type": "ramp-merge-v0", "vehicels_count": 3}, "vehicels_count"),
        ({"type": "ramp-merge-v0", "stage_length": [1, 2]}, "stage_length"),
        ({"type": "dt-highway-v0", "vehicles_count": "many"}, "vehicles_count"),
        (
            {"type": "dt-highway-v0", "ego_vehicle": {"start_lane_index": ["x", "y", 0], "start_position": [0, 0]}},
            "start lane",
        ),
    ],
)
def test_bad_scenarios_say_what_is_wrong(config: dict[str, object], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        HighwayWorld().reset(Scenario("bad", "highway", config, 1))


@pytest.mark.parametrize("name", ["RampMerge", "MultiLane", "Intersection"])
@pytest.mark.filterwarnings("ignore")
def test_gymnasium_check(name: str) -> None:
    assert chauffeur.worlds.highway.gym
    env = gymnasium.make(f"chauffeur/{name}-v0")
    check_env(env.unwrapped, skip_render_check=True)
    observation, _ = env.reset(seed=3)
    again, _ = env.reset(seed=3)
    assert np.array_equal(observation, again)


@pytest.mark.parametrize("name", [scenario.id for scenario in BUILT_IN])
def test_no_seed_of_a_built_in_scenario_begins_with_cars_in_each_other(name: str) -> None:
    scenario = next(one for one in BUILT_IN if one.id == name)
    for seed in range(25):
        observation = HighwayWorld().reset(scenario, seed)
        assert fit_to_begin((observation.ego, *observation.others, *observation.objects)), seed
    assert HighwayWorld().reset(scenario, 7) == HighwayWorld().reset(scenario, 7)


def test_lampilots_draws_are_driven_as_they_are() -> None:
    scenario = next(one for one in BUILT_IN if one.id == "following")
    asis = replace(scenario, config={**scenario.config, "redraw_unfit": False})
    unfit = []
    for seed in range(25):
        observation = HighwayWorld().reset(asis, seed)
        if fit_to_begin((observation.ego, *observation.others, *observation.objects)):
            assert HighwayWorld().reset(scenario, seed).others == observation.others, "a fit draw is kept"
        else:
            unfit.append(seed)
    assert unfit, "nothing was drawn again: the test sees nothing"


def test_a_scenario_that_no_draw_fits_says_so() -> None:
    crowded = {"type": "dt-highway-v0", "num_lanes": 2, "vehicles_count": 60, "vehicles_density": 40.0}
    with pytest.raises(ScenarioError, match="without a collision"):
        HighwayWorld().reset(Scenario("crowd", "highway", {**crowded, "redraw_unfit": True}, 1))
