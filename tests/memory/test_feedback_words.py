"""What passengers say, and what it means."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.memory import interpret_feedback

# words -> speed, gap, comfort, approval, strength
SAID: list[tuple[str, int, int, int, int, float]] = [
    # Speed.
    ("too fast", -1, 0, 0, -1, 0.6),
    ("a bit too fast", -1, 0, 0, 0, 0.35),
    ("slightly too quick for my taste", -1, 0, 0, 0, 0.35),
    ("way too fast!", -1, 0, 0, -1, 1.0),
    ("That was much too slow.", 1, 0, 0, -1, 1.0),
    ("too slow for me", 1, 0, 0, -1, 0.6),
    ("far too slow", 1, 0, 0, -1, 1.0),
    ("We were crawling", 1, 0, 0, -1, 0.6),
    ("not fast enough", 1, 0, 0, -1, 0.6),
    ("you didn't slow down", -1, 0, 0, -1, 0.6),
    ("you did not speed up", 1, 0, 0, -1, 0.6),
    ("faster than I like", -1, 0, 0, -1, 0.6),
    ("that was really fast", -1, 0, 0, -1, 1.0),
    ("a little slow", 1, 0, 0, 0, 0.35),
    ("could be quicker", 1, 0, 0, 0, 0.6),
    ("should have been slower", -1, 0, 0, 0, 0.6),
    ("slow down a bit next time", -1, 0, 0, 0, 0.35),
    ("speed up a lot", 1, 0, 0, 0, 1.0),
    ("drive 10 km/h slower", -1, 0, 0, 0, 0.505),
    ("drive 20 km/h faster", 1, 0, 0, 0, 1.0),
    ("one km/h slower", -1, 0, 0, 0, 0.1),
    # Negation.
    ("not too fast", 0, 0, 0, 0, 0.0),
    ("it wasn’t too fast", 0, 0, 0, 0, 0.0),
    ("I don't think it was too fast", 0, 0, 0, 0, 0.0),
    ("it was not that fast", 0, 0, 0, 0, 0.0),
    ("do not drive too fast", -1, 0, 0, 0, 0.6),
    ("you should not drive too fast", -1, 0, 0, 0, 0.6),
    ("not too fast please", -1, 0, 0, 0, 0.6),
    ("don't drive so fast", -1, 0, 0, 0, 0.6),
    ("Not so close!", 0, -1, 0, 0, 0.6),
    ("never go faster", -1, 0, 0, 0, 0.6),
    ("do not slow down", 1, 0, 0, 0, 0.6),
    ("why not go faster", 1, 0, 0, 0, 0.6),
    ("no rush", -1, 0, 0, 0, 0.6),
    ("I am not in a hurry", -1, 0, 0, 0, 0.6),
    ("I'm really in a hurry now", 1, 0, 0, 0, 1.0),
    ("not too fast but too close", 0, -1, 0, -1, 0.6),
    # Gap.
    ("way too close", 0, -1, 0, -1, 1.0),
    ("you were tailgating", 0, -1, 0, -1, 0.6),
    ("not enough room", 0, -1, 0, -1, 0.6),
    ("the gap was too small", 0, -1, 0, -1, 0.6),
    ("the gap was a bit too big", 0, 1, 0, 0, 0.35),
    ("too much distance", 0, 1, 0, -1, 0.6),
    ("too far behind the truck", 0, 1, 0, -1, 0.6),
    ("next time leave more room", 0, -1, 0, 0, 0.6),
    ("please keep your distance", 0, -1, 0, 0, 0.6),
    ("I would have liked a bit more space", 0, -1, 0, 0, 0.35),
    ("increase the following distance by 10 m", 0, -1, 0, 0, 0.5),
    ("closer next time", 0, 1, 0, 0, 0.6),
    ("reduce the gap", 0, 1, 0, 0, 0.6),
    ("leave half a second more headway", 0, -1, 0, 0, 1 / 3),
    # Comfort.
    ("I felt sick", 0, 0, -1, -1, 0.6),
    ("you braked too hard", 0, 0, -1, -1, 0.6),
    ("a little uncomfortable", 0, 0, -1, 0, 0.35),
    ("I did not feel safe", 0, 0, -1, -1, 0.6),
    ("smoother please", 0, 0, -1, 0, 0.6),
    ("be less aggressive", 0, 0, -1, 0, 0.6),
    ("too timid", 0, 0, 1, -1, 0.6),
    ("like my grandma", 0, 0, 1, -1, 0.6),
    ("drive more assertively", 0, 0, 1, 0, 0.6),
    # Approval.
    ("perfect", 0, 0, 0, 1, 0.0),
    ("loved it", 0, 0, 0, 1, 0.0),
    ("nice and smooth", 0, 0, 0, 1, 0.0),
    ("couldn't be better", 0, 0, 0, 1, 0.0),
    ("not bad", 0, 0, 0, 1, 0.0),
    ("really fast, I loved it", 0, 0, 0, 1, 0.0),
    ("It was slower this time, great", 0, 0, 0, 1, 0.0),
    ("not good", 0, 0, 0, -1, 0.6),
    ("hated it", 0, 0, 0, -1, 0.6),
    ("I don't like this", 0, 0, 0, -1, 0.6),
    ("great but too fast", -1, 0, 0, 0, 0.6),
    ("it was good, it was bad", 0, 0, 0, 0, 0.0),
    ("slower would be nice", -1, 0, 0, 0, 0.6),
    # "X, but Y": what comes after the turn decides.
    ("Okay, but a touch slow.", 1, 0, 0, 0, 0.35),
    ("Okay, but a touch fast.", -1, 0, 0, 0, 0.35),
    ("Fine, but a bit slow.", 1, 0, 0, 0, 0.35),
    ("I liked it, but you were slow", 1, 0, 0, 0, 0.6),
    ("Comfortable, but slow for my taste", 1, 0, 0, 0, 0.6),
    ("good, though slightly hasty", -1, 0, 0, 0, 0.35),
    ("It was great. A bit slow, though.", 1, 0, 0, 0, 0.35),
    ("Perfect! But you were close to the truck.", 0, -1, 0, 0, 0.6),
    ("Perfect, but a little jerky", 0, 0, -1, 0, 0.35),
    ("Great, but a bit slow. I loved the lane change.", 1, 0, 0, 0, 0.35),
    ("A bit slow, but I liked it.", 0, 0, 0, 1, 0.0),
    ("A touch fast, but okay.", 0, 0, 0, 1, 0.0),
    ("It was slow, but I enjoyed it.", 0, 0, 0, 1, 0.0),
    ("Even though it was a bit slow, it was great", 0, 0, 0, 1, 0.0),
    ("Good, but a bit fast, but I loved it", 0, 0, 0, 1, 0.0),
    ("Nice, but not too slow", 0, 0, 0, 1, 0.0),
    ("Bad at first, but then it was great", 0, 0, 0, 1, 0.0),
    ("It was great, but I hated the braking", 0, 0, 0, -1, 0.6),
    ("I hated it, but the speed was fine", 0, 0, 0, 0, 0.0),
    ("A bit slow, but otherwise great", 1, 0, 0, 0, 0.35),
    ("You drive well, but I want you to go slower, like really slow", -1, 0, 0, 0, 0.6),
    ("Fine, but the car ahead is slow", 0, 0, 0, 1, 0.0),
    # Several topics, contradictions, nothing.
    ("way too fast and too close", -1, -1, 0, -1, 1.0),
    ("too fast at first, then too slow", 0, 0, 0, 0, 0.0),
    ("", 0, 0, 0, 0, 0.0),
    ("hello there", 0, 0, 0, 0, 0.0),
    ("no complaints", 0, 0, 0, 1, 0.0),
]


@pytest.mark.parametrize(("text", "speed", "gap", "comfort", "approval", "strength"), SAID)
def test_what_is_meant(text: str, speed: int, gap: int, comfort: int, approval: int, strength: float) -> None:
    feedback = interpret_feedback(text)
    assert (feedback.speed, feedback.gap, feedback.comfort, feedback.approval) == (speed, gap, comfort, approval)
    assert feedback.strength == pytest.approx(strength, abs=1e-3)
    assert feedback.text == text


@given(st.text())
def test_any_words_at_all_are_read(text: str) -> None:
    feedback = interpret_feedback(text)
    assert feedback.text == text
    assert 0.0 <= feedback.strength <= 1.0


@pytest.mark.parametrize("text", ["not " * 5000, "too " * 5000, "a bit " * 5000, "x" * 50_000, "lane to the " * 3000])
def test_long_words_take_no_long_time(text: str) -> None:
    interpret_feedback(text)
