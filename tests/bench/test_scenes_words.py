"""Instructions of generated scenes: the grammar, the readers that check it, and the choice over a whole suite."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chauffeur.bench.lampilot.scenes.kinds import KINDS, MAIN, PAPER_WORDS, Slot
from chauffeur.bench.lampilot.scenes.unambiguous import fault_of, fault_of_goal, words_of
from chauffeur.bench.lampilot.scenes.wish_sampler import EXITS
from chauffeur.bench.lampilot.scenes.wishes import Named, SceneWish
from chauffeur.bench.lampilot.scenes.wording import EXTRA_MAX_WORDS, grammar, in_words, spoken, word
from chauffeur.bench.lampilot.scenes.wording_choice import choose_wordings, form_of, normal
from chauffeur.concept import InstructionError
from chauffeur.language import read_quantities
from chauffeur.worlds.highway.dblv1 import load_dataset

Goal = dict[str, Any]


def _wish(kind: str, section: str, goal: Goal, **slots: str | Named) -> SceneWish:
    change = {"dec": -1, "inc": 1}.get(kind[:3], 0)
    return SceneWish((section,), goal, goal, kind, tuple(slots.items()), change=change, means=(goal,))


def _quantified(kind: str, count: int, value: int) -> SceneWish:
    """A wish of a distance or speed, to `value` or by it."""
    quantity, evaluator, slot, unit = (
        ("distance", "ACCEvalbyDistance", "d", "m") if "dis" in kind else ("speed", "ACCEvalbySpeed", "v", "m/s")
    )
    goal = {"type": evaluator, f"rel_{quantity}" if "_rel_" in kind else quantity: value}
    return _wish(kind, kind, goal, **{slot: Named(count, unit)})


def _sided(kind: str, section: str, evaluator: str) -> SceneWish:
    side = "left" if "left" in kind else "right"
    direction = list(EXITS[side]) if evaluator == "IntersectionEval" else side
    return _wish(kind, section, {"type": evaluator, "direction": direction}, side=side)


WISHES: dict[str, SceneWish] = {
    one.stem: one
    for one in (
        _quantified("dec_abs_dis", 21, 21),
        _quantified("inc_abs_dis", 64, 64),
        _quantified("dec_rel_dis", 13, -13),
        _quantified("inc_rel_dis", 16, 16),
        _quantified("dec_abs_speed", 12, 12),
        _quantified("inc_abs_speed", 34, 34),
        _quantified("dec_rel_speed", 7, -7),
        _quantified("inc_rel_speed", 4, 4),
        *(_sided(f"{side}_lc", "lane", "LaneChangeEval") for side in ("left", "right")),
        *(_sided(f"{side}_overtake", "overtake", "OvertakeEval") for side in ("left", "right")),
        _wish("pull_over", "pull_over", {"type": "PullOverEval"}),
        _wish("go_straight", "go_straight", {"type": "IntersectionEval", "direction": list(EXITS["straight"])}),
        *(_sided(f"turn_{side}", "turn", "IntersectionEval") for side in ("left", "right")),
    )
}
SIDES = {"side": "left", "way": "turn left", "n": "20"}
UNCHECKED = ("hint", "refuse", "ask")


def test_every_kind_of_the_original_has_a_wish_here() -> None:
    assert set(WISHES) == {kind.name for kind in MAIN}


@pytest.mark.parametrize("kind", WISHES)
def test_every_template_says_its_wish_now_and_then(kind: str) -> None:
    """A template that is never read back is dead weight: the learned reader leaves out one in eight at most."""
    wish, rng = WISHES[kind], np.random.default_rng(1)
    slots = dict(wish.slots)
    never: list[str] = []
    for template in grammar().templates(wish.sections[0]):
        for _ in range(60):
            said = {name: v if isinstance(v, str) else spoken(v, rng) for name, v in slots.items()}
            if not fault_of(grammar().say(template, said, rng).text, wish):
                break
        else:
            never.append(template.id)
    assert len(never) <= len(grammar().templates(wish.sections[0])) // 8, never


@pytest.mark.parametrize("kind", WISHES)
def test_the_test_split_has_phrasings_of_its_own(kind: str) -> None:
    section = WISHES[kind].sections[0]
    assert len(grammar().templates(section, held=True)) >= 7
    assert len(grammar().templates(section, held=False)) >= 15
    seen = word(WISHES[kind], KINDS[kind], Slot(0, kind, "train"), np.random.default_rng(2))
    unseen = word(WISHES[kind], KINDS[kind], Slot(0, kind, "test", held=True), np.random.default_rng(2))
    assert not {w.template for w in seen.wordings} & {w.template for w in unseen.wordings}


def test_sections_beyond_the_original_are_proper_sentences() -> None:
    rng = np.random.default_rng(3)
    slots = SIDES | {"d": "20 meters", "v": "20 meters per second"}
    for section in grammar().sections():
        for template in grammar().templates(section):
            for _ in range(5):
                text = grammar().say(template, slots, rng).text
                assert text.isascii(), text
                assert text[0].isupper() or text[0].isdigit(), text
                assert not any(mark in text for mark in "<>{}|()"), text
                assert "  " not in text, text
                if section.startswith(UNCHECKED):
                    assert 1 < words_of(text) <= EXTRA_MAX_WORDS, text


_FOUND_OTHERWISE = ("Stay within 21 meters of the car ahead.",)
"""What the learned reader finds another fault in."""


@pytest.mark.parametrize(
    ("text", "kind", "fault"),
    [
        ("Close the gap to 21 meters.", "dec_abs_dis", ""),
        ("Close the gap by 21 meters.", "dec_abs_dis", "absolute or relative"),
        ("Close the gap to 22 meters.", "dec_abs_dis", "number or unit"),
        ("Close the gap to 21 feet.", "dec_abs_dis", "number or unit"),
        ("Close the gap to 21 meters per second.", "dec_abs_dis", "number or unit"),
        ("Close the gap a bit.", "dec_abs_dis", "number or unit"),
        ("Close the gap from 40 to 21 meters.", "dec_abs_dis", "number or unit"),
        ("Stay within 21 meters of the car ahead.", "dec_abs_dis", "read as at_most absolute"),
        ("Close up by 13 meters.", "dec_rel_dis", ""),
        ("Close up to 13 meters.", "dec_rel_dis", "absolute or relative"),
        ("Drop back by 13 meters.", "dec_rel_dis", "says more where less is needed, or less for more"),
        ("Slow down to 12 meters per second.", "dec_abs_speed", ""),
        ("Close the gap and slow down to 12 m/s.", "dec_abs_speed", "more than one wish"),
        ("Take the left lane.", "left_lc", ""),
        ("Take the left lane.", "right_lc", "side"),
        ("Take the left lane at 20 m/s.", "left_lc", "a number too many"),
        ("Change lanes.", "left_lc", "side"),
        ("Overtake on the left.", "left_lc", "read as overtake.left"),
        ("Overtake the car ahead.", "left_overtake", "side"),
        ("Turn left at the junction.", "turn_left", ""),
        ("Turn left at the junction, or right.", "turn_left", "side"),
        ("Go left, then right, at the junction.", "turn_left", "side"),
        ("Pull over.", "pull_over", ""),
        ("Stop.", "pull_over", "length"),
    ],
)
def test_readers_find_what_is_wrong(text: str, kind: str, fault: str) -> None:
    found = fault_of(text, WISHES[kind])
    assert (found == "") == (fault == "") and (found == fault or text in _FOUND_OTHERWISE), found


def test_readers_find_next_to_nothing_wrong_with_lampilots_own_words(lampilot_data: Path) -> None:
    dataset = load_dataset(lampilot_data / "DbLv1-dev")
    pairs = {(item.command, str(item.scenario.goal)): item.scenario.goal for item in dataset.items()}
    wrong = {text: why for (text, _), goal in pairs.items() if (why := fault_of_goal(text, goal))}
    assert len(wrong) <= 0.08 * len(pairs), wrong


@pytest.mark.parametrize("unit", ["m", "ft", "yd", "car lengths", "m/s", "km/h", "mph"])
@pytest.mark.parametrize("count", [1, 2, 15, 21, 110])
def test_quantities_are_read_as_they_were_meant(unit: str, count: int) -> None:
    rng = np.random.default_rng(4)
    for _ in range(30):
        text = spoken(Named(count, unit), rng)
        assert [q.value for q in read_quantities(text)] == [pytest.approx(Named(count, unit).si)], text


@pytest.mark.parametrize(
    ("count", "said"),
    [(0, "zero"), (7, "seven"), (19, "nineteen"), (20, "twenty"), (42, "forty-two"), (99, "ninety-nine")],
)
def test_numbers_in_words(count: int, said: str) -> None:
    assert in_words(count) == said


def _row(index: int, kind: str) -> dict[str, Any]:
    found = word(WISHES[kind], KINDS[kind], Slot(index, kind, "train"), np.random.default_rng(index))
    wordings = [[w.text, w.template] for w in found.wordings]
    about = {"index": str(index), "kind": kind, "split": "train", "part": ""}
    return about | {"length": found.length, "wordings": wordings}


@pytest.fixture(scope="module")
def rows() -> list[dict[str, Any]]:
    """48 worded items, as many of each kind."""
    return [_row(i, list(WISHES)[i % len(WISHES)]) for i in range(48)]


def test_a_suite_has_the_papers_lengths_and_hardly_a_sentence_twice(rows: list[dict[str, Any]]) -> None:
    chosen = [one.text for one in choose_wordings(rows, 0, frozenset())]
    lengths = [words_of(text) for text in chosen]
    assert sum(lengths) / len(lengths) == pytest.approx(PAPER_WORDS[1], abs=0.05)
    assert min(lengths) >= PAPER_WORDS[0]
    assert max(lengths) <= PAPER_WORDS[2]
    assert Counter(form_of(text) for text in chosen).most_common(1)[0][1] == 1


def test_the_choice_is_the_same_again_and_another_with_another_seed(rows: list[dict[str, Any]]) -> None:
    first = choose_wordings(rows, 0, frozenset())
    assert first == choose_wordings(rows, 0, frozenset())
    assert first != choose_wordings(rows, 1, frozenset())


def test_no_sentence_of_lampilots_is_said_again(rows: list[dict[str, Any]], lampilot_data: Path) -> None:
    theirs = {normal(item.command) for item in load_dataset(lampilot_data / "DbLv1-dev").items()}
    assert not {normal(one.text) for one in choose_wordings(rows, 0, theirs)} & theirs


def test_sentences_to_avoid_are_not_chosen(rows: list[dict[str, Any]]) -> None:
    first = choose_wordings(rows, 0, frozenset())
    avoid = {normal(one.text) for one in first[:16]}
    assert not {normal(one.text) for one in choose_wordings(rows, 0, avoid)} & avoid
    everything = {normal(text) for text, _ in rows[0]["wordings"]}
    with pytest.raises(InstructionError, match="no wording"):
        choose_wordings(rows, 0, everything)


def test_what_cannot_be_worded_is_said() -> None:
    wish = replace(WISHES["left_lc"], means=({"type": "PullOverEval"},))
    with pytest.raises(InstructionError, match="left_lc"):
        word(wish, KINDS["left_lc"], Slot(0, "left_lc", "train"), np.random.default_rng(0))


def test_forms_mask_numbers_and_units() -> None:
    assert form_of("Close up by 13 meters.") == form_of("close up by twenty feet") == "close up by #"
    assert normal("Close up, by 13 meters!") == "close up by 13 meters"
