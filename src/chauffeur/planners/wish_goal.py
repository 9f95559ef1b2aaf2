"""The goal of a wish in the terms of the judge, for planners whose model does not state it.

A language model writes a program and no intent, so its drives would have no goal where the on-board planner's have one.
The wish is read by the same rules for all of them. The goal judges and never drives: where the rules do not understand
a wish, or the road does not allow it as they read it, there is none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from chauffeur.concept import PlanRequest


@dataclass(frozen=True, slots=True)
class WishGoal:
    """See `Plan.intent` and `Plan.settings`."""

    intent: str = ""
    settings: tuple[tuple[str, float], ...] = ()


NO_GOAL: Final = WishGoal()


def goal_of(request: PlanRequest) -> WishGoal:
    """The goal of a request; `NO_GOAL` where none can be told.

    Only numbers that the person named are in it: how much faster "faster" is, is the planner's to choose.
    """
    from chauffeur.planners.onboard.choose import choose
    from chauffeur.planners.onboard.options import Declined
    from chauffeur.planners.onboard.personal import Leaning
    from chauffeur.planners.onboard.understand import meanings_said

    meanings = meanings_said(request.instruction.text)
    if not meanings:
        return NO_GOAL
    choice = choose(meanings, request.context.situation, request.limits, lambda _: Leaning())
    if isinstance(choice, Declined):
        return NO_GOAL
    named = all(meaning.amount is not None for meaning in meanings)
    return WishGoal(choice.intent, choice.settings(()) if named else ())
