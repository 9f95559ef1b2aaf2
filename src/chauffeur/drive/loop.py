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
    Context,
    Feedback,
    History,
    Instruction,
    Limits,
    PersonId,
    Plan,
    PlanRequest,
    Scenario,
    Snapshot,
    SystemMessage,
    Trip,
    Verdict,
)
from chauffeur.drive.answering import plan_or_answer
from chauffeur.drive.emergency import check_told_not_to, not_checked, planned_for
from chauffeur.planners.base import Planner
from chauffeur.safety.screening import screen_request
from chauffeur.worlds.base import World


class Memory(Protocol):
    """The part of a memory the loop needs."""

    def recall(self, person: PersonId, instruction: Instruction, context: Context, k: int) -> History: ...
    def remember(self, trip: Trip, feedback: Feedback | None) -> None: ...


@dataclass(frozen=True, slots=True)
class Stages:
    """The loop's exchangeable parts, one per arrow of the figure."""

    world: World
    describe: Callable[[Snapshot], Context]
    memory: Memory
    system: Callable[[Limits], SystemMessage]
    planner: Planner
    check: Callable[[Plan, Snapshot, Limits], tuple[Verdict, ...]]
    execute: Callable[[PlanRequest, Plan, tuple[Verdict, ...], Scenario, int], Trip]
    tell: Callable[[str, object], None]


def ask(
    I: Instruction,  # noqa: E741, N803
    snapshot: Snapshot,
    limits: Limits,
    stages: Stages,
) -> PlanRequest:
    """Everything the planner is given for a wish in a situation."""
    C = stages.describe(snapshot)  # noqa: N806
    H = stages.memory.recall(I.person, I, C, 3)  # noqa: N806
    S = stages.system(limits)  # noqa: N806
    for letter, value in (("I", I), ("C", C), ("H", H), ("S", S)):
        stages.tell(letter, value)

    request, screened = screen_request(PlanRequest(I, C, S, H, limits=limits))  # words are data
    stages.tell("screened", screened)
    return request


async def drive(I: Instruction, scenario: Scenario, seed: int, limits: Limits, stages: Stages) -> Trip:  # noqa: E741, N803
    """One wish, from the words to the remembered trip."""
    snapshot = stages.world.reset(scenario, seed)

    request = ask(I, snapshot, limits, stages)
    own = planned_for(I.text, snapshot)  # emergency words are no planner's to decide
    plan = own or await plan_or_answer(stages.planner, request)  # R, P
    stages.tell("RP", plan)

    forbidden = check_told_not_to(I.text, plan, snapshot)  # by the person, in words
    V = not_checked(plan) if own else (*stages.check(plan, snapshot, limits), *forbidden)  # noqa: N806
    stages.tell("V", V)

    trip = stages.execute(request, plan, V, scenario, seed)  # drives P only if no verdict stops it
    stages.tell("trip", trip)

    stages.memory.remember(trip, None)  # H + (I, C, P, R); F joins when the person speaks
    return trip
