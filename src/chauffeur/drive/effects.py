"""What a program does, found by running it: on copies of the scene, in the sandbox, for a few simulated seconds.

It needs a world that can be copied at an instant, and so a simulated one: what is found foresees the simulator's
traffic, and says nothing of a real road.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from chauffeur.concept import Frame, Program, SandboxError, Snapshot, Thoughts
from chauffeur.drive.episode import Episode, run_episode
from chauffeur.drive.rehearsal import CopyableWorld
from chauffeur.programs import ProgramExecutor, Sandbox
from chauffeur.safety.alignment import Alignment, Effect, Surroundings, judge, read_facts

MAX_S: Final = 30.0
"""Simulated seconds a program is given to show what it does."""

_STANDING_MPS: Final = 0.5
_MEAN_TICKS: Final = 10
"""Control periods of the last second."""


def effects_of(
    worlds: Sequence[CopyableWorld], program: Program, *, sandbox: Sandbox, max_s: float = MAX_S
) -> tuple[Effect, ...]:
    """Run a program on a copy of each world; the worlds stay as they are.

    Args:
        worlds: Scenes at the instant the program is to begin.
        program: What is run; the sandbox alone holds it, the gate is the business of whoever drives it.
        sandbox: Where it runs.
        max_s: Bound of each run in simulated time.

    Raises:
        SandboxError: No worker can be had.
    """
    return tuple(_effect(world, program, sandbox, max_s) for world in worlds)


def judge_driven(
    thoughts: Thoughts, program: Program, worlds: Sequence[CopyableWorld], *, sandbox: Sandbox, max_s: float = MAX_S
) -> Alignment:
    """Judge thoughts by what reading finds in a program and by what it did on copies of the first world and the others.

    Raises:
        ValueError: There is no world.
        SandboxError: No worker can be had.
    """
    if not worlds:
        raise ValueError("There is no scene to run the program in.")
    where = Surroundings.of(worlds[0].snapshot())
    effects = effects_of(worlds, program, sandbox=sandbox, max_s=max_s)
    return judge(thoughts.text, read_facts(program.source, program.library), where, effects)


@dataclass(slots=True)
class _Log:
    """What of a run is kept while it goes on."""

    speeds: list[float] = field(default_factory=list[float])
    places: list[int] = field(default_factory=list[int])

    def see(self, frame: Frame) -> None:
        self._add(frame.snapshot)

    def _add(self, snapshot: Snapshot) -> None:
        self.speeds.append(snapshot.ego.speed_mps)
        lane = snapshot.ego.lane
        if lane is not None:
            self.places.append(lane[2])


def _effect(world: CopyableWorld, program: Program, sandbox: Sandbox, max_s: float) -> Effect:
    twin = world.copy()
    first = twin.snapshot()
    log = _Log()
    executor = ProgramExecutor(sandbox=sandbox, library=program.library, gate=False)
    try:
        executor.start(program.source, twin)
        episode = run_episode(twin, executor, None, max_s=max_s, watch=log.see)
    finally:
        executor.close()
    if episode.causes.infra_failed:
        raise SandboxError(f"The sandbox failed while a program was tried: {episode.causes.detail}", retryable=True)
    return _of(first, episode, log)


def _of(first: Snapshot, episode: Episode, log: _Log) -> Effect:
    last = episode.final
    places = log.places or [0]
    # Lanes of another stretch of road have numbers of their own; on the roads here they run on side by side.
    home, end = places[0], last.ego.lane[2] if last.ego.lane is not None else places[-1]
    final = [*log.speeds[-_MEAN_TICKS:], last.ego.speed_mps]
    return Effect(
        lanes_moved=end - home,
        leftmost=min([*places, end]) - home,
        rightmost=max([*places, end]) - home,
        speeds_mps=(first.ego.speed_mps, sum(final) / len(final)),
        gaps_m=(_gap(first), _gap(last)),
        stood=min([*log.speeds, last.ego.speed_mps]) < _STANDING_MPS,
        failed=episode.causes.policy_failed,
    )


def _gap(snapshot: Snapshot) -> float | None:
    return None if snapshot.front is None else snapshot.front.distance_m
