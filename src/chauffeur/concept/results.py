"""How a wish ended: six words, the same on terminal, page, cabin and in memory."""

from __future__ import annotations

from enum import StrEnum
from typing import Final

from chauffeur.concept.nouns import Outcome, Trip

ANSWERED: Final = "answer"
"""Intent of a plan that answers a question and drives nothing."""
ASKS: Final = "ask"
"""Intent of a plan that asks the person back and drives nothing."""


class Result(StrEnum):
    """What became of a wish; its value is the word that is stored and exported."""

    DONE = "done"
    PARTLY_DONE = "partly done"
    NOT_DONE = "not done"
    ASKED_BACK = "asked back"
    DECLINED = "declined"
    FAILED = "failed"


def result_of(trip: Trip) -> Result:
    """What became of a trip's wish: done only where every part that was read has been done and none was left unused."""
    if trip.plan.refusal and trip.plan.policy is None:
        return undriven(trip.plan.intent, offer=bool(trip.plan.offer))
    result = result_of_stored(trip.outcome, trip.plan.intent)
    if trip.causes.infra_failed or trip.causes.policy_failed:
        return Result.FAILED
    if result is Result.DONE and not is_whole(trip):
        return Result.PARTLY_DONE
    some = any(part.result == "done" for part in trip.parts)
    if result is Result.NOT_DONE and trip.outcome in ("failure", "timeout") and some and not _all_done(trip):
        return Result.PARTLY_DONE
    return result


def is_whole(trip: Trip) -> bool:
    """Whether nothing of the wish stayed unused, and what was driven had a meaning that is known."""
    return not trip.unused and _all_done(trip) and (trip.outcome == "success" or bool(trip.plan.intent))


def _all_done(trip: Trip) -> bool:
    return all(part.result == "done" for part in trip.parts)


def undriven(intent: str, *, offer: bool = False) -> Result:
    """What became of a wish of which nothing was driven, by the plan's intent and whether a yes would be driven."""
    if intent == ANSWERED:
        return Result.DONE
    if intent == ASKS or offer:
        return Result.ASKED_BACK
    return Result.FAILED if intent == "unusable" else Result.DECLINED


_OF_OUTCOMES: Final[dict[Outcome, Result]] = {
    "success": Result.DONE,
    "ended": Result.DONE,
    "failure": Result.NOT_DONE,
    "timeout": Result.NOT_DONE,
    "collision": Result.FAILED,
    "off_road": Result.FAILED,
    "not_driven": Result.NOT_DONE,
}


def result_of_stored(outcome: str, intent: str) -> Result:
    """The result of a trip of which only outcome and intent were kept, as in memories of older versions."""
    known = next((result for result in Result if result == outcome), None)
    if known is not None:
        return known
    found = next((result for name, result in _OF_OUTCOMES.items() if name == outcome), None)
    return undriven(intent) if found is None else found
