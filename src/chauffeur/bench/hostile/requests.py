"""Requests to a planner for an input: the words in the place where they would really stand.

A service's text is a fact of the scene, in words and as a value; planted trips are what memory recalls; earlier turns
of a talk are asked first, and what came of them is remembered, as it is when a passenger speaks again and again.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from typing import Final

from chauffeur.bench.hostile.loader import Input, PastTrip
from chauffeur.concept import (
    Context,
    History,
    HistoryItem,
    Instruction,
    Limits,
    Plan,
    PlanRequest,
    Program,
    SystemMessage,
)
from chauffeur.driving.planning import RECALLED, screened_request
from chauffeur.memory.feedback import interpret_feedback
from chauffeur.safety.constant_calls import read_program

SERVICE: Final = "service text"

_SETTINGS: Final = {"set_target_speed": "target_speed_mps", "set_desired_time_headway": "time_headway_s"}

Ask = Callable[[PlanRequest], Awaitable[Plan | None]]


@dataclass(frozen=True, slots=True)
class HostileRequests:
    """Requests of the suite.

    Attributes:
        system: S, for planners that read one.
        limits: Bounds that the planner is told of.
        screened: Whether requests pass the screening on their way.
    """

    system: SystemMessage
    limits: Limits
    screened: bool = True

    async def request(self, one: Input, context: Context, ask: Ask) -> PlanRequest:
        """The request of an input; `ask` plans its earlier turns, one after the other."""
        past = [_planted(trip, day, context) for day, trip in enumerate(one.history, start=1)]
        for day, turn in enumerate(one.turns, start=len(past) + 1):
            plan = await ask(self._request(turn, context, past))
            past.append(_spoken(turn, day, context, plan))
        return self._request(one.wish, _told(context, one.context), past)

    def _request(self, wish: str, context: Context, past: list[HistoryItem]) -> PlanRequest:
        # Memory hands the most recent first.
        history = History(tuple(past[::-1][:RECALLED]))
        make = screened_request if self.screened else PlanRequest
        return make(Instruction(wish, source="benchmark"), context, self.system, history, limits=self.limits)


def _told(context: Context, text: str) -> Context:
    if not text:
        return context
    situation = replace(context.situation, scene=(*context.situation.scene, (SERVICE, text)))
    return Context(f"{context.text} {SERVICE.capitalize()}: {text}", situation)


def _planted(trip: PastTrip, day: int, context: Context) -> HistoryItem:
    """A trip as memory would hold it had the program been driven: its constants are the settings it used."""
    settings = {
        _SETTINGS[use.name]: use.values[-1]
        for use in read_program(trip.program).uses
        if use.name in _SETTINGS and use.values
    }
    item = _item(trip.wish, day, context, trip.program)
    return replace(item, settings=tuple(settings.items()), feedback=(interpret_feedback(trip.feedback),))


def _spoken(turn: str, day: int, context: Context, plan: Plan | None) -> HistoryItem:
    if plan is None:
        return _item(turn, day, context, "")
    source = plan.policy.source if isinstance(plan.policy, Program) else ""
    item = _item(turn, day, context, source)
    outcome = "ended" if source else "refused"
    return replace(item, intent=plan.intent, settings=plan.settings, thoughts=plan.thoughts.text, outcome=outcome)


def _item(wish: str, day: int, context: Context, policy: str) -> HistoryItem:
    return HistoryItem(
        trip_id=f"h{day}",
        when=f"2025-01-{day:02d}T09:00:00Z",
        instruction=wish,
        context="",
        world=context.situation.world,
        intent="",
        thoughts="",
        policy=policy,
        outcome="ended",
        similarity=1.0,
    )
