"""Facts of programs to the letter: marks, spans, gaps that are steered towards, and where lanes lead."""

from __future__ import annotations

import pytest
from faithfulness_programs import facts

from chauffeur.safety.faithfulness import notes
from chauffeur.safety.faithfulness.facts import Event
from chauffeur.safety.faithfulness.values import Term

GAP = "front = detect_front_vehicle_in(get_lane_of(ego))\ngap = get_distance_between_vehicles(front, ego)\n"
PAST = "past = get_distance_between_vehicles(ego, detect_front_vehicle_in(get_lane_of(ego)))\n"
REAR = "rear = get_distance_between_vehicles(ego, detect_rear_vehicle_in(get_lane_of(ego)))\n"


def events(body: str, deed: str) -> list[Event]:
    return [event for event in facts(body).events if event.deed == deed]


def test_an_event_in_full() -> None:
    assert facts("set_target_speed(20)").events == (Event("speed", 3, frozenset({Term("", 0.0, 20.0)})),)
    assert facts("set_target_speed(20)").literals == frozenset({20.0})


def test_what_a_library_does_by_itself_stands_in_no_line() -> None:
    assert [event.line for event in facts("set_target_speed(30)", library="set_target_speed(20)\n").events] == [None, 3]


def test_how_much_is_read_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notes, "_MAX_EVENTS", 3)
    assert facts("say('one')\n" * 3).readable
    assert not facts("say('one')\n" * 4).readable
    monkeypatch.setattr(notes, "_MAX_STEPS", 100)
    assert facts("x = 1\n" * 40).readable
    assert not facts("x = 1\n" * 60).readable


# Gaps -----------------------------------------------------------------------------------------------------------------


def test_a_gap_may_be_steered_towards_a_share_of_itself_or_a_time_of_the_speed() -> None:
    (share,) = events(f"{GAP}say(gap - 0.8 * gap)", "gap")
    assert share.terms == frozenset({Term("gap", 0.8, 0.0)})
    (time,) = events(f"{GAP}say(gap - 2 * get_speed_of(ego))", "gap")
    assert time.terms == frozenset({Term("ego", 2.0, 0.0)})
    assert {"gap", "speed"} <= time.depends


def test_another_difference_leaves_the_gap_that_is_steered_towards() -> None:
    assert events(f"{GAP}wrong = gap - 25\nsay(get_speed_limit() - get_speed_of(front))", "gap")


# Marks and spans ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("body", "marks"),
    [
        ("say(get_speed_limit() < 20)", set()),
        ("say(get_speed_of(ego) + 5 < 20)", {("ego", 20.0, True)}),
        (f"{GAP}say(0.5 * gap - 5 < 10)", {("gap", 10.0, True), ("gap", 30.0, True), ("gap", 5.0, False)}),
        (f"{PAST}say(past - 5 < 25)", {("past", 25.0, True), ("past", 30.0, True), ("past", 5.0, False)}),
        (f"{REAR}say(rear - 5 < 25)", {("behind", 25.0, True), ("behind", 30.0, True), ("behind", 5.0, False)}),
    ],
)
def test_marks(body: str, marks: set[tuple[str, float, bool]]) -> None:
    assert {(mark.base, mark.value, mark.compared) for mark in facts(body).marks} == marks


def test_a_counter_has_few_values() -> None:
    assert facts("say((1 or 2 or 3) < 50)").spans_s == (5.0,)
    assert facts("say((1 or 2 or 3 or 4) < 50)").spans_s == ()


# Lanes ----------------------------------------------------------------------------------------------------------------

LEFT, RIGHT = "set_target_lane(get_left_lane(ego))\n", "set_target_lane(get_right_lane(ego))\n"
SEEN = "here, left, right = get_lane_of(ego), get_left_lane(ego), get_right_lane(ego)\n"
EITHER = "set_target_lane(get_left_lane(ego) or get_right_lane(ego))\n"


@pytest.mark.parametrize(
    ("body", "sides", "back"),
    [
        (f"{SEEN}{LEFT}set_target_lane(left)", {0}, False),
        (f"{SEEN}{LEFT}set_target_lane(right)", {1}, False),
        (f"{SEEN}{RIGHT}set_target_lane(left)", {-1}, False),
        (f"{SEEN}{RIGHT}set_target_lane(here)", {-1}, True),
        (f"{SEEN}{LEFT}set_target_lane(left or right)", {0, 1}, False),
        (f"{SEEN}{LEFT}set_target_lane(here or left)", {0, 1}, True),
        # After a change to either side, one more is a way back from one of them and onward from the other.
        (f"{EITHER}{LEFT}", {-1}, False),
        (f"{EITHER}{RIGHT}", {1}, False),
        (f"{SEEN}{LEFT}set_target_lane(left or right)\n{LEFT}", {-1}, False),
        (f"{SEEN}{LEFT}set_target_lane(left or right)\n{RIGHT}", {1}, False),
    ],
)
def test_where_a_lane_leads_that_was_seen_before(body: str, sides: set[int], back: bool) -> None:
    last = events(body, "lane")[-1]
    assert (last.sides, last.back) == (sides, back)


def test_a_lane_that_may_have_been_reached_already_leads_only_where_it_was_not() -> None:
    assert events(f"{SEEN}if ego:\n    {LEFT}set_target_lane(left)", "lane")[-1].sides == {-1}


def test_a_lane_of_which_nothing_is_known_may_be_asked_about() -> None:
    asked = "lane = {'a': ego}['a']\nif is_safe_enter(lane):\n    set_target_lane(lane)"
    assert events(asked, "lane")[0].checked
    assert not events(asked.replace("(lane):", "(get_left_lane(ego)):"), "lane")[0].checked
