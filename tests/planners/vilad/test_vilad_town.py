"""ViLaD in a town: the street ahead is read from the town's road graph, and its trajectory ends where it was to end."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import replace

import pytest

pytest.importorskip("libsumo", reason="needs the extra `town`")
pytest.importorskip("osqp", reason="needs the extra `motion`")

from chauffeur.concept import Instruction, Limits, PlanRequest, Scenario, SystemMessage, Trajectory
from chauffeur.describe.dispatch import describe
from chauffeur.driving.actuate import actuate
from chauffeur.driving.episode import drive_policy
from chauffeur.driving.judge.choice import referee_for
from chauffeur.driving.planning import checked
from chauffeur.executors.trajectory import TrajectoryExecutor
from chauffeur.geometry import Pose
from chauffeur.planners.vilad import ViladPlanner
from chauffeur.worlds.town import TownWorld
from chauffeur.worlds.town.library import load


@pytest.fixture
def world() -> Iterator[TownWorld]:
    town = TownWorld()
    yield town
    town.close()


def _before_a_junction(back_m: float) -> Scenario:
    """On a lane of its own, with ways to more than one side behind it, and nobody else on the road."""
    road = load("Oldbridge").road
    lane = next(
        one
        for one in road.lanes
        if one.kind == "driving"
        and not one.junction
        and one.length_m > back_m + 20.0
        and len({road[name].turn for name in one.successors}) > 1
    )
    config = {"town": "Oldbridge", "start": [lane.id, lane.length_m - back_m], "vehicles": 0, "people": 0}
    return Scenario("before-a-junction", "town", config | {"duration_s": 160.0}, 3)


@pytest.mark.parametrize("wish", ["Stop after 20 metres.", "Stop before the junction."])
def test_a_command_is_driven_to_its_end(world: TownWorld, wish: str) -> None:
    scene = _before_a_junction(35.0)
    observation = world.reset(scene)
    context = describe(observation)
    street = context.street
    assert street is not None and len(street.ways) > 1
    assert all(way.bend_m is not None and way.bend_m[0] == pytest.approx(35.0, abs=3.0) for way in street.ways)
    plan = asyncio.run(ViladPlanner().plan(PlanRequest(Instruction(wish), context, SystemMessage(""))))
    assert isinstance(plan.policy, Trajectory), plan.refusal
    assert not checked(plan, observation, Limits()).refusal
    before = observation.ego
    episode = drive_policy(world, plan.policy, referee_for(world, scene, plan), 100.0, Limits())
    assert episode.success, episode.outcome
    ego = episode.final.ego
    driven_m = ((ego.x_m - before.x_m) ** 2 + (ego.y_m - before.y_m) ** 2) ** 0.5
    assert ego.speed_mps < 0.2
    assert (15.0 if "20" in wish else 20.0) < driven_m < (25.0 if "20" in wish else 35.0)


def test_a_place_further_on_is_declined(world: TownWorld) -> None:
    context = describe(world.reset(_before_a_junction(35.0)))
    wish = Instruction("Take me to the station.")
    plan = asyncio.run(ViladPlanner().plan(PlanRequest(wish, context, SystemMessage(""))))
    assert plan.policy is None
    assert "the way there" in plan.refusal


def test_a_car_that_was_led_off_its_trajectory_stops_in_its_lane(world: TownWorld) -> None:
    observation = world.reset(_before_a_junction(35.0))
    ego = observation.ego
    beside = Pose(ego.x_m, ego.y_m, ego.heading_rad).place(0.0, 6.0)
    executor = TrajectoryExecutor(world)
    ahead = Trajectory(tuple((3.0 * k, 0.0) for k in range(1, 10)), 1.0)
    executor.start(ahead, observation, Limits(), replace(ego, x_m=beside[0], y_m=beside[1]))
    for _ in range(300):
        actuate(world, observation, executor.step(observation), None, None)
        observation = world.observe()
        if executor.status == "finished":
            break
    assert executor.status == "finished"
    assert observation.ego.lane == ego.lane
    assert ego.lane is not None
    lane = observation.road[ego.lane]
    assert abs(lane.centre.project(observation.ego.x_m, observation.ego.y_m)[1]) < 0.6


def test_inside_a_junction_there_is_no_street_to_plan_on(world: TownWorld) -> None:
    road = load("Oldbridge").road
    lane = next(one for one in road.lanes if one.junction and one.kind == "driving" and one.length_m > 8.0)
    config = {"town": "Oldbridge", "start": [lane.id, 4.0], "vehicles": 0, "people": 0}
    observation = world.reset(Scenario("inside", "town", config, 1))
    here = road.get(observation.ego.lane)
    assert (describe(observation).street is None) == bool(here and here.junction)
