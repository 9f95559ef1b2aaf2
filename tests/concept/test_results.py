"""Six words for how a wish ended: one place decides, and trips of older formats have one, too."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from chauffeur.concept import (
    Causes,
    Context,
    History,
    Instruction,
    Outcome,
    Plan,
    Program,
    Thoughts,
    Trip,
    Verdict,
    WishPart,
    result_of,
)
from chauffeur.concept.results import result_of_stored
from chauffeur.concept.units import people_speed

DONE, MISSED = WishPart("done", "turn left"), WishPart("not_done", "stop", "the car did not come to a stand")


def trip(outcome: Outcome, **changes: Any) -> Trip:
    plan = Plan(Thoughts("I go."), Program("def f():\n    yield autopilot()\n"), intent="speed.set")
    made = Trip("t", Instruction("Go."), Context("", None), History(), plan, (), outcome, Causes(), (), 5.0, "s", 0)  # type: ignore[arg-type]
    return replace(made, **changes)


def undriven(intent: str, offer: str = "") -> Trip:
    return trip("refused", plan=Plan(Thoughts(""), None, refusal="Shall I?", intent=intent, offer=offer))


@pytest.mark.parametrize(
    ("made", "result"),
    [
        (trip("success"), "done"),
        (trip("success", unused=("when it rains",)), "partly done"),
        (trip("ended"), "done"),
        (trip("success", parts=(DONE, WishPart("not_judged", "wait"))), "partly done"),
        (trip("ended", unused=("and wait",)), "partly done"),
        (trip("ended", plan=Plan(Thoughts(""), Program(""))), "partly done"),
        (trip("timeout", parts=(MISSED, MISSED)), "not done"),
        (trip("timeout", parts=(DONE, MISSED)), "partly done"),
        (trip("failure", parts=(DONE, MISSED)), "partly done"),
        (trip("failure", parts=(DONE, MISSED), causes=Causes(policy_failed=True)), "failed"),
        (trip("collision", parts=(DONE, MISSED)), "failed"),
        (trip("off_road"), "failed"),
        (trip("refused", causes=Causes(refused=True)), "declined"),
        (trip("refused", causes=Causes(policy_failed=True)), "failed"),
        (undriven("ask"), "asked back"),
        (undriven("speed.set", offer="Drive at 80 km/h."), "asked back"),
        (undriven("answer"), "done"),
        (undriven("refuse"), "declined"),
        (undriven("unusable"), "failed"),
    ],
)
def test_a_trip_ends_in_one_of_six_words(made: Trip, result: str) -> None:
    assert result_of(made) == result


@pytest.mark.parametrize(
    ("outcome", "intent", "result"),
    [
        ("success", "overtake", "done"),
        ("refused", "ask", "asked back"),
        ("refused", "refuse", "declined"),
        ("timeout", "", "not done"),
        ("partly done", "overtake", "partly done"),
    ],
)
def test_what_an_older_version_kept_has_a_result(outcome: str, intent: str, result: str) -> None:
    assert result_of_stored(outcome, intent) == result


def test_a_tick_stands_only_where_something_was_compared() -> None:
    held = Verdict("c-v1", True, "It fits.")
    grey = replace(held, not_compared="no-program")
    broken = Verdict("c-v1", False, "It broke.", not_compared="check-broke")
    assert (held.state, held.mark) == ("held", "passed")
    assert (grey.state, grey.mark, grey.stops) == ("not_compared", "not_compared", False)
    assert (broken.state, broken.mark, broken.stops) == ("not_compared", "failed", True)
    assert replace(broken, vetoes=False).mark == "not_compared"
    assert (replace(held, passed=False).state, replace(held, passed=False).mark) == ("failed", "failed")


@pytest.mark.parametrize(
    ("speed_mps", "unit", "nearest", "at_most"),
    [
        (26.39, "km/h", "95 km/h", "95 km/h"),
        (26.36, "km/h", "95 km/h", "94 km/h"),
        (23.66, "km/h", "85 km/h", "85 km/h"),
        (31.2, "mph", "70 mph", "69 mph"),
        (0.0, "km/h", "0 km/h", "0 km/h"),
        (float("inf"), "km/h", "inf km/h", "inf km/h"),
    ],
)
def test_speeds_are_whole_and_a_bound_is_rounded_down(speed_mps: float, unit: Any, nearest: str, at_most: str) -> None:
    assert people_speed(speed_mps, unit) == nearest
    assert people_speed(speed_mps, unit, at_most=True) == at_most
