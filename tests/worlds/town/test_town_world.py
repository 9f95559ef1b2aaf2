"""The town on SUMO: the same trip from the same seed, contacts, lights, what a scenario puts on the road."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from chauffeur.concept import Command, Observation, Scenario, ScenarioError
from chauffeur.geometry import Lane, LanePlace, Pose, plan_route
from chauffeur.worlds.base import Stage

pytest.importorskip("libsumo")
pytest.importorskip("sumo")

from chauffeur.worlds.town import TownReferee, TownWorld
from chauffeur.worlds.town.build import build, sources_of
from chauffeur.worlds.town.pack import MapPack, Place
from chauffeur.worlds.town.scene import STANDS_S


@pytest.fixture(scope="module")
def town(carla_data: Path, tmp_path_factory: pytest.TempPathFactory) -> MapPack:
    pack = build(sources_of(carla_data / "maps" / "Town02.xodr"), folder=tmp_path_factory.mktemp("maps") / "Town02")
    lane = long_lane(pack, 2)
    return replace(pack, places=(Place("Central Station", "station", 0.0, 0.0, lane.id, 0.6 * lane.length_m),))


@pytest.fixture
def world(town: MapPack) -> Iterator[TownWorld]:
    world = TownWorld(town)
    yield world
    world.close()


def long_lane(pack: MapPack, number: int = 0) -> Lane:
    return [one for one in pack.road.lanes if one.kind == "driving" and not one.junction and one.length_m > 80.0][
        number
    ]


def scenario(**config: object) -> Scenario:
    return Scenario("t", "town", {"town": "Town02", "vehicles": 25, "people": 0, **config}, 3)


def driven(world: TownWorld, periods: int) -> list[Observation]:
    driver, seen = world.driver(), []
    for _ in range(periods):
        world.step(driver.command(driver.settle(driver.initial_setpoints())))
        seen.append(world.observe())
    return seen


def test_it_has_a_stage(world: TownWorld) -> None:
    world.reset(scenario(vehicles=0))
    assert isinstance(world, Stage)
    assert world.engine.startswith("sumo-2d")


def test_the_same_seed_gives_the_same_trip_and_another_one_another(world: TownWorld) -> None:
    trips: list[str] = []
    for seed in (7, 7, 8):
        world.reset(scenario(), seed)
        trips.append(repr([(one.ego, one.others, one.signals) for one in driven(world, 300)]))
    assert trips[0] == trips[1]
    assert trips[0] != trips[2]


def test_a_second_town_takes_the_engine_and_the_first_says_so(world: TownWorld, town: MapPack) -> None:
    world.reset(scenario(vehicles=0))
    other = TownWorld(town)
    other.reset(scenario(vehicles=0))
    with pytest.raises(ScenarioError, match="one at a time"):
        world.step(Command(0.0, 0.0))
    other.step(Command(0.0, 0.0))
    world.reset(scenario(vehicles=0))
    world.step(Command(0.0, 0.0))


def test_driving_into_something_is_a_contact_that_ends_the_trip(world: TownWorld, town: MapPack) -> None:
    lane = long_lane(town)
    world.reset(scenario(start=(lane.id, 10.0), vehicles=0, ego_speed=8.0))
    world.spawn("static", lane.centre.at(30.0))
    for _ in range(80):
        world.step(Command(2.0, 0.0))
        if world.ended:
            break
    assert world.observe().ego.crashed
    assert [one.kind for one in world.observe().others if one.crashed] == ["static"]


def test_the_driver_stops_behind_what_a_scenario_puts_on_the_road(world: TownWorld, town: MapPack) -> None:
    lane = long_lane(town)
    world.reset(scenario(start=(lane.id, 10.0), vehicles=0, ego_speed=8.0))
    actor = world.spawn("car", lane.centre.at(60.0))
    seen = driven(world, 240)
    ego = seen[-1].ego
    assert not any(one.ego.crashed for one in seen)
    assert ego.speed_mps < 0.1
    gap = 50.0 - lane.centre.nearest(ego.x_m, ego.y_m) + 10.0 - (4.6 + ego.length_m) / 2.0
    assert 1.0 < gap < 5.0
    world.remove(actor)
    world.remove(actor)
    assert driven(world, 60)[-1].ego.speed_mps > 2.0


def test_a_red_light_is_stopped_at_and_a_forced_green_one_driven(world: TownWorld, town: MapPack) -> None:
    head = town.signals[0].heads[0]
    lane = town.road[head.lanes[0]]
    world.reset(scenario(start=(lane.id, max(2.0, lane.length_m - 40.0)), vehicles=0, ego_speed=6.0))
    world.force_signal(head.id, "red")
    stopped = driven(world, 300)[-1]
    assert stopped.ego.speed_mps < 0.1
    assert stopped.ego.lane == lane.id
    assert {one.id: one.state for one in stopped.signals}[head.id] == "red"
    world.force_signal(head.id, "green")
    assert driven(world, 160)[-1].ego.lane != lane.id
    with pytest.raises(KeyError):
        world.force_signal("nowhere", "red")


def test_a_car_astride_a_stop_line_waits_with_its_tail_before_it(world: TownWorld, town: MapPack) -> None:
    head = town.signals[0].heads[0]
    lane = town.road[head.lanes[0]]
    (ax, ay), (bx, by) = head.stop_line_m
    line_m = lane.centre.nearest((ax + bx) / 2.0, (ay + by) / 2.0)
    world.reset(scenario(start=(lane.id, line_m), vehicles=0))
    world.force_signal(head.id, "red")
    ego = driven(world, 100)[-1].ego
    assert ego.speed_mps < 0.1
    assert lane.centre.nearest(ego.x_m, ego.y_m) - 0.4 * ego.length_m < line_m
    world.force_signal(head.id, "green")
    assert driven(world, 100)[-1].ego.lane != lane.id


def test_it_drives_to_a_place_by_its_name(world: TownWorld) -> None:
    world.reset(scenario(vehicles=10))
    world.head_for("the station")
    for _ in range(6000):
        driven(world, 1)
        if world.ended:
            break
        if world.arrived:
            break
    assert world.arrived
    assert world.observe().ego.speed_mps < 0.1, "nobody can get out of a car that rolls"
    with pytest.raises(ScenarioError, match="Central Station"):
        world.head_for("the moon")


@pytest.mark.parametrize("scenario_goal", [True, False], ids=["of the scenario", "wished for"])
def test_a_trip_to_a_place_ends_at_a_stand_that_lasts(world: TownWorld, scenario_goal: bool) -> None:
    """Whatever brings the car there: one that rolls past the place has not arrived."""
    goal = {"goal": "station"} if scenario_goal else {}
    world.reset(scenario(vehicles=0, **goal), 3)
    if not scenario_goal:
        world.head_for("the station")
    referee = TownReferee(world)
    stood = 0
    for _ in range(8000):
        if referee.over or world.ended:
            break
        driven(world, 1)
        referee.observe()
        stood = stood + 1 if world.observe().ego.speed_mps < 0.1 else 0
    assert referee.success
    assert world.ended == scenario_goal
    assert stood * world.dt_s >= STANDS_S


def test_traffic_yields_to_the_ego_whose_way_it_knows(world: TownWorld, town: MapPack) -> None:
    world.reset(scenario(vehicles=40))
    seen = driven(world, 1200)
    assert not any(one.ego.crashed for one in seen)
    assert world.mean_traffic_mps > 0.5


@pytest.mark.parametrize(
    "config",
    [{"town": "Town02", "vehicles": -1}, {"lanes": ["x"]}, {"goal": "nowhere"}, {"start": ["x", 1.0]}, {"nonsense": 1}],
)
def test_what_cannot_be_set_up_is_said(world: TownWorld, config: dict[str, object]) -> None:
    with pytest.raises(ScenarioError):
        world.reset(scenario(**config))


def test_somebody_on_the_road_is_seen_where_they_are(world: TownWorld, town: MapPack) -> None:
    lane = long_lane(town)
    world.reset(scenario(start=(lane.id, 10.0), vehicles=0))
    actor = world.spawn("pedestrian", lane.centre.at(40.0))
    place = Pose(*lane.centre.at(42.0).place(0.0, 1.0), 0.5)
    world.drive(actor, place, 1.2)
    world.step(Command(0.0, 0.0))
    one = next(one for one in world.observe().others if one.id == actor)
    assert (one.kind, one.x_m, one.y_m, one.speed_mps) == ("pedestrian", place.x_m, place.y_m, 1.2)
    with pytest.raises(ScenarioError, match="kind"):
        world.spawn("stop_sign", place)


def test_a_lane_that_the_way_passes_later_is_not_the_egos(world: TownWorld) -> None:
    """Two ways part where the ego is; its line takes one of them now and the other one on a later lap."""
    fork = next(
        lane for lane in world_roads(world) if len(lane.successors) > 1 and lane.length_m > 25.0 and not lane.junction
    )
    road = world.town.road
    later, first = fork.successors[0], fork.successors[1]
    lap = plan_route(road, LanePlace(first, 1.0, 0.0), LanePlace(fork.id, 10.0, 0.0))
    assert lap is not None
    lanes = (fork.id, *lap.lanes, later)
    world.reset(scenario(vehicles=0, lanes=lanes, start_m=fork.length_m - 20.0, goal_m=5.0))
    way = [one.id for one in world.driver().stretch.lanes]
    assert first in way
    assert later in way
    passed = [one.ego.lane for one in driven(world, 240)]
    assert first in passed
    assert later not in passed


def world_roads(world: TownWorld) -> tuple[Lane, ...]:
    world.reset(scenario(vehicles=0))
    return world.town.road.lanes
