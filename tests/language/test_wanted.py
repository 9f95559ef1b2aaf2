"""A wish taken apart by rules that see no plan: acts in order, conditions, places, and what is not to be done."""

from __future__ import annotations

import pytest

from chauffeur.language.wanted import MAX_CHARS, WantedPart, read_wanted


def acts(wish: str) -> list[str]:
    return [
        ("not " if part.denied else "") + " ".join(text for text in (part.act, part.side) if text)
        for part in read_wanted(wish)
        if part.kind == "act"
    ]


def others(wish: str) -> list[tuple[str, str]]:
    return [(part.kind, part.words) for part in read_wanted(wish) if part.kind != "act"]


@pytest.mark.parametrize(
    ("wish", "found"),
    [
        ("Turn left at the pub, then right", ["turn left", "turn right"]),
        ("Make a right and afterwards a left, please", ["turn right", "turn left"]),
        ("Could you get into the left lane and go faster?", ["lane left", "speed"]),
        ("Get past that tractor, then pull back in", ["overtake", "return"]),
        ("After you have overtaken the van, slow down", ["overtake", "speed"]),
        ("Bring us to the museum and wait outside", ["go_to", "wait"]),
        ("I'd like you to follow the car ahead", ["follow"]),
        ("Go left, no, right", ["turn right"]),
        ("Change lanes, then ring my brother", ["lane", "other"]),
    ],
)
def test_acts_are_read_in_the_order_they_are_said(wish: str, found: list[str]) -> None:
    assert acts(wish) == found


@pytest.mark.parametrize(
    ("wish", "found"),
    [
        ("Don't let that lorry cut in", ["not yield"]),
        ("Never overtake on the right", ["not overtake right"]),
        ("Please do not change lanes", ["not lane"]),
        ("Don't mind the noise, speed up", ["speed"]),
        ("Why don't you overtake him?", []),
        ("Don't brake or swerve", ["not speed"]),
    ],
)
def test_what_is_denied_is_no_wish_for_it(wish: str, found: list[str]) -> None:
    assert acts(wish) == found


@pytest.mark.parametrize(
    ("wish", "found"),
    [
        ("Speed up after the tunnel", [("condition", "after the tunnel")]),
        ("Slow down whenever you see children", [("condition", "whenever you see children")]),
        ("Pull over behind the petrol station", [("place", "behind the petrol station")]),
        ("Park close to the lift", [("place", "close to the lift")]),
        ("Park here but not under the trees", [("exclusion", "not under the trees")]),
        ("Drive home, but avoid the tunnel", [("exclusion", "avoid the tunnel")]),
        ("Turn left in 200 metres", [("condition", "in 200 metres")]),
        ("Overtake as soon as it is safe", []),
        ("Change lanes when you can, please", []),
        ("Turn right at the next junction", []),
        ("Stay behind the red car", []),
        ("Faster! I have a meeting at the bank", []),
        ("Slow down because the children are asleep", []),
        ("Go slower while I read", []),
    ],
)  # fmt: skip
def test_conditions_and_places_are_told_from_what_every_drive_sees_to(wish: str, found: list[tuple[str, str]]) -> None:
    assert others(wish) == found


def test_numbers_sides_and_counts_go_with_their_act() -> None:
    speed, gap = read_wanted("Drive at 90 km/h and keep 30 m distance")
    assert speed.amount is not None and speed.amount.value == pytest.approx(25.0)
    assert gap.amount is not None and gap.amount.value == 30.0
    (slower,) = read_wanted("Go 10 km/h slower")
    assert (slower.amount, slower.sign) == (None, -1), "a difference is no new speed"
    assert read_wanted("Take the second right")[0].nth == 2


def test_any_text_is_read_and_words_stay_as_said() -> None:
    for text in ("", "?", "a" * (2 * MAX_CHARS), "and and, but. or", "Ünïcode ☂ when it RAINS"):
        assert all(isinstance(part, WantedPart) for part in read_wanted(text))
    assert others("Stop when it RAINS") == [("condition", "when it RAINS")]
