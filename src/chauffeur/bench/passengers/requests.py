"""Requests to a planner for a wish of the set: the plain request, with the passenger's earlier trips as H."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from chauffeur.bench.lampilot.requests import Requests
from chauffeur.bench.passengers.loader import PassengerWish, PastWish
from chauffeur.concept import Context, History, HistoryItem, PlanRequest
from chauffeur.memory.feedback import interpret_feedback
from chauffeur.worlds.highway.dblv1 import Item


class PassengerRequests:
    """Requests of a run over `as_dataset()`; without them no wish has a history, and "like last time" means nothing."""

    id = "passengers"
    labels: tuple[str, ...] = ()

    def __init__(self, plain: Requests, wishes: Iterable[PassengerWish]) -> None:
        """Wrap the requests of a run.

        Args:
            plain: Makes everything but H.
            wishes: Those of the data set.
        """
        self._plain = plain
        self._past = {wish.task: wish.history for wish in wishes if wish.history}

    async def request(self, item: Item, context: Context) -> PlanRequest:
        request = await self._plain.request(item, context)
        # A passenger could answer, so a planner may ask; the question counts as one.
        request = replace(request, instruction=replace(request.instruction, source="text"))
        past = self._past.get(item.task, ())
        remembered = (
            _remembered(f"{item.task}_h{place}", place, one, context) for place, one in enumerate(past, start=1)
        )
        # Memory hands the most recent first.
        return replace(request, history=History(tuple(remembered)[::-1])) if past else request


def _remembered(trip: str, day: int, past: PastWish, context: Context) -> HistoryItem:
    return HistoryItem(
        trip_id=trip,
        when=f"2025-01-{day:02d}T09:00:00Z",
        instruction=past.instruction,
        context="",
        world=context.situation.world,
        intent=past.intent,
        thoughts="",
        policy="",
        feedback=(interpret_feedback(past.feedback),),
        outcome="success",
        similarity=1.0,
    )
