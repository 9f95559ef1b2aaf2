"""The grammar of passengers: every section is rich, has its slots, and never says the opposite of its skill."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest

from chauffeur.concept import units
from chauffeur.concept.data import data_folder
from chauffeur.language import read_quantities
from chauffeur.language.grammar import Grammar
from chauffeur.models.onboard.examples import REASONS
from chauffeur.models.onboard.speech import Unit, spoken
from chauffeur.models.onboard.wordings import (
    DATA,
    FILES,
    MANNER,
    MOST_FORMS,
    because,
    beside,
    clause,
    conditioned,
    in_order,
    levels,
    utter,
    wordings,
)

SKILLS = {
    "v": "drive_at faster_by slower_by at_most at_least over_limit_by under_limit_by",
    "": (
        "faster a_bit_faster much_faster slower a_bit_slower much_slower drive_at_limit as_fast_as_allowed "
        "match_traffic hold_speed closer a_bit_closer much_closer further a_bit_further much_further hold_gap "
        "lane_left lane_right leftmost_lane rightmost_lane keep_lane lane_left_patiently lane_right_patiently "
        "overtake overtake_left overtake_right overtake_and_return overtake_left_and_return "
        "overtake_right_and_return turn_left turn_right go_straight pull_over stop_here follow let_in carry_on hurry "
        "change_lane middle_lane back_on_the_road no_overtaking drive_normally "
        "relax gently carefully sportily economically"
    ),
    "d": "gap_of closer_by further_by gap_at_least gap_at_most",
    "t": "gap_of_seconds",
    "k": "lanes_left lanes_right speed_times gap_times",
}
SLOT_OF = {skill: slot for slot, skills in SKILLS.items() for skill in skills.split()}
COMMON = (
    "drive_at", "faster_by", "slower_by", "faster", "slower", "gap_of", "closer_by", "further_by", "closer", "further",
    "lane_left", "lane_right", "overtake", "turn_left", "turn_right", "pull_over", "hurry", "relax", "gently",
    "carefully",
)  # fmt: skip
SLOTS = {
    "v": "45 mph",
    "d": "30 meters",
    "t": "3 seconds",
    "k": "two",
    "n": "40",
    "a": "slow down",
    "b": "go left",
    "c": "pull over",
    "if": "if it is free",
}


@cache
def plain_tables() -> Grammar:
    """The tables that name only what is wanted. Those after them are full of contrasts ("not the right one, the left"),
    which no pattern can read."""
    return Grammar(data_folder(DATA), FILES[: FILES.index("numbers")], MANNER)


NUMBERED = {
    "if.lead_slower_than": "v",
    "once.lead_slower_than": "v",
    **{f"{when}.lead_{how}_than": "d" for when in ("if", "once") for how in ("closer", "further")},
    "wait": "t",
    "ask.number": "n",
    "ask.more_number": "n",
    "ask.unit": "n",
    "ask.unit_gap": "n",
    "refuse.unsafe_speed": "v",
    "refuse.unsafe_gap": "d",
}
JOINING = {"conditioned", "conditioned.then", "steps", "steps3"}


def said(section: str, count: int, seed: int = 0, held: bool | None = None) -> Iterator[str]:
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield utter(section, SLOTS, rng, held).text


def plainly(section: str, count: int) -> Iterator[str]:
    rng = np.random.default_rng(0)
    templates = plain_tables().templates(section)
    for _ in range(count):
        yield plain_tables().say(templates[int(rng.integers(len(templates)))], SLOTS, rng).text


def test_every_skill_has_a_section() -> None:
    sections = wordings().sections()
    assert set(SLOT_OF) <= set(sections)
    for when in ("if", "once"):
        for what in ("lead_slower_than", "lead_closer_than", "lead_further_than", "clear_left", "clear_right"):
            assert f"{when}.{what}" in sections
    assert levels("faster") == ("faster", "faster/2")
    assert levels("hurry") == ("hurry", "hurry/2", "hurry/3")


def test_skills_have_enough_templates_and_imperatives_for_longer_sentences() -> None:
    for skill in SLOT_OF:
        assert len(wordings().templates(skill)) >= (40 if skill in COMMON else 20), skill
        for held in (False, True):
            assert any(not t.sentence and not t.part for t in wordings().templates(skill, held=held)), (skill, held)


def test_about_a_fifth_is_held_out() -> None:
    for section in wordings().sections():
        found = wordings().templates(section)
        held = wordings().templates(section, held=True)
        assert len(found) >= 6, section
        assert held and 0.1 <= len(held) / len(found) <= 0.45, section


def test_sections_have_exactly_their_slots() -> None:
    for section in wordings().sections():
        skill = section.partition("/")[0]
        if section in JOINING:
            continue
        expected = set(NUMBERED.get(section, SLOT_OF.get(skill, "") if "/" not in section else ""))
        for template in wordings().templates(section):
            assert wordings().slots(template) == expected, template.id


def test_sentences_are_proper() -> None:
    grammar = wordings()
    rng = np.random.default_rng(1)
    for section in grammar.sections():
        for template in grammar.templates(section):
            text = grammar.say(template, SLOTS, rng).text
            assert text.isascii(), text
            assert 0 < len(text) <= 260, text
            assert not any(mark in text.replace("->", "") for mark in "<>{}|()"), text
            assert "  " not in text, text
            assert not re.search(r"[,;]$|,,|, ,|(?<!\.)[,.;:?!][,.;:!](?<!\.\.)|\s[,.;?!]|,\S", text), (
                template.id,
                text,
            )
            if not template.part:
                assert not text[0].islower(), text


def test_common_skills_have_many_sentences() -> None:
    # n draws with repetitions from a population: 1000 draws of 20,000 equally likely sentences give 975 distinct
    # ones; sentences are not equally likely, so that fewer are enough
    distinct = {skill: len({text.lower() for text in said(skill, 1000, held=False)}) for skill in COMMON}
    assert min(distinct.values()) > 750, distinct


def test_nothing_held_out_is_said_in_training() -> None:
    rng = np.random.default_rng(2)
    for section in wordings().sections():
        train = {utter(section, SLOTS, rng, False).template for _ in range(30)}
        test = {utter(section, SLOTS, rng, True).template for _ in range(20)}
        assert not train & test


def test_asks_have_a_question_and_refusals_a_reason() -> None:
    for section in wordings().sections():
        assert bool(wordings().question(section)) == section.startswith("ask."), section
        assert bool(wordings().reason(section)) == section.startswith("refuse."), section
        assert not wordings().question(section) or wordings().question(section).endswith("?")


def sided() -> list[str]:
    """A complaint about the slow lane is a wish for the other one."""
    found = plain_tables().sections()
    return [s for s in found if re.search(r"left|right", s) and not s.endswith("most_lane/2")]


def test_sides_are_never_mixed_up() -> None:
    for section in sided():
        side, other = ("left", "right") if "left" in section else ("right", "left")
        fast = r"fast lane|passing lane|overtaking lane" if side == "left" else r"slow lane|slowest lane|crawler lane"
        for text in plainly(section, 300):
            low = text.lower()
            assert not re.search(rf"\b{other}(?:most)?\b", low), (section, text)
            assert re.search(rf"{side}|{fast}", low), (section, text)


def test_other_sections_name_no_side() -> None:
    other = ("ask", "refuse", "step", "cond", "go_straight", "correction")
    for section in plain_tables().sections():
        if section.startswith(other) or section in sided():
            continue
        for text in plainly(section, 60):
            low = text.lower()
            assert not re.search(r"\bleft\b(?! a gap)", low), (section, text)
            assert not re.search(r"\bright (?:lane|turn|side)\b|\b(?:to|on) the right\b", low), (section, text)


OPPOSITES = {
    "faster": r"slow down|\bslower\b|decelerat|less speed|ease off|reduce",
    "slower": r"speed up|\bfaster\b|accelerate\b|more speed|(?<!set the )increase",
    "closer": r"\bfurther\b|farther|drop back|fall back|more (?:room|space|distance)|widen|increase|back off",
    "further": r"\bcloser\b(?! than)|close up|less (?:room|space|distance)|narrow|shorten|reduce|decrease|tighten",
}


@pytest.mark.parametrize("kind", OPPOSITES)
def test_sections_never_say_the_opposite(kind: str) -> None:
    for section in plain_tables().sections():
        skill = section.partition("/")[0]
        if skill not in (kind, f"a_bit_{kind}", f"much_{kind}", f"{kind}_by") or "/" in section:
            continue
        for text in plainly(section, 500):
            assert not re.search(OPPOSITES[kind], text.lower()), (section, text)


@pytest.mark.parametrize("kind", ["faster", "slower", "closer", "further"])
def test_amounts_are_said(kind: str) -> None:
    """What is a bit does not say much, and the plain wish says no amount."""
    much = r"\b(?:way|a lot|lots|loads|considerably|massive\w*|huge|a great deal|far (?:more|less|faster|slower))\b"
    little = r"\b(?:a bit|a little|slightly|a touch|a tad|a smidge|a notch|a hair|a wee bit)\b"
    both = r"not just a (?:bit|little)|not a bit, not a little|loads of room|a long way to go"
    for section, never in ((f"a_bit_{kind}", much), (f"much_{kind}", little), (kind, f"{much}|{little}")):
        for text in plainly(section, 300):
            low = re.sub(both, "", text.lower())
            low = re.sub(r"(?:if|when|once) .{0,20}(?:way|lot)", "", low)
            assert not re.search(never, low), (section, text)


def test_hardly_any_words_mean_two_things() -> None:
    """Words of two sections would have two answers. (Whether a speed or a gap is safe, its value decides.)"""
    rng = np.random.default_rng(9)
    meaning: dict[str, str] = {}
    twice: set[str] = set()
    for section in wordings().sections():
        if section.startswith(("cond", "step", "manner", "refuse.unsafe")):
            continue
        skill = section.partition("/")[0]
        for template in wordings().templates(section):
            for _ in range(min(6, 2 * wordings().forms(template))):
                words = re.sub(r"[^a-z0-9' ]", "", wordings().clause(template, SLOTS, rng).text.lower())
                words = " ".join(re.sub(r"\b(?:please|thanks|mate|driver|buddy)\b", "", words).split())
                if words and meaning.setdefault(words, skill) != skill:
                    twice.add(words)
    assert len(twice) <= len(meaning) / 10_000, twice


def test_patience_is_said_where_it_is_meant_and_nowhere_else() -> None:
    waits = r"\bwhen\b|\bonce\b|\bas soon as\b|\bwait\b|\bwhenever\b|no rush|no hurry|patient|the moment|until|gap|room"
    for side in ("left", "right"):
        for text in plainly(f"lane_{side}", 600):
            assert not re.search(waits, text.lower().replace("until i say", "")), text


def test_a_clause_is_bare() -> None:
    rng = np.random.default_rng(4)
    for skill in SLOT_OF:
        for _ in range(20):
            text = clause(skill, SLOTS, rng).text
            assert text[0].islower() and text[-1] not in ".?!,", text


def test_conditions_and_steps_keep_their_order() -> None:
    rng = np.random.default_rng(5)
    for section in ("if.clear_left", "once.clear_left", "wait"):
        for _ in range(100):
            condition = clause(section, SLOTS, rng).text
            text = conditioned(condition, "take it", rng).text
            assert "take it" in text.lower(), text
            if condition.endswith("then"):
                assert text.lower().index("then") < text.lower().index("take it"), text
    for _ in range(100):
        for words in (["brake", "swerve", "honk"], ["brake", "swerve"]):
            text = in_order(words, rng).text.lower()
            if not re.search(r"\b(?:first|before|after|until|once)\b", text):  # "swerve, but first brake"
                assert sorted(words, key=text.index) == words, text


@pytest.mark.parametrize(
    ("unit", "si", "dimension"),
    [
        ("mps", 1.0, "speed"),
        ("mph", units.MPS_PER_MPH, "speed"),
        ("kmh", units.MPS_PER_KMH, "speed"),
        ("m", 1.0, "distance"),
        ("ft", units.M_PER_FOOT, "distance"),
        ("yd", units.M_PER_YARD, "distance"),
        ("car lengths", units.M_PER_CAR_LENGTH, "distance"),
        ("s", 1.0, "time"),
    ],
)
def test_quantities_are_read_as_they_were_meant(unit: Unit, si: float, dimension: str) -> None:
    rng = np.random.default_rng(6)
    for value in (0.5, 1, 1.5, 2, 2.5, 3, 7, 12, 13.4, 20, 21, 35, 45, 65, 99, 100, 101, 110, 115, 120, 250, 12.25):
        for _ in range(20):
            text = spoken(value, unit, rng)
            found = read_quantities(text)
            assert [(q.dimension, q.value) for q in found] == [(dimension, pytest.approx(value * si))], text


def test_what_can_be_said_in_more_ways_is_said_more_often_in_training() -> None:
    rng = np.random.default_rng(10)
    grammar = wordings()
    drawn = [utter("relax/3", {}, rng).template for _ in range(3000)]
    many, one = [], []
    for template in grammar.templates("relax/3", held=False):
        forms = grammar.forms(template)
        (many if forms >= MOST_FORMS else one if forms == 1 else []).append(drawn.count(template.id))
    assert 4.0 * np.mean(one) < np.mean(many) < 2.0 * MOST_FORMS * np.mean(one)


@pytest.mark.parametrize("wish", ["Slow down, please", "Could you go left?", "I want the left lane."])
def test_talk_and_reasons_stand_beside_a_wish_and_leave_it_whole(wish: str) -> None:
    rng = np.random.default_rng(11)
    core = wish.lower().rstrip(".")
    for text in (f(wish) for _ in range(60) for f in (lambda w: beside(w, rng), lambda w: because(w, "slower/2", rng))):
        assert core in text.lower(), text
        assert len(text) > len(wish) + 4, text
        assert not re.search(r"\{|,,|\?\.|\.\.|\s[,.?]", text), text
    assert beside(wish, np.random.default_rng(1)) == beside(wish, np.random.default_rng(1))


def test_reasons_are_complaints_or_moods_that_go_with_the_wish() -> None:
    for skill, sections in REASONS.items():
        assert skill in SLOT_OF
        for section in sections:
            assert section.partition("/")[2] in ("2", "3")
            assert not any(wordings().slots(t) for t in wordings().templates(section))
            if re.search(r"left|right", skill) and not section.startswith("hurry"):
                assert ("left" in skill) == ("left" in section), (skill, section)
    for skill, never in (("faster", "carefully"), ("slower", "hurry"), ("closer", "further"), ("further", "closer")):
        assert not any(section.startswith(never) for section in REASONS[skill])


def test_factors_and_counts() -> None:
    rng = np.random.default_rng(7)
    assert {spoken(2, "times", rng) for _ in range(300)} >= {"twice", "two times", "2 times"}
    assert {spoken(0.5, "times", rng) for _ in range(300)} >= {"half"}
    assert {spoken(2, "lanes", rng) for _ in range(100)} == {"two", "2"}
    assert {spoken(65, "", rng) for _ in range(100)} == {"65", "sixty-five", "sixty five"}


def test_the_same_draws_give_the_same_sentences() -> None:
    assert list(said("overtake", 50, seed=8)) == list(said("overtake", 50, seed=8))


def test_left_and_right_are_mirrors() -> None:
    """What can be said of one side can be said of the other, in the same words, but for a few idioms."""

    def forms(section: str) -> set[str]:
        return {wordings().text(template).lower() for template in wordings().templates(section)}

    def mirrored(text: str) -> str:
        swapped = {"left": "right", "right": "left", "fast": "slow", "slow": "fast"}
        return re.sub(r"left|right|(?:fast|slow)(?= lane| one)", lambda word: swapped[word[0]], text)

    for left in (section for section in wordings().sections() if "left" in section):
        ours = {mirrored(text) for text in forms(left)}
        theirs = forms(left.replace("left", "right"))
        assert len(ours & theirs) >= 0.6 * len(theirs), (left, sorted(theirs - ours)[:20])
