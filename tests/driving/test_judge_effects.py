"""What a recorded drive shows of the program that drove it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from chauffeur.driving.episode import Episode, run_episode
from chauffeur.driving.judge.effects import effect_of
from chauffeur.programs import ProgramExecutor, Sandbox
from chauffeur.safety.faithfulness import Effect, FactSurroundings, judge, read_facts
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.scenarios import BUILT_IN

# Its goal comes from a function of its own arithmetic that reading does not follow.
OPAQUE = """def drive():
    numbers = {"goal": 0.0}
    numbers["goal"] = 18.0
    while True:
        set_target_speed(numbers["goal"])
        yield autopilot()
"""
LEFT = """def drive():
    ego = get_ego_vehicle()
    while not is_safe_enter(get_left_lane(ego)):
        yield autopilot()
    set_target_lane(get_left_lane(ego))
    while True:
        yield autopilot()
"""
PASSING = """def drive():
    set_target_lane(get_left_lane(get_ego_vehicle()))
    set_target_speed(33.0)
    while True:
        yield autopilot()
"""
CROSS = """def drive():
    {}_at_next_intersection()
    while True:
        if get_speed_of(get_ego_vehicle()) < 1.0:
            recover_from_stop()
        yield autopilot()
"""
BROKEN = "def drive():\n    yield autopilot()\n    x = 1 / 0\n    yield autopilot()\n"


@pytest.fixture
def world() -> HighwayWorld:
    return scene("cruise")


def scene(name: str) -> HighwayWorld:
    """A built-in start situation."""
    world = HighwayWorld()
    scenario = next(one for one in BUILT_IN if one.id == name)
    world.reset(scenario, scenario.seed)
    return world


def drive(world: HighwayWorld, source: str, sandbox: Sandbox, max_s: float) -> Episode:
    """A drive by a program, as it is written."""
    with ProgramExecutor(sandbox=sandbox, gate=False) as executor:
        executor.start(source, world)
        return run_episode(world, executor, None, max_s=max_s)


def effect(world: HighwayWorld, source: str, sandbox: Sandbox, max_s: float) -> Effect:
    found = effect_of(drive(world, source, sandbox, max_s))
    assert found is not None
    return found


def test_a_slower_speed_is_seen(world: HighwayWorld, sandbox: Sandbox) -> None:
    before = world.observe()
    slower = effect(world, OPAQUE, sandbox, 15.0)
    assert slower.speeds_mps[0] == before.ego.speed_mps
    assert slower.speeds_mps[1] == pytest.approx(18.0, abs=1.5)
    assert (slower.lanes_moved, slower.stood, slower.failed) == (0, False, False)


def test_a_lane_change_is_seen(world: HighwayWorld, sandbox: Sandbox) -> None:
    moved = effect(world, LEFT, sandbox, 12.0)
    assert (moved.lanes_moved, moved.leftmost, moved.rightmost) == (-1, -1, 0)


def test_a_drive_that_reached_its_goal_was_cut_short(world: HighwayWorld, sandbox: Sandbox) -> None:
    episode = drive(world, LEFT, sandbox, 12.0)
    whole = effect_of(episode)
    assert not whole.cut
    assert effect_of(replace(episode, success=True)) == replace(whole, cut=True)


def test_a_vehicle_that_was_ahead_is_looked_for_again(sandbox: Sandbox) -> None:
    world = scene("overtake")
    ahead = world.observe().front
    assert ahead is not None
    passing = effect(world, PASSING, sandbox, 10.0)
    assert passing.gaps_m[0] == pytest.approx(ahead.distance_m, abs=0.5)
    assert passing.gaps_m[1] is not None and passing.gaps_m[1] < 0.0, "it is behind"
    assert passing.extremes_mps[1] > passing.speeds_mps[0] + 3.0


@pytest.mark.parametrize(("way", "turned"), [("left", -1), ("right", 1), ("straight", 0)])
def test_turns_are_told_by_the_heading(way: str, turned: int, sandbox: Sandbox) -> None:
    choice = "go_straight" if way == "straight" else f"turn_{way}"
    assert effect(scene("intersection"), CROSS.format(choice), sandbox, 25.0).turned == turned


def test_a_program_that_fails_says_so(world: HighwayWorld, sandbox: Sandbox) -> None:
    assert effect(world, BROKEN, sandbox, 2.0).failed


def test_driving_tells_what_reading_cannot(world: HighwayWorld, sandbox: Sandbox) -> None:
    where = FactSurroundings.of(world.observe())
    driven = effect(world, OPAQUE, sandbox, 15.0)

    def aligned(text: str) -> bool:
        return judge(text, read_facts(OPAQUE, ""), where, (driven,)).aligned

    assert aligned("I slow down.")
    assert not aligned("I speed up.")
