"""An answer drives nothing and a refusal is told once."""

from __future__ import annotations

import asyncio

import pytest

from chauffeur.concept import Instruction, Limits, PersonId, Verdict
from chauffeur.describe.answers import DONT_KNOW
from chauffeur.driving.planning import ANSWERED
from chauffeur.driving.recording import RecordedTrip
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session, parse_wish
from chauffeur.planners.registry import make_planner
from chauffeur.safety.words import reasons_once


def _driven(words: str, confirmed: str = "") -> RecordedTrip:
    place = find("overtake")
    session = Session(planner=make_planner("onboard"), max_s=1.0)
    wish = Instruction(parse_wish(words, PersonId("")).text, confirmed=confirmed)
    return asyncio.run(session.drive(wish, place, place.seed, Limits()))


def test_a_question_is_answered_and_nothing_is_driven() -> None:
    trip = _driven("What is the speed limit here?").trip
    assert (trip.plan.policy, trip.plan.intent) == (None, ANSWERED)
    assert trip.plan.refusal == "The speed limit here is 113 km/h (70 mph)."
    assert trip.duration_s == 0.0


def test_what_is_not_known_is_said_to_be_so() -> None:
    plan = _driven("What is the capital of France?").trip.plan
    assert (plan.policy, plan.refusal) == (None, DONT_KNOW)


def test_the_reason_of_a_refusal_is_told_once_and_in_the_passengers_unit() -> None:
    detail = _driven("Drive at 300 km/h.").trip.causes.detail
    why = "A target speed of 300 km/h is more than 4 km/h above the speed limit of 113 km/h here."
    assert detail == f"{why} Use a target speed from 0 to 116 km/h."


def test_a_yes_drives_what_was_asked_about() -> None:
    asked = _driven("Drive at 8O km/h.")
    assert asked.frames == ()
    assert asked.trip.plan.refusal == "Did you mean 80 km/h?"
    assert _driven(asked.trip.plan.offer, asked.trip.plan.refusal).frames


@pytest.mark.parametrize("words", ["Drive at 0 km/h.", "Slow down to 20 km/h."])
def test_a_question_is_asked_only_where_a_yes_could_be_driven(words: str) -> None:
    """On a highway a yes would be refused for the least speed: the refusal comes at once, with what would help."""
    plan = _driven(words).trip.plan
    assert (plan.offer, plan.policy) == ("", None)
    assert "At least 60 km/h here." in plan.refusal
    assert "?" not in plan.refusal
    assert plan.thoughts.text == plan.refusal


def test_different_reasons_are_all_told() -> None:
    said = reasons_once(
        (
            Verdict("a", False, "Too fast. (In a helper function.)"),
            Verdict("b", False, "Too fast."),
            Verdict("c", False, "Too near."),
            Verdict("d", True, "Fine."),
        )
    )
    assert said == "Too fast. Too near."


def test_two_speeds_stay_two() -> None:
    too_fast = Verdict("a", False, "A target speed of 5.1 m/s (18 km/h) is above the cap of 5 m/s (18 km/h).")
    assert reasons_once((too_fast,)) == "A target speed of 18.4 km/h is above the cap of 18.0 km/h."
