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
from dataclasses import dataclass
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
    PlanRequest,
    Scenario,
    SystemMessage,
    Trip,
    Verdict,
)
from chauffeur.driving.emergency import not_checked, planned_for
from chauffeur.driving.events import DriveEvent, Listener, nobody_listens
from chauffeur.driving.planning import RECALLED, Judged, PlanSteps, no_pictures, plan_once
from chauffeur.planners.base import Planner
from chauffeur.worlds.base import World


class LoopMemory(Protocol):
    """The part of a memory the loop needs."""

    def recall(self, person: PersonId, instruction: Instruction, context: Context, k: int) -> History: ...
    def remember(self, trip: Trip, feedback: Feedback | None) -> None: ...


@dataclass(frozen=True, slots=True)
class Stages:
    """The loop's exchangeable parts; `see` takes pictures for planners that look, `shows` gives them the instant."""

    world: World
    describe: Callable[[Observation], Context]
    memory: LoopMemory
    system: Callable[[Limits], SystemMessage]
    planner: Planner
    check: Callable[[Plan, Observation, Limits], tuple[Verdict, ...]]
    execute: Callable[[PlanRequest, Plan, tuple[Verdict, ...], Scenario, int], Trip]
    tell: Listener = nobody_listens
    see: Callable[[Observation], tuple[CameraImage, ...]] = no_pictures
    shows: bool = True


def steps_of(stages: Stages, observation: Observation, limits: Limits) -> PlanSteps:
    """The way from words to a checked plan, at an instant of a world that waits for it."""

    async def describe() -> Context:
        return stages.describe(observation)

    async def recall(I: Instruction, C: Context) -> History:  # noqa: E741, N803
        return stages.memory.recall(I.person, I, C, RECALLED)

    async def check(plan: Plan, own: bool) -> Judged:
        return (not_checked(plan) if own else stages.check(plan, observation, limits)), observation

    return PlanSteps(
        planner=stages.planner,
        limits=limits,
        describe=describe,
        recall=recall,
        system=lambda: stages.system(limits),
        own=lambda text: planned_for(text, observation),
        check=check,
        see=lambda: stages.see(observation),
        observe=lambda: observation if stages.shows else None,
        tell=stages.tell,
    )


async def drive(I: Instruction, scenario: Scenario, seed: int, limits: Limits, stages: Stages) -> Trip:  # noqa: E741, N803
    """One wish, from the words to the remembered trip."""
    observation = stages.world.reset(scenario, seed)
    planned = await plan_once(I, steps_of(stages, observation, limits))  # C, H, S, R, P, V

    trip = stages.execute(planned.request, planned.plan, planned.verdicts, scenario, seed)  # P, if no verdict stops it
    stages.tell(DriveEvent("trip", value=trip))

    stages.memory.remember(trip, None)  # H + (I, C, P, R); F joins when the person speaks
    return trip
