"""What running a program on copies of a scene shows, and that the scene itself stays as it is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from chauffeur.concept import Program, Thoughts
from chauffeur.drive.effects import effect_of, effects_of, judge_driven
from chauffeur.drive.episode import run_episode
from chauffeur.programs import UNHURRIED, ProgramExecutor, Sandbox
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


@pytest.fixture(scope="module")
def sandbox() -> Iterator[Sandbox]:
    with Sandbox(UNHURRIED) as sandbox:
        yield sandbox


@pytest.fixture
def world() -> HighwayWorld:
    return scene("cruise")


def scene(name: str) -> HighwayWorld:
    """A built-in start situation."""
    world = HighwayWorld()
    scenario = next(one for one in BUILT_IN if one.id == name)
    world.reset(scenario, scenario.seed)
    return world


def test_a_slower_speed_is_driven_and_the_scene_stays(world: HighwayWorld, sandbox: Sandbox) -> None:
    before = world.observe()
    effect, other = effects_of([world, world], Program(OPAQUE), sandbox=sandbox, max_s=15.0)
    assert effect == other  # same instant, same program
    assert effect.speeds_mps[0] == before.ego.speed_mps
    assert effect.speeds_mps[1] == pytest.approx(18.0, abs=1.5)
    assert (effect.lanes_moved, effect.stood, effect.failed) == (0, False, False)
    assert world.observe() == before


def test_a_lane_change_is_seen(world: HighwayWorld, sandbox: Sandbox) -> None:
    (effect,) = effects_of([world], Program(LEFT), sandbox=sandbox, max_s=12.0)
    assert (effect.lanes_moved, effect.leftmost, effect.rightmost) == (-1, -1, 0)


def test_a_recorded_drive_tells_the_same_as_a_copy_of_it(world: HighwayWorld, sandbox: Sandbox) -> None:
    (tried,) = effects_of([world], Program(LEFT), sandbox=sandbox, max_s=12.0)
    with ProgramExecutor(sandbox=sandbox) as executor:
        executor.start(LEFT, world)
        episode = run_episode(world, executor, None, max_s=12.0)
    assert effect_of(episode) == tried
    assert effect_of(replace(episode, success=True)) == replace(tried, cut=True)


def test_a_vehicle_that_was_ahead_is_looked_for_again(sandbox: Sandbox) -> None:
    world = scene("overtake")
    ahead = world.observe().front
    assert ahead is not None
    (passing,) = effects_of([world], Program(PASSING), sandbox=sandbox, max_s=10.0)
    assert passing.gaps_m[0] == pytest.approx(ahead.distance_m, abs=0.5)
    assert passing.gaps_m[1] is not None and passing.gaps_m[1] < 0.0, "it is behind"
    assert passing.extremes_mps[1] > passing.speeds_mps[0] + 3.0


@pytest.mark.parametrize(("way", "turned"), [("left", -1), ("right", 1), ("straight", 0)])
def test_turns_are_told_by_the_heading(way: str, turned: int, sandbox: Sandbox) -> None:
    choice = "go_straight" if way == "straight" else f"turn_{way}"
    (effect,) = effects_of([scene("intersection")], Program(CROSS.format(choice)), sandbox=sandbox, max_s=25.0)
    assert effect.turned == turned


def test_a_program_that_fails_says_so(world: HighwayWorld, sandbox: Sandbox) -> None:
    (effect,) = effects_of([world], Program(BROKEN), sandbox=sandbox, max_s=2.0)
    assert effect.failed


def test_driving_tells_what_reading_cannot(world: HighwayWorld, sandbox: Sandbox) -> None:
    def aligned(text: str) -> bool:
        return judge_driven(Thoughts(text), Program(OPAQUE), [world], sandbox=sandbox, max_s=15.0).aligned

    assert aligned("I slow down.")
    assert not aligned("I speed up.")


def test_without_a_scene_nothing_can_be_driven(sandbox: Sandbox) -> None:
    with pytest.raises(ValueError, match="no scene"):
        judge_driven(Thoughts("I slow down."), Program(OPAQUE), [], sandbox=sandbox)
