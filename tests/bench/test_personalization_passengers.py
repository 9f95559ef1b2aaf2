"""Simulated passengers: who they are, what they say, and when they take over."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from string import Formatter
from typing import Final, get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.bench.personalization import sayings
from chauffeur.bench.personalization.population import Passenger, draw_passengers
from chauffeur.bench.personalization.sayings import (
    LEVELS,
    Aim,
    Half,
    Level,
    Topic,
    feedback,
    feedback_of,
    sayings_sha256,
    wishes,
    wishes_of,
)
from chauffeur.bench.personalization.scenes import AIMS, TASKS
from chauffeur.bench.personalization.takeover import Mood, aim_of, judge, wanted_mps
from chauffeur.bench.personalization.traces import Trace
from chauffeur.concept import ConfigError, DataError
from chauffeur.concept.data import DATA_VARIABLE
from chauffeur.memory.feedback import interpret_feedback

ANA = Passenger(
    "p0001", usual_share=0.9, brisk_share=1.0, calm_share=0.8, lot_share=0.75, tolerance=0.1, headway_s=0.8,
    braking_mps2=4.0, accelerating_mps2=3.5, sideways_mps2=3.0, jerk_mps3=5.0, encroachment_s=1.5, patience_s=10.0,
    standing_s=5.0, walk_m=10.0, lane_habit="moves", talk="open", noise=0.02,
)  # fmt: skip
HALVES: Final[tuple[Half, ...]] = get_args(Half)
RELAXED = Mood("follow", "follow", "I")


def trace(speed: float = 24.0, seconds: float = 30.0, limit: float = 30.0, **changes: object) -> Trace:
    n = round(seconds / 0.1)
    away = np.full(n, np.inf)
    plain = Trace(
        dt_s=0.1, outcome="ended", limit_mps=limit, speed=np.full(n, speed), acceleration=np.zeros(n),
        sideways=np.zeros(n), turning=np.zeros(n), gap_m=away, lead_speed=away, somebody_m=away,
        lane=np.zeros(n, np.int64), passed=np.zeros(n, np.bool_), ttc_s=away, stop_m=away,
        crossing=np.zeros(n, np.bool_), across=np.zeros(n, np.bool_),
    )  # fmt: skip
    return replace(plain, **changes)  # type: ignore[arg-type]


def test_the_same_seed_gives_the_same_people_and_more_people_change_none() -> None:
    few, many = draw_passengers(5, 7), draw_passengers(40, 7)
    assert many[:5] == few
    assert draw_passengers(5, 8) != few
    assert len({one.usual_share for one in many}) > 30
    with pytest.raises(ConfigError):
        draw_passengers(0, 1)


def test_preferences_have_the_spread_that_the_sources_give() -> None:
    people = draw_passengers(400, 3)
    shares = np.array([one.usual_share for one in people])
    assert 0.89 < shares.mean() < 0.95
    assert 0.06 < shares.std() < 0.10
    assert all(0.6 * one.calm_share < one.calm_share < one.brisk_share for one in people)
    assert 0.8 < float(np.median([one.headway_s for one in people])) < 0.95
    assert {one.lane_habit for one in people} == {"moves", "stays"}


def plain(text: str) -> str:
    """Without case and punctuation."""
    return " ".join(re.findall(r"\w+", text.casefold()))


def test_every_aim_has_ten_wordings_at_every_level_and_more_where_figures_are_reported() -> None:
    wanted: list[tuple[Aim, Level]] = [(aim, level) for task in TASKS for aim in AIMS[task] for level in LEVELS]
    for half in HALVES:
        assert set(wishes()[half]) == set(wanted)
    assert [len(wishes_of(aim, level, "tuning")) for aim, level in wanted] == [10] * len(wanted)
    assert min(len(wishes_of(aim, level, "test")) for aim, level in wanted) >= 37


@pytest.mark.parametrize("line", ["wish\tfly/I\tUp.\ta", "wish\tgo/IV\tGo.\ta", "wish\tgo/I\tGo.", "say\tgo/I\tGo.\ta"])
def test_a_line_that_is_none_is_told_without_its_words(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "personalization").mkdir()
    (tmp_path / "personalization" / "test.tsv").write_text(f"wish\tgo/I\tGo on.\ta\n{line}\n")
    monkeypatch.setenv(DATA_VARIABLE, str(tmp_path))
    with pytest.raises(DataError, match=r"^Line 2 of test\.tsv is no sentence with its aim and writer\.$"):
        sayings._texts("test", "wish")


def test_no_sentence_is_said_twice_in_a_half_or_across_halves() -> None:
    where: dict[str, list[str]] = {}  # a failure names places: it is no occasion to read the test half
    for name, tables in (("wish", wishes()), ("feedback", feedback())):
        for half in HALVES:
            for key, texts in tables[half].items():
                for number, text in enumerate(texts):
                    where.setdefault(plain(text), []).append(f"{name} {half} {' '.join(key)} {number}")
    assert where.get("") is None
    assert [places for places in where.values() if len(places) > 1] == []


def test_feedback_of_both_halves_has_the_same_topics_forces_and_placeholders() -> None:
    assert set(feedback()["test"]) == set(feedback()["tuning"])
    assert {topic for topic, _ in feedback()["test"]} == set(get_args(Topic))
    for key, texts in feedback()["tuning"].items():
        others = feedback()["test"][key]
        assert len(others) >= len(texts)
        assert len({placeholders(text) for text in (*texts, *others)}) == 1
    for half in HALVES:
        assert {placeholders(text) for text in feedback()[half]["wrong_spot", "plain"]} == {("place",)}
        assert {placeholders(text) for text in feedback()[half]["parked", "plain"]} == {("pace",)}
        assert feedback_of("waited", "much", half) == feedback()[half]["waited", "plain"]


def placeholders(text: str) -> tuple[str, ...]:
    return tuple(field for _, field, _, _ in Formatter().parse(text) if field is not None)


@pytest.mark.parametrize("half", HALVES)
def test_the_hash_of_the_words_changes_with_either_half(half: Half, monkeypatch: pytest.MonkeyPatch) -> None:
    before = sayings_sha256()
    assert re.fullmatch("[0-9a-f]{64}", before)
    with monkeypatch.context() as changed:
        changed.setitem(wishes()[half], ("go", "I"), ("Something else.",))
        assert sayings_sha256() != before
    with monkeypatch.context() as changed:
        changed.setitem(feedback()[half], ("fine", "plain"), ("Something else.",))
        assert sayings_sha256() != before
    assert sayings_sha256() == before


def test_most_feedback_is_understood_by_the_memory_that_gets_it_and_none_the_wrong_way() -> None:
    # Of the tuning half alone: whoever mended the memory until the other passed would have looked at it.
    tuning = feedback()["tuning"].items()
    about_speed = [(topic, text) for (topic, _), texts in tuning for text in texts if topic.startswith("too_")]
    wanted = {"too_fast": -1, "too_slow": 1, "too_close": 0}
    heard = [(wanted[topic], interpret_feedback(text).speed, text) for topic, text in about_speed]
    assert not [text for meant, found, text in heard if meant * found < 0]
    assert sum(meant == found for meant, found, _ in heard) >= 0.9 * len(heard)


def test_a_drive_to_their_liking_is_left_alone() -> None:
    assert not judge(trace(), ANA, RELAXED).takes_over


@pytest.mark.parametrize(
    ("changed", "mood", "topic"),
    [
        (trace(29.0), RELAXED, "too_fast"),
        (trace(18.0), RELAXED, "too_slow"),
        (trace(lane=np.array([0] * 100 + [-1] * 200)), RELAXED, "passed"),
        (trace(gap_m=np.full(300, 15.0), lead_speed=np.full(300, 24.0)), RELAXED, "too_close"),
        (trace(acceleration=np.array([0.0] * 50 + [-6.0] * 15 + [0.0] * 235)), RELAXED, "harsh"),
        (trace(sideways=np.array([0.0] * 50 + [4.0] * 15 + [0.0] * 235)), RELAXED, "swerving"),
        (trace(outcome="collision"), RELAXED, "close_call"),
        (trace(30.0), Mood("overtake", "overtake", "I"), "no_overtake"),
        (trace(), Mood("right_lane", "right_lane", "II"), "not_right"),
        (trace(8.0, 20.0, 10.0, encroachment=((90, 0.9),)), Mood("yield", "yield", "I"), "close_call"),
        (trace(0.0, 20.0, 10.0), Mood("go", "go", "I"), "waited"),
        (trace(3.0, 30.0, 4.17), Mood("park", "park.stadium", "I"), "not_parked"),
        (
            trace(3.0, 30.0, 4.17, parked="B4", walk_m={"stadium": 40.0, "exit": 0.0, "nearest": 0.0}),
            Mood("park", "park.stadium", "I"),
            "wrong_spot",
        ),
        (trace(3.0, 30.0, 4.0, parked="B4"), Mood("pace", "pace.slower", "I"), "parked"),
    ],
)
def test_what_makes_them_take_over(changed: Trace, mood: Mood, topic: str) -> None:
    found = judge(changed, ANA, mood)
    assert found.takes_over
    assert found.topic == topic
    assert 0.0 <= found.at_s <= changed.seconds


def test_slow_is_forgiven_behind_somebody_slower_and_not_behind_somebody_faster() -> None:
    behind = trace(18.0, gap_m=np.full(300, 40.0), lead_speed=np.full(300, 18.5))
    assert not judge(behind, ANA, RELAXED).takes_over
    assert judge(replace(behind, lead_speed=np.full(300, 26.0)), ANA, RELAXED).topic == "too_slow"


def test_a_mere_hint_means_a_lane_to_some_and_a_pace_to_others() -> None:
    hint = Mood("overtake", "overtake", "III")
    held_up = trace(24.0, gap_m=np.full(300, 40.0), lead_speed=np.full(300, 24.0))
    assert judge(held_up, ANA, hint).topic == "no_overtake"
    assert not judge(held_up, replace(ANA, lane_habit="stays"), hint).takes_over


def test_how_far_off_decides_how_it_is_said() -> None:
    assert judge(trace(26.9), ANA, RELAXED).force == "bit"
    assert judge(trace(30.5), ANA, RELAXED).force == "much"
    assert judge(trace(26.0), ANA, RELAXED).topic == "too_fast"  # a remark, no takeover
    assert not judge(trace(26.0), ANA, RELAXED).takes_over


@given(speed=st.floats(5.0, 35.0), tolerance=st.floats(0.05, 0.2), wider=st.floats(1.0, 3.0))
def test_whoever_is_more_tolerant_never_takes_over_more(speed: float, tolerance: float, wider: float) -> None:
    strict, lax = replace(ANA, tolerance=tolerance), replace(ANA, tolerance=tolerance * wider)
    if judge(trace(speed), lax, RELAXED).takes_over:
        assert judge(trace(speed), strict, RELAXED).takes_over


def test_which_way_somebody_wants_the_pace_to_change_follows_from_what_they_like() -> None:
    wanted = wanted_mps(ANA, Mood("pace", "pace.faster", "I"), 4.0)
    assert wanted == pytest.approx(3.0)
    assert aim_of(ANA, "pace", 0, 2.0, 4.0) == "pace.faster"
    assert aim_of(ANA, "pace", 0, 3.5, 4.0) == "pace.slower"
    assert {aim_of(ANA, "park", choice, 3.0, 4.0) for choice in range(6)} == set(AIMS["park"])
