"""Nearness of wishes: same meaning near, opposite meaning far, same bits everywhere."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.memory import phrases, plain_text, similarity
from chauffeur.memory.similarity import DIMENSIONS, encode, likeness, mark, tags_of

_SAID = (
    "turn", "left", "right", "lane", "most", "straight", "go", "across", "through", "overtaking", "pass", "this", "get",
    "past", "by", "pull", "over", "stop", "parked", "halt", "can't", "cannot", "won't", "isnt", "don't", "i'm", "we're",
    "it's", "i'd", "gonna", "not", "too", "fast", "slowly", "closer", "hurry", "but", "more", "room", "so", "smooth",
    "\u2019s", "`", "\u3000", "\t", ",", ".",
)  # fmt: skip
SAID = st.lists(st.sampled_from(_SAID), max_size=10).flatmap(
    lambda parts: st.sampled_from((" ", "  ", "")).map(lambda between: between.join(parts))
)


def like(a: str, b: str) -> float:
    wish, other = mark(a), mark(b)
    return next(likeness(wish, np.stack([other.vector]) @ wish.vector, [other]))


@pytest.mark.parametrize(
    ("text", "tags"),
    [
        ("Can you drive faster?", {"speed+"}),
        ("You are driving a little bit slow now", {"speed+"}),
        ("I do not think we should drive this slow", {"speed+"}),
        ("I'm really in a hurry now", {"speed+"}),
        ("I am not in a hurry", {"speed-"}),
        ("Drive as fast as you can", {"speed+"}),
        ("Slow down please", {"speed-"}),
        ("Keep more distance", {"gap-"}),
        ("Get closer to the car ahead", {"gap+"}),
        ("I feel a bit motion-sick right now", {"comfort-"}),
        ("Change to the left lane", {"lane.left"}),
        ("Switch to the lane on your right", {"lane.right"}),
        ("Move to the rightmost lane", {"lane.right"}),
        ("Turn left", {"turn.left"}),
        ("Do not turn left", {"not.turn.left"}),
        ("Take a right turn at the junction", {"turn.right"}),
        ("Go straight ahead", {"turn.straight"}),
        ("Overtake this truck on the left", {"overtake"}),
        ("Pull over", {"stop"}),
        ("Do not overtake", {"not.overtake"}),
        ("What a lovely day", set()),
    ],
)
def test_tags(text: str, tags: set[str]) -> None:
    assert tags_of(text) == tags


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ("drive faster", "drive slower"),
        ("change to the left lane", "change to the right lane"),
        ("turn left", "do not turn left"),
        ("turn left", "turn right"),
        ("keep more distance", "keep less distance"),
        ("I am in a hurry", "I am not in a hurry"),
        ("overtake the truck", "do not overtake the truck"),
    ],
)
def test_opposite_wishes_do_not_match_and_equal_ones_do(a: str, b: str) -> None:
    assert like(a, b) < 0.15
    assert like(b, a) < 0.15
    assert like(a, a) == pytest.approx(1.0)


def test_the_same_meaning_in_other_words_is_near() -> None:
    assert like("Can you drive faster?", "I'm really in a hurry now") > 0.55
    assert like("Can you drive faster?", "Change to the left lane") < 0.2


def test_numbers_draw_wishes_together() -> None:
    near = like("keep a distance of 20 meters", "keep a distance of 21 meters")
    far = like("keep a distance of 20 meters", "keep a distance of 80 meters")
    assert near > far
    assert like("drive at 0 km/h", "drive at 0 km/h") == pytest.approx(1.0)


def test_the_code_of_a_text_never_changes() -> None:
    """Vectors are stored: other bits for the same text would need a new encoder version."""
    vector = encode("Drive faster, please")
    assert vector.shape == (DIMENSIONS,)
    assert np.flatnonzero(vector).tolist() == [72, 78, 111, 122, 125, 130, 135, 181, 186, 296, 297, 330, 350]
    assert np.linalg.norm(vector) == pytest.approx(1.0)


@given(st.text())
def test_any_text_can_be_encoded(text: str) -> None:
    vector = encode(text)
    assert np.isfinite(vector).all()
    assert np.array_equal(vector, encode(text))


@given(SAID)
def test_patterns_match_only_where_the_letters_are_by_which_they_are_chosen(text: str) -> None:
    for pattern, _, letters in similarity._MOVES:
        assert pattern.search(text) is None or any(one in text for one in letters)
    for letters, pattern, _ in plain_text._EVEN:
        assert pattern.search(text) is None or letters in text


@given(SAID)
def test_a_look_for_several_phrases_misses_none_of_them(text: str) -> None:
    assert tuple(one for _, chunk in phrases._CHUNKS for one in chunk) == phrases._PATTERNS
    for any_of_them, chunk in phrases._CHUNKS:
        assert (any_of_them.search(text) is not None) == any(one.search(text) is not None for one, *_ in chunk)
