"""Our quicker physics against the plain highway-env package, bit for bit."""

from __future__ import annotations

from typing import Any

import pytest

from chauffeur.concept import Command, Scenario
from chauffeur.worlds.highway.scenarios import BUILT_IN
from highway_oracle import ReferenceWorld
from highway_oracle.plain import plain_highway_env
from highway_oracle.traffic import FastRegulatedRoad


def _trace(scenario: Scenario, steps: int) -> list[Any]:
    world = ReferenceWorld()
    world.reset(scenario)
    driver = world.driver()
    wishes = driver.initial_setpoints()
    rows = []
    for _ in range(steps):
        wishes = driver.settle(wishes)
        world.step(driver.command(wishes))
        rows.append([(v.position[0], v.position[1], v.heading, v.speed, v.crashed) for v in world.scene.road.vehicles])
    return rows


@pytest.mark.parametrize(
    "scenario", [s for s in BUILT_IN if s.id in ("following", "emergency-lane", "intersection")], ids=lambda s: s.id
)
def test_same_as_plain_highway_env(scenario: Scenario) -> None:
    quick = _trace(scenario, 80)
    with plain_highway_env(record_history=True):
        assert _trace(scenario, 80) == quick


def test_the_quicker_classes_come_back() -> None:
    scenario = next(s for s in BUILT_IN if s.id == "intersection")
    world = ReferenceWorld()
    with pytest.raises(RuntimeError), plain_highway_env():
        world.reset(scenario)
        assert not isinstance(world.scene.road, FastRegulatedRoad)
        raise RuntimeError
    world.reset(scenario)
    assert isinstance(world.scene.road, FastRegulatedRoad)


def test_crash_is_felt_and_ends_the_trip() -> None:
    scenario = next(s for s in BUILT_IN if s.id == "following")
    world = ReferenceWorld()
    world.reset(scenario)
    for _ in range(300):
        world.step(Command(5.0, 0.0))
        if world.ended:
            break
    final = world.observe()
    assert final.ego.crashed
    assert any(other.crashed for other in final.others)
    assert final.ended
