"""Remarks that no phrase is known of, and which of phrases and sorter is believed."""

from __future__ import annotations

import pytest

from chauffeur.memory.feedback import interpret_feedback
from chauffeur.memory.remarks import REMARK_KINDS, sort_remark


@pytest.mark.parametrize(
    ("said", "kind"),
    [
        ("Why didn't you get round that lorry?", "no_overtake"),
        ("There was no need to go past him.", "passed"),
        ("I'd have liked you to move over to the right.", "not_right"),
        ("We sat at that junction for an age.", "waited"),
        ("You could have let that lady go first.", "not_waited"),
        ("We never parked.", "not_parked"),
        ("I said the stadium, not this corner.", "wrong_spot.stadium"),
        ("My coffee ended up on the ceiling.", "harsh"),
        ("What time does the museum close?", "none"),
    ],
)
def test_a_remark_is_sorted(said: str, kind: str) -> None:
    found = sort_remark(said)
    assert found.kind == kind
    assert 0.3 < found.share <= 1.0


def test_every_kind_is_one_that_is_learned() -> None:
    assert len(set(REMARK_KINDS)) == len(REMARK_KINDS)
    assert sort_remark("").kind in REMARK_KINDS


@pytest.mark.parametrize(
    ("said", "speed", "gap", "comfort", "approval"),
    [
        ("My knuckles went white, we were flying.", -1, 0, 0, -1),
        ("I could have walked there sooner.", 1, 0, 0, -1),
        ("I could read his licence plate the whole way.", 0, -1, 0, -1),
        ("My coffee ended up on the ceiling.", 0, 0, -1, -1),
        ("Why didn't you get round that lorry?", 0, 0, 0, -1),
        ("Couldn't have done it better myself.", 0, 0, 0, 1),
        ("What time does the museum close?", 0, 0, 0, 0),
    ],
)
def test_words_that_no_phrase_knows_are_understood(
    said: str, speed: int, gap: int, comfort: int, approval: int
) -> None:
    found = interpret_feedback(said)
    assert (found.speed, found.gap, found.comfort, found.approval) == (speed, gap, comfort, approval)
    assert found.text == said
    assert (found.strength > 0.0) == (approval < 0)


@pytest.mark.parametrize(
    ("said", "speed", "approval"),
    [
        ("It was not too fast.", 0, 0),  # phrases know negations
        ("A bit slow, but I loved it.", 0, 1),  # and what comes last
        ("It was good, it was bad.", 0, 0),
        ("Slower next time.", -1, 0),
    ],
)
def test_what_phrases_know_stands(said: str, speed: int, approval: int) -> None:
    found = interpret_feedback(said)
    assert (found.speed, found.approval) == (speed, approval)
