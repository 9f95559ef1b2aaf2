"""Statements of programs as they are followed: what comes after them depends on, and where the car may be by then."""

from __future__ import annotations

import pytest
from faithfulness_programs import facts

from chauffeur.safety.faithfulness import Facts, read_facts

LEFT, RIGHT = "set_target_lane(get_left_lane(ego))", "set_target_lane(get_right_lane(ego))"
NEAR_SIGN, ALLOWED = "detect_stop_sign_ahead() < 5", "get_speed_limit() > 3"
FAST, WIDE = "get_speed_of(ego) > 9", "get_desired_time_headway() > 2"


def depends(body: str, before: str = "") -> set[str]:
    """What the last words that are said depend on."""
    return set([event for event in facts(body, before).events if event.deed == "say"][-1].depends)


def test_a_program_that_ends_before_its_main_function_does_nothing() -> None:
    assert read_facts("raise ValueError\ndef drive():\n    set_target_speed(20)\n    yield autopilot()\n") == Facts()


def test_of_several_main_functions_the_first_is_followed() -> None:
    two = "def drive():\n    set_target_speed(20)\n    yield autopilot()\n\ndef other():\n    set_target_speed(30)\n\n"
    assert len(read_facts(f"{two}drive = drive if 1 else other\n").events) == 1


def test_a_number_is_raised_by_what_a_name_stands_for() -> None:
    (event,) = facts("by = 5\nspeed = 20\nspeed += by\nset_target_speed(speed)").events
    assert sorted(term.offset for term in event.terms) == [20.0, 25.0]


@pytest.mark.parametrize(
    ("body", "known"),
    [
        (f"if {ALLOWED}:\n    return\nsay('now')", {"limit"}),
        (f"if {ALLOWED}:\n    return\nif {NEAR_SIGN}:\n    return\nsay('now')", {"limit", "sign"}),
        (f"if {ALLOWED}:\n    pass\nsay('now')", set[str]()),
        (f"if {ALLOWED} and False:\n    pass\nsay('now')", set[str]()),
        (f"while {ALLOWED}:\n    say('now')", {"limit"}),
        (f"if {NEAR_SIGN}:\n    return\nwhile {ALLOWED}:\n    yield autopilot()\nsay('now')", {"limit", "sign"}),
        ("x = 0\nwhile x < 5:\n    x = get_speed_limit()\nsay('now')", {"limit"}),
        (f"for _ in range(3):\n    if {ALLOWED}:\n        if {NEAR_SIGN}:\n            break\nsay('now')",
         {"limit", "sign"}),
        (f"for _ in range(3):\n    if {ALLOWED}:\n        if {NEAR_SIGN}:\n            break\n"
         f"    if {FAST}:\n        if {WIDE}:\n            break\nsay('now')", {"limit", "sign", "speed", "headway"}),
        (f"if {WIDE}:\n    return\nfor _ in range(3):\n    if {ALLOWED}:\n        if {NEAR_SIGN}:\n            break\n"
         "say('now')", {"headway", "limit", "sign"}),
        (f"while True:\n    if {ALLOWED}:\n        if {NEAR_SIGN}:\n            break\nsay('now')", {"limit", "sign"}),
    ],
)  # fmt: skip
def test_what_comes_later_depends_on_how_it_got_there(body: str, known: set[str]) -> None:
    assert depends(body) == known


def test_what_a_function_returns_depends_on_its_tests() -> None:
    either = f"def near():\n    if {ALLOWED}:\n        return detect_stop_sign_ahead()\n    else:\n        return 2\n\n"
    assert depends("say(near())", either) == {"limit", "sign"}


@pytest.mark.parametrize(
    ("body", "reached"),
    [
        ("try:\n    return\nfinally:\n    pass\nsay('there')", False),
        ("try:\n    pass\nfinally:\n    return\nsay('there')", False),
        ("try:\n    return\nexcept ValueError:\n    pass\nsay('there')", True),
        ("try:\n    pass\nfinally:\n    pass\nsay('there')", True),
    ],
)
def test_what_comes_after_an_attempt(body: str, reached: bool) -> None:
    assert bool(facts(body).events) is reached


def test_names_are_those_of_the_way_that_goes_on() -> None:
    (event,) = facts("v = 10\nif ego:\n    v = 20\nelse:\n    v = 30\n    return\nset_target_speed(v)").events
    assert [term.offset for term in event.terms] == [20.0]


@pytest.mark.parametrize("way", ["if ego:", "while ego:", "for _ in range(3):"])
def test_a_change_of_lanes_that_may_have_been_made_leaves_two_places(way: str) -> None:
    _, again, home = facts(f"{way}\n    {LEFT}\n{LEFT}\n{RIGHT}").events
    assert (again.back, home.back) == (False, True)


def test_members_of_what_is_no_row_are_not_known() -> None:
    (event,) = facts("for v in get_speed_limit():\n    set_target_speed(v)").events
    assert event.terms == frozenset()
