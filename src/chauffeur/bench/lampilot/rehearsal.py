"""Rehearsal: several programs are tried on copies of the scene, and the best of them is the one to drive.

It needs a world that can be copied at an instant, and so a simulated one: a rehearsal foresees what the traffic is
going to do. Whatever comes of it says so (`label`). Programs run in the sandbox here as well as at the wheel.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol, Self, TypeVar

from chauffeur.concept import STOP_ZONE_M, Metric, Outcome, SandboxError
from chauffeur.driving.episode import Referee, run_episode
from chauffeur.programs import ProgramExecutor, Sandbox
from chauffeur.worlds.base import World


def label(count: int) -> str:
    """What must be said wherever a result of rehearsed driving is shown."""
    return f"rehearsal K={count}: foresees the simulator's traffic"


class CopyableWorld(World, Protocol):
    """A world whose present instant can be copied."""

    def copy(self) -> Self:
        """The same instant in a world of its own; stepping one leaves the other alone."""
        ...


SomeWorld = TypeVar("SomeWorld", bound=CopyableWorld)


class RehearsalJudge(Referee, Protocol):
    """A referee that can say what a trip is worth, and how much it may still become."""

    @property
    def collided(self) -> bool:
        """Whether there has been a collision."""
        ...

    @property
    def worth(self) -> float:
        """What the trip is worth as it is now, more is better."""
        ...

    @property
    def ceiling(self) -> float:
        """What it can be worth at the end, at most; never rises."""
        ...


@dataclass(frozen=True, slots=True)
class Rollout:
    """One candidate's try.

    Attributes:
        worth: What its trip was worth; -inf for a program that failed.
        collided: Whether it collided.
        outcome: What happened; `ended` for one that was broken off.
        ticks: Control periods simulated.
        cut: Whether it was broken off because another one was better whatever would have followed.
    """

    worth: float
    collided: bool
    outcome: Outcome
    ticks: int
    cut: bool

    @property
    def failed(self) -> bool:
        """Whether the program failed."""
        return self.worth == -math.inf


@dataclass(frozen=True, slots=True)
class RehearsedChoice:
    """The best candidate.

    Attributes:
        index: Its place among the candidates.
        source: Its text.
        rollouts: How the candidates did, by their places.
    """

    index: int
    source: str
    rollouts: Mapping[int, Rollout]


def rehearse(
    world: SomeWorld,
    candidates: Sequence[str],
    judge: Callable[[SomeWorld], RehearsalJudge],
    *,
    sandbox: Sandbox,
    max_s: float,
    library: str = "",
    stop_zone_m: float = STOP_ZONE_M,
) -> RehearsedChoice:
    """Try candidates on copies of the world and choose the one whose trip was worth most.

    One that collides is only chosen when all collide, one whose program fails only when all fail; of equals the first
    is taken. A try is broken off as soon as it cannot become the best any more, which changes no choice: it depends on
    the world, the candidates and the judge alone.

    The sandbox alone holds the programs that are tried here; the gate is the business of whoever drives the best one.

    Args:
        world: Where the trip is to begin; it stays as it is.
        candidates: Program texts, likely ones first: the sooner a good one is known, the less is simulated.
        judge: Makes the judge of a trip on a copy.
        sandbox: Where the programs run.
        max_s: Bound of each try in simulated time.
        library: Helper functions the programs may call.
        stop_zone_m: Within how much of a stop sign a stop serves it.

    Raises:
        ValueError: There are no candidates.
        SandboxError: No worker can be had.
    """
    rollouts: dict[int, Rollout] = {}
    for place, source in enumerate(candidates):
        best = best_of(rollouts)
        rank = _NOTHING if best is None else _rank(rollouts[best], best)
        rollouts[place] = _attempt(world, place, source, judge, rank, sandbox, max_s, library, stop_zone_m)
    best = best_of(rollouts)
    if best is None:
        raise ValueError("There is nothing to rehearse: no candidates.")
    return RehearsedChoice(best, candidates[best], rollouts)


def best_of(rollouts: Mapping[int, Rollout]) -> int | None:
    """Place of the best try; None where there is none."""
    whole = [index for index, rollout in rollouts.items() if not rollout.cut]
    return max(whole, key=lambda index: _rank(rollouts[index], index), default=None)


def _rank(rollout: Rollout, index: int) -> tuple[bool, bool, float, int]:
    return not rollout.collided, not rollout.failed, rollout.worth, -index


class _Impatient:
    """A judge that ends a try which is lost, even if it came to no collision."""

    def __init__(self, judge: RehearsalJudge, best: tuple[bool, bool, float, int], index: int) -> None:
        self._judge = judge
        self._best = best
        self._index = index
        self.cut = False

    def observe(self) -> None:
        self._judge.observe()
        if self._judge.over:
            return
        self.cut = self._best > (True, True, self._judge.ceiling, -self._index)

    @property
    def over(self) -> bool:
        return self.cut or self._judge.over

    @property
    def success(self) -> bool:
        return not self.cut and self._judge.success

    def outcome(self) -> Outcome:
        return "ended" if self.cut else self._judge.outcome()

    def metrics(self) -> tuple[Metric, ...]:
        return ()


_NOTHING: Final = (False, False, -math.inf, 0)
"""Rank that any try beats."""


def _attempt(
    world: SomeWorld,
    index: int,
    source: str,
    make_judge: Callable[[SomeWorld], RehearsalJudge],
    best: tuple[bool, bool, float, int],
    sandbox: Sandbox,
    max_s: float,
    library: str,
    stop_zone_m: float,
) -> Rollout:
    twin = world.copy()
    judge = make_judge(twin)
    referee = _Impatient(judge, best, index)
    executor = ProgramExecutor(sandbox=sandbox, library=library, gate=False, stop_zone_m=stop_zone_m)
    try:
        executor.start(source, twin)
        episode = run_episode(twin, executor, referee, max_s=max_s, record=False)
    finally:
        executor.close()
    if episode.causes.infra_failed:
        raise SandboxError(f"The sandbox failed in a rehearsal: {episode.causes.detail}", retryable=True)
    worth = -math.inf if episode.causes.policy_failed else judge.worth
    return Rollout(worth, judge.collided, episode.outcome, episode.ticks, referee.cut)
