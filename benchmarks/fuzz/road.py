"""A road to drive fuzzed programs on: the built-in scenes of the highway world."""

from __future__ import annotations

from functools import cache

from chauffeur.programs import TickResult
from chauffeur.worlds.highway.scenarios import BUILT_IN
from chauffeur.worlds.highway.world import HighwayWorld

SCENES = ("following", "left-lane", "intersection")


@cache
def _start(name: str) -> HighwayWorld:
    world = HighwayWorld()
    world.reset(next(scenario for scenario in BUILT_IN if scenario.id == name))
    return world


def world_for(number: int) -> HighwayWorld:
    """A fresh copy of one of the scenes."""
    return _start(SCENES[number % len(SCENES)]).copy()


def drive_on(world: HighwayWorld, result: TickResult) -> None:
    """One control period with a program's wishes, as a drive makes it."""
    driver = world.driver()
    world.step(driver.command(driver.settle(result.setpoints)))
