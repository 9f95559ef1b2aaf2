"""Rehearsal: several programs are tried on copies of the scene, and the best of them is the one to drive.

It needs a world that can be copied at an instant, and so a simulated one: a rehearsal foresees what the traffic is
going to do. Whatever comes of it says so (`label`). Programs run in the sandbox here as well as at the wheel.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Lock
from typing import Protocol, Self

from chauffeur.concept import Metric, Outcome, SandboxError
from chauffeur.drive.episode import Referee, run_episode
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


class Judge(Referee, Protocol):
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


@dataclass(frozen=True, slots=True)
class Choice:
    """The best candidate.

    Attributes:
        index: Its place among the candidates.
        source: Its text.
        rollouts: How each candidate did.
    """

    index: int
    source: str
    rollouts: tuple[Rollout, ...]


def rehearse(
    world: CopyableWorld,
    candidates: Sequence[str],
    judge: Callable[[CopyableWorld], Judge],
    *,
    sandbox: Sandbox,
    max_s: float,
    library: str = "",
    threads: int = 1,
) -> Choice:
    """Try all candidates on copies of the world and choose the one whose trip was worth most.

    One that collides is only chosen when all collide, one whose program fails only when all fail; of equals the first
    is taken. A try is broken off as soon as it cannot become the best any more, which changes no choice. So the choice
    depends on the world, the candidates and the judge alone, not on the number of threads.

    Args:
        world: Where the trip is to begin; it stays as it is.
        candidates: Checked program texts, likely ones first: the sooner a good one is known, the less is simulated.
        judge: Makes the judge of a trip on a copy.
        sandbox: Where the programs run.
        max_s: Bound of each try in simulated time.
        library: Helper functions the programs may call.
        threads: Tries at a time. A try waits for its sandbox about half of the time, so two keep two cores busy.

    Raises:
        ValueError: There are no candidates.
        SandboxError: No worker can be had.
    """
    if not candidates:
        raise ValueError("There is nothing to rehearse: no candidates.")
    best = _Best()

    def attempt(index: int) -> Rollout:
        return _attempt(world.copy(), index, candidates[index], judge, best, sandbox, max_s, library)

    if threads <= 1:
        rollouts = tuple(map(attempt, range(len(candidates))))
    else:
        with ThreadPoolExecutor(threads) as pool:
            rollouts = tuple(pool.map(attempt, range(len(candidates))))
    return Choice(best.index, candidates[best.index], rollouts)


class _Best:
    """The best try so far, shared by those under way."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._rank: tuple[bool, bool, float, int] = (False, False, -math.inf, 0)

    @property
    def index(self) -> int:
        """Place of the best candidate."""
        return -self._rank[3]

    def offer(self, rollout: Rollout, index: int, *, failed: bool) -> None:
        """A try that has come to its end."""
        rank = (not rollout.collided, not failed, rollout.worth, -index)
        with self._lock:
            self._rank = max(self._rank, rank)

    def beats(self, ceiling: float, index: int) -> bool:
        """Whether a try under way cannot become the best any more, even without a collision."""
        return self._rank > (True, True, ceiling, -index)


class _Impatient:
    """A judge that ends a try which is lost."""

    def __init__(self, judge: Judge, best: _Best, index: int) -> None:
        self._judge = judge
        self._best = best
        self._index = index
        self.cut = False

    def observe(self) -> None:
        self._judge.observe()
        self.cut = not self._judge.over and self._best.beats(self._judge.ceiling, self._index)

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


def _attempt(
    world: CopyableWorld,
    index: int,
    source: str,
    make_judge: Callable[[CopyableWorld], Judge],
    best: _Best,
    sandbox: Sandbox,
    max_s: float,
    library: str,
) -> Rollout:
    judge = make_judge(world)
    referee = _Impatient(judge, best, index)
    executor = ProgramExecutor(sandbox=sandbox, library=library)
    try:
        executor.start(source, world)
        episode = run_episode(world, executor, referee, max_s=max_s, record=False)
    finally:
        executor.close()
    if episode.causes.infra_failed:
        raise SandboxError(f"The sandbox failed in a rehearsal: {episode.causes.detail}", retryable=True)
    failed = episode.causes.policy_failed
    worth = -math.inf if failed else judge.worth
    rollout = Rollout(worth, judge.collided, episode.outcome, episode.ticks, referee.cut)
    if not referee.cut:
        best.offer(rollout, index, failed=failed)
    return rollout
