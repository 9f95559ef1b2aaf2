"""One word for how a wish ended and one sentence for what became of it, the same on page and terminal."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from sample_trips import doubted, highway_trip, refused_trip

from chauffeur.concept import ActionMatrix, Causes, Parameters, Plan, Program, Thoughts, Trip, WishPart
from chauffeur.concept.utterance import Act
from chauffeur.hmi.words import account_words, trip_words

DRIVEN = highway_trip(seconds=1.0).trip
LEFT, STOP = WishPart("done", "turn left"), WishPart("not_done", "stop behind the bus", "the car stood elsewhere")
WAIT = WishPart("not_judged", "wait for me", "no predicate knows this")


def driven(**changes: Any) -> Trip:
    return replace(DRIVEN, **changes)


def planned(policy: Any, intent: str = "", acts: tuple[Act, ...] = (), **settings: float) -> Plan:
    return Plan(Thoughts("I go."), policy, intent=intent, acts=acts, settings=tuple(settings.items()))


def undriven(intent: str, offer: str = "", **changes: Any) -> Trip:
    plan = Plan(Thoughts(""), None, refusal="Shall I wait?", intent=intent, offer=offer)
    return replace(refused_trip().trip, plan=plan, **changes)


@pytest.mark.parametrize(
    ("trip", "headline", "account"),
    [
        (driven(parts=(LEFT,)), "✓ Done", "; I understood: turn left; done."),
        (driven(parts=(LEFT, LEFT)), "✓ Done", "; I understood: turn left, then turn left; done: all of it."),
        (
            driven(parts=(LEFT, STOP), outcome="failure"),
            "~ Partly done",
            "; I understood: turn left, then stop behind the bus; done: turn left; not done: stop behind the bus "
            "(the car stood elsewhere).",
        ),
        (
            driven(parts=(STOP,), outcome="timeout"),
            "✕ Not done",
            "; I understood: stop behind the bus; not done: stop behind the bus (the car stood elsewhere); time or "
            "road ran out.",
        ),
        (
            driven(parts=(LEFT, WAIT)),
            "~ Partly done",
            "; I understood: turn left, then wait for me; done: turn left; not compared: wait for me (no predicate "
            "knows this).",
        ),
        (
            driven(parts=(LEFT,), unused=("at the church", "slowly")),
            "~ Partly done",
            "; I understood: turn left; done; not used: “at the church”, “slowly”.",
        ),
        (
            driven(outcome="collision", parts=(STOP,)),
            "✕ Failed",
            "; I understood: stop behind the bus; not done: stop behind the bus (the car stood elsewhere); it ended in "
            "a collision.",
        ),
        (
            driven(outcome="ended", plan=planned(ActionMatrix((1.0, 0.1, 0.1), (1.0, 1.0, 1.0)), "motion", style=0.0)),
            "– Done, not compared",
            "; I understood: drive carefully; not compared: nothing in this drive can be held against the words.",
        ),
        (driven(outcome="timeout"), "✕ Not done", "; I understood: pass on the left; not done; time or road ran out."),
        (undriven("ask"), "? Asked back", "; I asked back: Shall I wait?"),
        (undriven("speed.set", offer="Wait."), "? Asked back", "; I asked back: Shall I wait?"),
        (undriven("refuse"), "– Declined", "; I declined: Shall I wait?"),
        (undriven("answer"), "– Done", "; I answered: Shall I wait?"),
        (undriven("unusable", causes=Causes(policy_failed=True)), "✕ Failed", "; no plan could be used: Shall I wait?"),
    ],
)
def test_a_word_and_a_sentence(trip: Trip, headline: str, account: str) -> None:
    sign, label, tone = trip_words(trip)
    assert f"{sign} {label}" == headline
    assert account_words(trip) == account
    assert tone != "bad" or sign == "✕"


@pytest.mark.parametrize(
    ("plan", "understood"),
    [
        (planned(Parameters(3.0, 4.0, 1.0, route="station"), "go_to"), "drive to the station"),
        (planned(Parameters(3.0, 4.0, 1.0, route="nearest"), "park"), "park in the nearest free spot"),
        (planned(Parameters(3.0, 4.0, 1.0, route="B6"), "park"), "park in spot B6"),
        (planned(Parameters(3.0, 4.0, 1.0, route="stadium"), "park"), "park near the stadium"),
        (planned(Parameters(3.0, 4.0, 1.0, route="left")), "turn left"),
        (planned(Program(""), "style.hurry"), "drive quickly"),
        (planned(Program(""), "x", (Act("speed", value=80.0, unit="km/h"),)), "drive at 80 km/h"),
    ],
)
def test_a_plan_that_leads_to_a_place_is_told_by_the_place(plan: Plan, understood: str) -> None:
    assert account_words(driven(plan=plan, parts=(WishPart("done"),))) == f"; I understood: {understood}; done."
    missed = driven(plan=plan, parts=(WishPart("not_done", why="the car did not get there"),), outcome="timeout")
    assert f"; not done: {understood} (the car did not get there); " in account_words(missed)


def test_speeds_are_in_the_persons_unit_and_an_explanation_that_is_not_so_takes_the_tick() -> None:
    short = WishPart("not_done", "drive at 50 mph", "the car drove at 20.1 m/s")
    wish = replace(DRIVEN.instruction, text="Drive at 50 mph.")
    assert "(the car drove at 45 mph)" in account_words(driven(instruction=wish, parts=(short,), outcome="failure"))
    assert trip_words(doubted(highway_trip(seconds=1.0)).trip)[:2] == ("≠", "Done, not as explained")
    assert trip_words(DRIVEN, timed=True)[1] == "Done after 1 s"
