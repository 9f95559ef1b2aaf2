"""Who caused a collision, on scenes in which the contact is arranged."""

from __future__ import annotations

import math

import pytest

from chauffeur.bench.lampilot.signals import SignalLog, at_fault
from chauffeur.concept import Command
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


def test_running_into_the_lead_is_the_egos_fault() -> None:
    scene = _Arranged()
    scene.put(EGO, 500.0, 1, 25.0)
    scene.put(1, 530.0, 1, 5.0)
    _, log = scene.drive(100, Command(0.0, 0.0))
    assert log.signals().crashed
    assert log.signals().fault == "ego"
    assert log.signals().ttc_lane_s == pytest.approx(0.0, abs=0.1)


def test_standing_and_run_into_is_struck() -> None:
    scene = _Arranged()
    scene.put(EGO, 500.0, 1, 0.0)
    scene.put(1, 420.0, 1, 30.0)
    scene.let_go(1)
    seen, log = scene.drive(100, Command(0.0, 0.0))
    assert seen[-1].crashed
    assert log.signals().fault == "struck"


def test_run_into_from_behind_while_keeping_the_lane_is_struck() -> None:
    scene = _Arranged()
    scene.put(EGO, 500.0, 1, 15.0)
    scene.put(1, 450.0, 1, 30.0)
    scene.let_go(1)
    _, log = scene.drive(150, Command(0.0, 0.0))
    assert log.signals().crashed
    assert log.signals().fault == "struck"


def test_cutting_in_is_the_egos_fault_even_if_hit_from_behind() -> None:
    scene = _Arranged()
    scene.put(EGO, 500.0, 1, 20.0, heading=0.12)
    scene.put(1, 494.0, 2, 24.0)
    scene.let_go(1)
    _, log = scene.drive(40, Command(0.0, 0.0))
    assert log.signals().crashed
    assert log.signals().fault == "ego"


def test_a_car_that_comes_over_strikes() -> None:
    scene = _Arranged()
    scene.put(EGO, 500.0, 1, 20.0)
    scene.put(1, 502.0, 2, 21.0, heading=-0.12)
    scene.let_go(1)
    _, log = scene.drive(40, Command(0.0, 0.0))
    assert log.signals().crashed
    assert log.signals().fault == "struck"


def test_leaving_the_road_sideways_is_the_egos_fault_and_the_end_of_the_road_nobodys() -> None:
    scene = _Arranged()
    scene.put(EGO, 500.0, 3, 20.0, heading=math.radians(30))
    scene.core.floats[1, at.X] -= 5000.0
    _, log = scene.drive(10, Command(0.0, 0.0))
    assert log.signals().off_road
    assert log.signals().fault == "ego"
    scene = _Arranged()
    scene.put(EGO, 1998.0, 1, 30.0)
    scene.core.floats[1, at.X] -= 5000.0
    _, log = scene.drive(10, Command(0.0, 0.0))
    assert log.signals().past_end
    assert log.signals().fault == "road_end"


def test_nothing_near_is_blamed_on_the_ego() -> None:
    world = HighwayWorld()
    world.reset(BY_ID["cruise"])
    road = world.perception()
    assert at_fault(road, road.instant(), []) == "ego"
