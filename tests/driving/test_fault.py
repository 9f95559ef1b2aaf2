"""Who caused a collision, on scenes in which the contact is arranged."""

from __future__ import annotations

import math
from typing import Any

import pytest

from chauffeur.concept import Command
from chauffeur.driving.judge.signals import SignalLog, at_fault
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway import HighwayWorld, Instant
from chauffeur.worlds.highway.core import layout as at
from chauffeur.worlds.highway.scenarios import BUILT_IN

BY_ID = {s.id: s for s in BUILT_IN}


class _Arranged:
    """A world in which the ego and one other car are put where a test wants them."""

    def __init__(self) -> None:
        self.world = HighwayWorld()
        self.world.reset(BY_ID["emergency-lane"])
        self.core = self.world._road()
        self.core.floats[2:, at.X] -= 5000.0  # everybody else is far away

    def put(self, row: int, x: float, lane: int, speed: float, heading: float = 0.0, y: float | None = None) -> None:
        floats = self.core.floats[row]
        floats[at.X], floats[at.Y] = x, 4.0 * lane if y is None else y
        floats[at.SPEED], floats[at.HEADING] = speed, heading
        self.core.ints[row, at.LANE] = self.core.ints[row, at.TARGET_LANE] = lane

    def let_go(self, row: int) -> None:
        """Nobody is at the wheel of a car any more: it goes straight on."""
        self.core.ints[row, at.KIND] = at.EGO_KIND
        self.core.floats[row, [at.ACCELERATION, at.STEERING]] = 0.0

    def drive(self, steps: int, command: Command) -> tuple[list[Instant], SignalLog]:
        self.core.report()
        log = SignalLog(self.world.perception())
        seen: list[Instant] = []
        for _ in range(steps):
            self.world.step(command)
            seen.append(self.world.perception().instant())
            log.observe(seen[-1])
            if seen[-1].crashed:
                break
        return seen, log


@pytest.mark.parametrize(
    ("ego", "other", "driven", "steps", "fault"),
    [
        pytest.param((500.0, 1, 25.0), (530.0, 1, 5.0), True, 100, "ego", id="runs into the lead vehicle"),
        pytest.param((500.0, 1, 0.0), (420.0, 1, 30.0), False, 100, "struck", id="stands and is run into"),
        pytest.param((500.0, 1, 15.0), (450.0, 1, 30.0), False, 150, "struck", id="keeps its lane and is run into"),
        pytest.param((500.0, 1, 20.0, 0.12), (494.0, 2, 24.0), False, 40, "ego", id="cuts in and is hit from behind"),
        pytest.param((500.0, 1, 20.0), (502.0, 2, 21.0, -0.12), False, 40, "struck", id="the other comes over"),
    ],
)
def test_who_caused_a_collision(
    ego: tuple[Any, ...], other: tuple[Any, ...], driven: bool, steps: int, fault: str
) -> None:
    scene = _Arranged()
    scene.put(EGO, *ego)
    scene.put(1, *other)
    if not driven:
        scene.let_go(1)
    _, log = scene.drive(steps, Command(0.0, 0.0))
    found = log.signals()
    assert found.crashed and found.fault == fault
    if driven:
        assert found.ttc_lane_s == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize(
    ("ego", "fault", "past_end"),
    [((500.0, 3, 20.0, math.radians(30)), "ego", False), ((1998.0, 1, 30.0), "road_end", True)],
)
def test_leaving_the_road_sideways_is_the_egos_fault_and_its_end_is_not(
    ego: tuple[Any, ...], fault: str, past_end: bool
) -> None:
    scene = _Arranged()
    scene.put(EGO, *ego)
    scene.core.floats[1, at.X] -= 5000.0
    _, log = scene.drive(10, Command(0.0, 0.0))
    found = log.signals()
    assert (found.off_road, found.past_end, found.fault) == (True, past_end, fault)


def test_nothing_near_is_blamed_on_the_ego() -> None:
    world = HighwayWorld()
    world.reset(BY_ID["cruise"])
    road = world.perception()
    assert at_fault(road, road.instant(), []) == "ego"
