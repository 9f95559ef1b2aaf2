"""What earlier trips say about parameters: what a wish means, how fast, which lane and which spot."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept import Feedback, History, HistoryItem, Limits, Situation
from chauffeur.concept.nouns import Lead
from chauffeur.memory.feedback import interpret_feedback
from chauffeur.planners.talk2drive.habits import Pace, kind_of, meant_before, pace_of, speed_for
from chauffeur.planners.talk2drive.lanes import fitting_mps, mood_lane, passing_mps, unsaid_turn

BEHIND = Situation("highway", 24.0, 31.3, 2, 1, False, Lead(7, 45.0, 24.0), None)
FREE = Situation("highway", 30.0, 31.3, 2, 0, False, None, None)
LOT = Situation("parking", 3.0, 4.2, 1, 0, False, None, None)


def item(day: int, intent: str, said: str = "", speed: float = 27.0, *, similarity: float = -1.0) -> HistoryItem:
    feedback = (interpret_feedback(said),) if said else ()
    return HistoryItem(
        f"t{day}", f"2026-01-{day:02d}T08:00:00.000+00:00", "I'm late.", "", "highway", intent, "",
        json.dumps({"route": "stadium"}), (("target_speed_mps", speed), ("speed_limit_mps", 31.3)), feedback, "ended",
        similarity,
    )  # fmt: skip


def test_what_had_been_wanted_is_what_was_meant() -> None:
    told = item(3, "style.hurry", "I wanted you to overtake that car.")
    (meant,) = meant_before(History((told,)), "highway")
    assert (meant.kind, meant.corrected) == ("pass", True)
    assert "2026-01-03" in meant.because
    assert "I wanted you to overtake that car." in meant.because
    assert meant_before(History((told,)), "intersection") == ()


def test_what_was_done_and_not_blamed_was_meant() -> None:
    liked, silent = item(4, "overtake.left", "Perfect."), item(5, "lane.right")
    declined, faster = item(6, "ask"), item(7, "speed.increase", "A bit too fast.")
    kinds = [meant.kind for meant in meant_before(History((liked, silent, declined, faster)), "highway")]
    assert kinds == ["faster", "right", "pass"]


@pytest.mark.parametrize(
    ("said", "kind"),
    [
        ("I wanted you to overtake that car.", "pass"),
        ("Next time, stay behind it.", "stay"),
        ("I would have liked the right lane.", "right"),
        ("You could have gone, there was nobody.", "go"),
        ("You should have let the others go first.", "yield"),
        ("I wanted to be near the stadium.", "park.stadium"),
        ("I'd have preferred a spot by the exit.", "park.exit"),
        ("Why didn't you park?", "park.nearest"),
        ("I only wanted you to go slower, not to park.", "slower"),
    ],
)
def test_a_remark_can_say_what_had_been_wanted(said: str, kind: str) -> None:
    (meant,) = meant_before(History((item(3, "ask", said),)), "highway")
    assert (meant.kind, meant.corrected) == (kind, True)


def test_a_change_of_pace_that_went_the_wrong_way_is_turned_round() -> None:
    def kind(intent: str, said: str) -> str:
        return meant_before(History((item(3, intent, said),)), "highway")[0].kind

    assert kind("speed.decrease", "That was far too slow.") == "faster"
    assert kind("speed.increase", "Much too fast.") == "slower"
    assert kind("speed.decrease", "A bit too slow.") == "slower"  # the right way, but too far
    assert kind("speed.decrease", "Much too fast.") == "slower"


def test_kinds_of_what_was_done() -> None:
    assert kind_of("overtake.left+speed.increase") == "pass"
    assert kind_of("lane.keep") == "stay"
    assert kind_of("style.eco") == "calm"
    assert kind_of("park", "stadium") == "park.stadium"
    assert kind_of("park", "B7") == ""
    assert kind_of("turn.left") == ""
    assert kind_of("ask") == ""


def test_remarks_on_the_speed_add_up_from_trip_to_trip() -> None:
    first = item(1, "style.hurry", "A bit too fast.", 30.0)
    once = pace_of(History((first,)), "highway", "speed.increase", 30.0 / 31.3)
    assert once is not None
    assert once.share == pytest.approx(30.0 / 31.3 * (1.0 - 0.35 * 0.35**1.5))
    assert "A bit too fast" in once.because
    liked = item(2, "style.hurry", "That was good.", once.share * 31.3)
    kept = pace_of(History((first, liked)), "highway", "style.hurry", 30.0 / 31.3)
    assert kept is not None
    assert kept.share == pytest.approx(once.share)
    assert kept.because == ""
    again = item(2, "style.hurry", "A bit too fast.", once.share * 31.3)
    twice = pace_of(History((again, first)), "highway", "style.hurry", 30.0 / 31.3)
    assert twice is not None
    assert twice.share < once.share


def test_what_was_complained_about_bounds_a_choice_and_does_not_replace_it() -> None:
    history = History((item(1, "style.relax", "Far too slow.", 15.0),))
    fast_enough = pace_of(history, "highway", "style.relax", 0.9)
    assert fast_enough is None
    too_slow = pace_of(history, "highway", "style.relax", 0.5)
    assert too_slow is not None
    assert too_slow.share > 15.0 / 31.3 * 1.3


def test_haste_and_ease_bound_one_another_from_one_side() -> None:
    hasty = History((item(1, "style.hurry", "Too fast.", 25.0),))
    assert pace_of(hasty, "highway", "style.relax", 0.85) is not None
    assert pace_of(hasty, "highway", "style.relax", 0.5) is None
    slow_haste = History((item(1, "style.hurry", "Too slow.", 25.0),))
    assert pace_of(slow_haste, "highway", "style.relax", 0.5) is None
    assert pace_of(hasty, "highway", "ask", 0.9) is None
    assert pace_of(hasty, "highway", "speed.set_up", 0.9) is None  # a number that was said is kept to
    assert pace_of(hasty, "parking", "style.hurry", 0.9) is None


INTENTS = ("style.hurry", "style.relax", "speed.increase", "speed.decrease", "overtake", "follow", "lane.right")
REMARKS = (Feedback("", 1, 0, 0, -1, 0.6), Feedback("", -1, 0, 0, 0, 0.35), Feedback("", 0, 0, 0, 1), Feedback(""))
DISLIKES = (Feedback("", -1, 0, 0, -1, 0.6), Feedback("", 0, 0, 0, -1, 0.6), Feedback("", 0, -1, -1, -1, 1.0))


@given(
    before=st.lists(st.tuples(st.sampled_from(INTENTS), st.sampled_from(REMARKS), st.floats(8.0, 31.0)), max_size=3),
    disliked=st.tuples(st.sampled_from(INTENTS), st.sampled_from(DISLIKES), st.floats(8.0, 31.0)),
    intent=st.sampled_from(INTENTS),
    chosen=st.floats(0.3, 1.0),
)
def test_nothing_disliked_makes_a_later_drive_faster(
    before: list[tuple[str, Feedback, float]], disliked: tuple[str, Feedback, float], intent: str, chosen: float
) -> None:
    trips = [
        replace(item(day, of, speed=speed), feedback=(said,))
        for day, (of, said, speed) in enumerate([*before, disliked], start=1)
    ]
    without = pace_of(History(tuple(trips[:-1])), "highway", intent, chosen)
    found = pace_of(History(tuple(trips)), "highway", intent, chosen)
    assert found is None or found.share <= (chosen if without is None else without.share) + 1e-9


def test_faster_is_never_slower_than_now() -> None:
    pace = Pace(0.7, "")
    assert speed_for(pace, "speed.increase", 25.0, 31.3, 31.3) is None
    assert speed_for(pace, "speed.decrease", 25.0, 31.3, 31.3) == pytest.approx(21.91)
    assert speed_for(pace, "speed.decrease", 20.0, 31.3, 31.3) is None
    assert speed_for(Pace(3.0, ""), "style.hurry", 25.0, 31.3, 28.0) == 28.0
    assert speed_for(Pace(-2.0, ""), "style.relax", 25.0, 30.0, 30.0) == 9.0


def test_feedback_that_is_broken_moves_nothing() -> None:
    broken = HistoryItem(
        "t", "", "", "", "highway", "style.hurry", "", "{", (("target_speed_mps", 20.0),), (Feedback(""),)
    )
    assert pace_of(History((broken,)), "highway", "style.hurry", 0.9) is None
    assert [meant.kind for meant in meant_before(History((broken,)), "highway")] == ["hurry"]


def test_moods_choose_lanes_where_there_is_a_reason() -> None:
    assert mood_lane("style.hurry", BEHIND) == -1
    assert mood_lane("style.hurry", FREE) == 0
    assert mood_lane("style.relax", FREE) == 1
    assert mood_lane("style.relax", BEHIND) == 0
    assert mood_lane("speed.increase", BEHIND) == 0
    assert mood_lane("style.hurry", LOT) == 0
    assert passing_mps(BEHIND, 27.0) == 29.0
    assert passing_mps(BEHIND, 27.0, -10.0) == 27.0
    assert passing_mps(FREE, 27.0) == 27.0


def test_speeds_fit_the_place() -> None:
    calm = 0.8 * FREE.speed_limit_mps
    assert fitting_mps(19.0, "style.relax", BEHIND, Limits()) == pytest.approx(calm)  # goes on with who is ahead
    assert fitting_mps(19.0, "style.relax", FREE, Limits()) == pytest.approx(calm)
    assert fitting_mps(19.0, "style.relax", replace(FREE, speed_mps=20.0), Limits()) == 19.0
    assert fitting_mps(4.2, "speed.increase", LOT, Limits()) == pytest.approx(3.9)
    assert fitting_mps(1.0, "speed.decrease", LOT, Limits()) == pytest.approx(2.1)


def test_nobody_turns_to_a_side_that_was_not_said() -> None:
    assert unsaid_turn("My train won't wait.", "turn.right")
    assert not unsaid_turn("Turn Right here.", "turn.right")
    assert not unsaid_turn("Go straight on.", "turn.straight")
    assert not unsaid_turn("My train won't wait.", "style.hurry")
