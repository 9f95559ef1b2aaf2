"""What of a wish a plan uses, what it leaves out, and what it would do though it was told not to."""

from __future__ import annotations

import pytest

from chauffeur.concept import Parameters, Plan, Program, Thoughts
from chauffeur.driving.judge.account import check_told_not_to, result_of_event, unused_of

NOTHING = "def f():\n    yield autopilot()\n"


def plan(intent: str, source: str = NOTHING, thoughts: str = "I go.") -> Plan:
    return Plan(Thoughts(thoughts), Program(source), intent=intent)


def going_to(route: str) -> Plan:
    return Plan(Thoughts("I go."), Parameters(10.0, 1.0, 1.0, 0, route), intent="go_to")


def parking(route: str, thoughts: str = "You want to park.") -> Plan:
    return Plan(Thoughts(thoughts), Parameters(3.0, 4.0, 1.0, 0, route), intent="park")


@pytest.mark.parametrize(
    ("wish", "made", "unused"),
    [
        ("Overtake the lorry.", plan("overtake.left"), ()),
        ("Overtake and come back.", plan("overtake.left"), ()),
        ("Step on it, I'm late", plan("style.hurry"), ()),
        ("Pull over after the fountain", plan("pull_over"), ("after the fountain",)),
        ("Turn left, then left again", plan("way left"), ("then left again",)),
        ("Turn left, then left again", plan("way left+way left"), ()),
        ("Slow down if it starts raining", plan("speed.decrease"), ("if it starts raining",)),
        ("Stop after the church", plan("stop", 'def f():\n    x = get_distance_to_place("church")\n'), ()),
        ("Take me to the hospital", going_to("hospital"), ()),
        ("Take me to the hospital", going_to("station"), ("to the hospital",)),
        ("Change lanes when it is safe", plan("lane.left"), ()),
        ("Park in the shade and not next to a van", parking("nearest"), ("in the shade and not next to a van",)),
        ("Park, but not next to a van.", parking("B6", "You want a spot with no van beside it."), ()),
        ("Park in the nearest free spot.", parking("nearest"), ()),
    ],
)  # fmt: skip
def test_parts_that_the_plan_does_not_use_are_named(wish: str, made: Plan, unused: tuple[str, ...]) -> None:
    assert unused_of(wish, made) == unused


@pytest.mark.parametrize(
    ("wish", "intent", "stops"),
    [
        ("Don't let the bus in", "yield", True),
        ("Do not let that van merge in front of us", "gap.increase", True),
        ("Never overtake here", "overtake.left", True),
        ("Don't turn left", "turn.left", True),
        ("Don't turn left, turn right", "turn.right", False),
        ("Don't overtake, stay behind", "follow", False),
        ("Let the bus in", "yield", False),
    ],
)
def test_a_plan_that_does_what_it_was_told_not_to_is_not_driven(wish: str, intent: str, stops: bool) -> None:
    assert any(verdict.stops for verdict in check_told_not_to(wish, plan(intent))) is stops


def test_a_plan_without_a_policy_leaves_nothing_out() -> None:
    asked = Plan(Thoughts(""), None, refusal="Shall I?", intent="ask")
    assert unused_of("Pull over after the fountain", asked) == ()


@pytest.mark.parametrize(
    ("kind", "made", "result"),
    [
        ("finished", plan("pull_over"), "partly done"),
        ("finished", plan("speed.set"), "partly done"),
        ("declined", Plan(Thoughts(""), None, refusal="Shall I?", intent="ask"), "asked back"),
        ("declined", Plan(Thoughts(""), None, refusal="No.", intent="refuse"), "declined"),
        ("refused", plan("pull_over"), "declined"),
        ("unplanned", None, "failed"),
        ("superseded", plan("pull_over"), "not done"),
    ],
)
def test_a_wish_in_real_time_ends_in_the_same_words(kind: str, made: Plan | None, result: str) -> None:
    assert result_of_event(kind, "Pull over after the fountain", made) == result  # type: ignore[arg-type]
    assert result_of_event("finished", "Pull over", plan("pull_over")) == "done"
