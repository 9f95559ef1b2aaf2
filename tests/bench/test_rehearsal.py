"""Rehearsal: which candidate is chosen, what is broken off, and that nothing but the copies moves."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import pytest

from chauffeur.bench.lampilot.rehearsal import RehearsedChoice, label, rehearse
from chauffeur.concept import Metric, Outcome
from chauffeur.programs import UNHURRIED, Sandbox
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.scenarios import BUILT_IN

FREE_ROAD = next(scenario for scenario in BUILT_IN if scenario.id == "cruise")
LIMIT_TICKS = 30


def at_speed(speed: float) -> str:
    return f"def drive():\n    set_target_speed({speed})\n    while True:\n        yield autopilot()\n"


BROKEN = "def drive():\n    yield autopilot()\n    x = 1 / 0\n    yield autopilot()\n"
NO_PROGRAM = "def drive():\n    open('/etc/passwd')\n    yield autopilot()\n"


class NearTo:
    """Worth the more the nearer the ego's mean speed is to one; a trip takes three seconds."""

    def __init__(self, world: HighwayWorld, speed: float, *, patient: bool, collides_above: float = math.inf) -> None:
        self._perception = world.perception()
        self._speed = speed
        self._patient = patient
        self._above = collides_above
        self._steps = 0
        self._off = 0.0

    def observe(self) -> None:
        self._steps += 1
        self._off += abs(self._perception.vehicle(EGO).speed_mps - self._speed)

    @property
    def over(self) -> bool:
        return self._steps >= LIMIT_TICKS

    @property
    def success(self) -> bool:
        return self.over

    @property
    def collided(self) -> bool:
        return self._perception.vehicle(EGO).speed_mps > self._above

    @property
    def worth(self) -> float:
        return -self._off

    @property
    def ceiling(self) -> float:
        return math.inf if self._patient else -self._off

    def outcome(self) -> Outcome:
        return "success"

    def metrics(self) -> tuple[Metric, ...]:
        return ()


@pytest.fixture
def world() -> HighwayWorld:
    one = HighwayWorld()
    one.reset(FREE_ROAD)
    return one


Try = Callable[..., RehearsedChoice]


@pytest.fixture(scope="module")
def sandbox() -> Iterator[Sandbox]:
    with Sandbox(UNHURRIED) as one:
        yield one


@pytest.fixture
def attempt(world: HighwayWorld, sandbox: Sandbox) -> Try:
    def run(*sources: str, speed: float = 20.0, patient: bool = False, above: float = math.inf) -> RehearsedChoice:
        def judge(copy: HighwayWorld) -> NearTo:
            return NearTo(copy, speed, patient=patient, collides_above=above)

        return rehearse(world, sources, judge, sandbox=sandbox, max_s=10.0)

    return run


SPEEDS = tuple(at_speed(v) for v in (30.0, 24.0, 20.5, 12.0, 19.0))


def test_the_best_is_chosen_and_what_cannot_win_is_broken_off(attempt: Try) -> None:
    patient = attempt(*SPEEDS, patient=True)
    hasty = attempt(*SPEEDS)
    assert (hasty.index, hasty.source) == (patient.index, patient.source)
    assert [r.ticks for r in patient.rollouts.values()] == [LIMIT_TICKS] * 5
    cut = [index for index, rollout in hasty.rollouts.items() if rollout.cut]
    assert cut
    assert all(hasty.rollouts[i].ticks < LIMIT_TICKS and hasty.rollouts[i].outcome == "ended" for i in cut)
    assert hasty.index not in cut


def test_the_world_itself_does_not_move(attempt: Try, world: HighwayWorld) -> None:
    before = world.observe()
    attempt(*SPEEDS)
    assert world.observe() == before


def test_of_equals_the_first_is_taken(attempt: Try) -> None:
    assert attempt(at_speed(25.0), at_speed(25.0), at_speed(25.0)).index == 0


def test_one_that_collides_is_chosen_only_when_all_do(attempt: Try, world: HighwayWorld) -> None:
    start = world.observe().ego.speed_mps
    assert attempt(at_speed(start), at_speed(10.0), speed=start, above=start - 2.0).index == 1
    every = attempt(at_speed(start), at_speed(10.0), speed=start, above=0.0)
    assert every.index == 0
    assert all(rollout.collided for rollout in every.rollouts.values())


def test_a_program_that_fails_is_chosen_only_when_all_do(attempt: Try) -> None:
    choice = attempt(BROKEN, NO_PROGRAM, at_speed(3.0))
    assert choice.index == 2
    assert [choice.rollouts[i].failed for i in range(3)] == [True, True, False]
    assert attempt(BROKEN, NO_PROGRAM).index == 0


class Shared:
    """A board on which another has told its best before."""

    def __init__(self, best: float) -> None:
        self.best = best

    def tell(self, worth: float) -> None:
        self.best = max(self.best, worth)


def test_nothing_to_rehearse_is_said(attempt: Try) -> None:
    with pytest.raises(ValueError, match="nothing to rehearse"):
        attempt()


def test_the_label_says_what_it_is() -> None:
    assert label(32) == "rehearsal K=32: foresees the simulator's traffic"
