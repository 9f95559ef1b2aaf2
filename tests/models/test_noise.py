"""Noise changes spellings and never what is meant."""

from __future__ import annotations

import re

import numpy as np
import pytest

from chauffeur.language import read_quantities
from chauffeur.models.onboard.noise import SAFE_SLIPS, noisy, protected, reworded, said_in_full
from chauffeur.models.onboard.wordings import utter, wordings

SLOTS = {
    "v": "sixty-five mph",
    "d": "2.5 car lengths",
    "t": "3 seconds",
    "k": "two",
    "n": "40",
    "a": "slow down to 30 km/h",
    "b": "turn left",
    "c": "pull over",
    "if": "if there's room on the right",
}
BACK = {slip.replace("´", "'"): word for word, slips in SAFE_SLIPS.items() for slip in slips}
SHORTENINGS = {"don't", "do", "not", "to", "of", "you", "is", "are", "a", "have", "in", "an", "so", "well", "it", "lot"}


def meant(text: str) -> list[str]:
    """Protected words in order, with safe slips undone."""
    words = [re.sub(r"^\W+|\W+$", "", w) for w in text.lower().replace("´", "'").split()]
    words = [BACK.get(w, w) for w in words]
    return [w for w in words if w and protected(w) and w not in SHORTENINGS]


def test_level_nought_changes_nothing() -> None:
    rng = np.random.default_rng(0)
    for section in ("faster", "gap_of"):
        text = utter(section, SLOTS, rng).text
        assert noisy(text, rng, 0) == text


@pytest.mark.parametrize("level", [1, 2])
def test_words_that_carry_the_meaning_stay(level: int) -> None:
    rng = np.random.default_rng(level)
    for section in wordings().sections():
        for _ in range(40):
            text = utter(section, SLOTS, rng, None).text
            noise = noisy(text, rng, level)
            assert noise.strip()
            assert meant(noise) == meant(text), (text, noise)


@pytest.mark.parametrize("level", [1, 2])
def test_numbers_stay(level: int) -> None:
    rng = np.random.default_rng(3)
    for section in ("drive_at", "faster_by", "gap_of", "further_by", "gap_of_seconds", "at_most"):
        for _ in range(150):
            text = utter(section, SLOTS, rng).text
            noise = noisy(text, rng, level)
            before = [q.value for q in read_quantities(text) if q.dimension in ("speed", "distance", "time")]
            after = [q.value for q in read_quantities(noise) if q.dimension in ("speed", "distance", "time")]
            assert before == after, (text, noise)


def test_noise_is_noisy_and_more_so_at_the_higher_level() -> None:
    rng = np.random.default_rng(4)
    text = "Would you please change to the left lane behind that truck, driver?"
    light = [noisy(text, rng, 1) for _ in range(400)]
    heavy = [noisy(text, rng, 2) for _ in range(400)]
    assert len(set(light)) > 100
    assert len(set(heavy)) > 300
    assert sum(t == text for t in heavy) <= sum(t == text for t in light)


@pytest.mark.parametrize("word", ["left", "Right,", "don't", "65mph", "twenty-five", "slower.", "further", "not", "if"])
def test_protected(word: str) -> None:
    assert protected(word)


@pytest.mark.parametrize("word", ["lane", "please", "brake", "gap", "overtake", "truck"])
def test_open(word: str) -> None:
    assert not protected(word)


UNCHANGED = re.compile(
    r"\b(?:left|right(?! now)|straight(?! away)|not|don't|never|no|neither|nothing|isn't|can't|won't|up to|"
    r"at least|at most|between|before|after|until|if(?! you)|unless|when|\d+(?:\.\d+)?|sixty-five|twice|two)\b",
    re.IGNORECASE,
)


def test_other_words_change_no_side_no_number_no_condition_and_no_denial() -> None:
    rng = np.random.default_rng(5)
    changed = 0
    for section in wordings().sections():
        for _ in range(25):
            text = utter(section, SLOTS | {"c": "stop"}, rng, None).text
            other = reworded(text, rng)
            changed += other != text
            assert UNCHANGED.findall(other) == UNCHANGED.findall(text), (text, other)
            before, after = (
                [(q.dimension, q.value) for q in read_quantities(said) if q.dimension != "bare"]
                for said in (text, other)
            )
            assert after == before, (text, other)
    assert changed > 500


UP = (
    r"faster|quick|speedier|speed up|rapidly|swifter|accelerate|(?:more|gain|up) speed|raise|increase|boost|lift|"
    r"step up|jack|heighten"
)
DOWN = r"slow|less|reduce|lose speed|decelerate|lower|slacken|decrease|cut|drop|diminish|curb|trim"


@pytest.mark.parametrize(
    ("text", "stays", "never"),
    [
        ("Could you go faster?", UP, DOWN),
        ("Please speed up.", UP, DOWN),
        ("Slow down, please.", DOWN, r"faster|quicker|accelerate|raise|gain"),
        ("I'd like to go slower", DOWN, r"faster|quicker|accelerate|raise|gain"),
        ("Increase the gap to the truck", r"increase|widen|extend|enlarge|stretch|lengthen|expand", r"reduce|narrow"),
        ("Reduce our distance.", r"reduce|decrease|shorten|shrink|tighten|narrow", r"increase|widen|lengthen"),
        ("Go much closer to him", r"closer|nearer", r"further|farther|back"),
        ("Stay further back.", r"further|farther|more distant", r"closer|nearer"),
    ],
)
def test_other_words_keep_the_direction(text: str, stays: str, never: str) -> None:
    rng = np.random.default_rng(6)
    said = {reworded(text, rng) for _ in range(200)}
    assert len(said) > 2
    for other in said:
        assert re.search(stays, other, re.IGNORECASE), other
        assert not re.search(never, other, re.IGNORECASE), other


def test_small_amounts_stay_small_and_great_ones_great() -> None:
    rng = np.random.default_rng(7)
    small = {reworded("a bit faster", rng) for _ in range(300)}
    great = {reworded("much faster", rng) for _ in range(300)}
    assert len(small) > 8 < len(great)
    assert not small & great
    assert not any(re.search(r"\b(?:much|way|far|lot|hugely|oceans)\b", text) for text in small)
    assert not any(re.search(r"\b(?:bit|tad|slightly|little|speck)\b", text) for text in great)
    assert reworded("not much faster", rng).startswith("not much")
    assert "car lengths" in reworded("two car lengths behind the car", np.random.default_rng(1))


def test_noise_repeats_with_the_seed() -> None:
    text = "Could you slow down a bit, please?"
    first = [noisy(text, np.random.default_rng(k), 2) for k in range(20)]
    assert first == [noisy(text, np.random.default_rng(k), 2) for k in range(20)]


@pytest.mark.parametrize(
    ("said", "full"),
    [
        ("I'm late, don't dawdle", "I am late, do not dawdle"),
        ("that's got to be faster", "that's got to be faster"),
        ("that's too fast, let's slow down", "that is too fast, let us slow down"),
        ("I'd like you to stop", "I would like you to stop"),
        ("can't you go faster", "can't you go faster"),
        ("we can't see past the truck", "we cannot see past the truck"),
    ],
)
def test_contractions_are_said_in_full_where_the_sentence_stays_english(said: str, full: str) -> None:
    assert said_in_full(said) == full
