"""What a program did: in a drive, or tried on copies of the scene, in the sandbox, for a few simulated seconds.

Trying needs a world that can be copied at an instant, and so a simulated one: what is found foresees the simulator's
traffic, and says nothing of a real road. It takes some tenths of a second; a drive does not wait for it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from chauffeur.concept import Observation, Program, SandboxError, Thoughts
from chauffeur.drive.episode import Episode, run_episode
from chauffeur.drive.rehearsal import CopyableWorld
from chauffeur.programs import ProgramExecutor, Sandbox
from chauffeur.safety.faithfulness import Effect, FactSurroundings, Faithfulness, judge, read_facts

MAX_S: Final = 30.0
"""Simulated seconds a program is given to show what it does."""

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
) -> Faithfulness:
    """Judge thoughts by what reading finds in a program and by what it did on copies of the first world and the others.

    Raises:
        ValueError: There is no world.
        SandboxError: No worker can be had.
    """
    if not worlds:
        raise ValueError("There is no scene to run the program in.")
    where = FactSurroundings.of(worlds[0].observe())
    effects = effects_of(worlds, program, sandbox=sandbox, max_s=max_s)
    return judge(thoughts.text, read_facts(program.source, program.library), where, effects)


def effect_of(episode: Episode) -> Effect:
    """What happened in a drive of which at least one frame was recorded."""
    shots = [*(frame.observation for frame in episode.frames), episode.final]
    first, last = shots[0], shots[-1]
    speeds = [shot.ego.speed_mps for shot in shots]
    # Lanes of another stretch of road have places of their own; on the roads here they run on side by side.
    places = [lane.index for shot in shots if (lane := shot.road.get(shot.ego.lane)) is not None] or [0]
    ending = speeds[-1 - _MEAN_TICKS :]
    return Effect(
        lanes_moved=places[-1] - places[0],
        leftmost=min(places) - places[0],
        rightmost=max(places) - places[0],
        speeds_mps=(speeds[0], sum(ending) / len(ending)),
        extremes_mps=(min(speeds), max(speeds)),
        gaps_m=_gaps(first, last),
        turned=round(_turn_rad(first.ego.heading_rad, last.ego.heading_rad) / (math.pi / 2.0)),
        failed=episode.causes.policy_failed or episode.causes.infra_failed,
        cut=(episode.success and episode.frames[-1].program == "running") or last.ego.crashed or last.off_road,
    )


def _effect(world: CopyableWorld, program: Program, sandbox: Sandbox, max_s: float) -> Effect:
    twin = world.copy()
    executor = ProgramExecutor(sandbox=sandbox, library=program.library, gate=False)
    try:
        executor.start(program.source, twin)
        episode = run_episode(twin, executor, None, max_s=max_s)
    finally:
        executor.close()
    if episode.causes.infra_failed:
        raise SandboxError(f"The sandbox failed while a program was tried: {episode.causes.detail}", retryable=True)
    return effect_of(episode)


def _gaps(first: Observation, last: Observation) -> tuple[float | None, float | None]:
    """Way along the ego to the vehicle that is ahead at first, then and at the end."""
    if first.front is None:
        return None, None
    ahead = first.front.vehicle
    return _along(first, ahead), _along(last, ahead)


def _along(shot: Observation, vehicle: int) -> float | None:
    ego = shot.ego
    for other in shot.others:
        if other.id == vehicle:
            dx, dy = other.x_m - ego.x_m, other.y_m - ego.y_m
            return dx * math.cos(ego.heading_rad) + dy * math.sin(ego.heading_rad)
    return None


def _turn_rad(first: float, last: float) -> float:
    """Angle turned, -pi to pi, to the right positive."""
    return math.remainder(first - last, 2.0 * math.pi)
