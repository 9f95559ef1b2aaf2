"""Questions about the situation are answered from C, and only wishes go to the planner.

An answer never changes the drive.
"""

from __future__ import annotations

import time
from dataclasses import replace

from chauffeur.concept import Plan, PlanRequest, Thoughts
from chauffeur.describe.answers import DONT_KNOW, answer_to, asks_to_know
from chauffeur.planners.base import NO_WISH, Planner, declined

ANSWERED = "answer"
"""The intent of a plan that answers a question and drives nothing."""


async def plan_or_answer(planner: Planner, request: PlanRequest) -> Plan:
    """The planner's plan; of a question, the answer, with nothing to drive.

    Raises:
        ChauffeurError: No plan can be had.
    """
    begun = time.perf_counter()
    words = request.instruction.text
    said = answer_to(words, request.context.situation, request.context.text)
    if said:
        return declined(planner, said, begun, intent=ANSWERED)
    plan = await planner.plan(request)
    open_ = not plan.offer and plan.intent != NO_WISH
    if (plan.policy is not None or open_) and not request.instruction.confirmed and asks_to_know(words):
        return replace(plan, policy=None, thoughts=Thoughts(DONT_KNOW), refusal=DONT_KNOW, intent=ANSWERED)
    return plan
