"""The LLM4AD loop (paper Sec. II, Fig. 2), in the paper's letters.

I  instruction        what the person wants, in their own words
C  context            the situation, put into words by the situation descriptor
S  system message     role, rules, driving APIs, examples
H  history            what memory holds of this person that bears on I and C
R, P                  the planner's reasoning and policy
V  verdicts           what stands between P and the vehicle
F  feedback           what the person says afterwards; it reaches H of the next trip
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from chauffeur.concept import (
    CameraImage,
    Context,
    Feedback,
    History,
    Instruction,
    Limits,
    Observation,
    PersonId,
    Plan,
    SystemMessage,
    Trip,
    Verdict,
)
from chauffeur.driving.emergency import not_checked, planned_for
from chauffeur.driving.events import DriveEvent, Listener, nobody_listens
from chauffeur.driving.planning import RECALLED, Judged, Planned, PlanSteps, no_pictures, plan_once
from chauffeur.planners.base import Planner


class LoopMemory(Protocol):
    """The part of a memory the loop needs."""

    def recall(self, person: PersonId, instruction: Instruction, context: Context, k: int) -> History: ...
    def remember(self, trip: Trip, feedback: Feedback | None) -> None: ...


async def drive(I: Instruction, steps: PlanSteps, execute: Callable[[Planned], Trip], memory: LoopMemory) -> Trip:  # noqa: E741, N803
    """One wish, from the words to the remembered trip."""
    planned = await plan_once(I, steps)  # C, H, S, R, P, V

    trip = execute(planned)  # P, if no verdict stops it
    steps.tell(DriveEvent("trip", value=trip))

    memory.remember(trip, None)  # H + (I, C, P, R); F joins when the person speaks
    return trip


def steps_at(
    observation: Observation,
    planner: Planner,
    memory: LoopMemory,
    limits: Limits,
    *,
    describe: Callable[[Observation], Context],
    system: Callable[[Limits], SystemMessage],
    check: Callable[[Plan, Observation, Limits], tuple[Verdict, ...]],
    tell: Listener = nobody_listens,
    see: Callable[[Observation], tuple[CameraImage, ...]] = no_pictures,
    shows: bool = True,
) -> PlanSteps:
    """The way from words to a checked plan, at an instant of a world that waits for it.

    Args:
        observation: The instant.
        planner, memory, limits: Of the wish.
        describe, system, check: C, S and V.
        tell: Hears each letter as it comes.
        see: Takes pictures, for planners that look.
        shows: Whether the planner is given the instant.
    """

    async def described() -> Context:
        return describe(observation)

    async def recalled(I: Instruction, C: Context) -> History:  # noqa: E741, N803
        return memory.recall(I.person, I, C, RECALLED)

    async def judged(plan: Plan, own: bool) -> Judged:
        return (not_checked(plan) if own else check(plan, observation, limits)), observation

    return PlanSteps(
        planner=planner,
        limits=limits,
        describe=described,
        recall=recalled,
        system=lambda: system(limits),
        own=lambda text: planned_for(text, observation),
        check=judged,
        see=lambda: see(observation),
        observe=lambda: observation if shows else None,
        tell=tell,
    )
