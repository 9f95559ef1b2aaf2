"""What was said stands, what is unsure is asked about once, and a yes does it: the same in every planner of our own."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from parameters_asked import BEHIND, LEFT, LOT, SIGN, plan

from chauffeur.concept import (
    Context,
    History,
    HistoryItem,
    Instruction,
    Limits,
    PlanRequest,
    Situation,
    SystemMessage,
)
from chauffeur.memory.feedback import interpret_feedback
from chauffeur.planners.arbitration import PACES, slow_speed_words, within_mood
from chauffeur.planners.base import Planner
from chauffeur.planners.onboard.choose_speed import choose_style
from chauffeur.planners.onboard.doubts import ENGLISH_ONLY
from chauffeur.planners.onboard.meaning import Meaning
from chauffeur.planners.onboard.options import Chosen, Options
from chauffeur.planners.onboard.personal import Leaning
from chauffeur.planners.registry import make_planner

_PLANNERS = ("onboard", "talk2drive")


@pytest.fixture(scope="module")
def planners() -> dict[str, Planner]:
    return {name: make_planner(name) for name in _PLANNERS}


def _target(planner: Planner, wish: str, situation: Situation, confirmed: str = "") -> float | None:
    found = plan(planner, wish, situation, confirmed=confirmed)
    return None if found.policy is None else dict(found.settings).get("target_speed_mps")


@pytest.mark.parametrize("name", _PLANNERS)
@pytest.mark.parametrize(
    ("wish", "question", "speed_mps"),
    [
        ("Drive at l00 km/h.", "Did you mean 100 km/h?", 100 / 3.6),
        ("Drive at 1 00 km/h.", "Did you mean 100 km/h?", 100 / 3.6),
        ("Drive at 6O mph.", "Did you mean 60 mph?", 26.82),
        ("Drive at 25 mm/s.", "Did you mean 25 m/s?", 25.0),
    ],
)
def test_a_slip_in_a_number_is_asked_about_and_a_yes_drives_it(
    planners: dict[str, Planner], name: str, wish: str, question: str, speed_mps: float
) -> None:
    found = plan(planners[name], wish, LEFT)
    assert (found.policy, found.refusal) == (None, question)
    again = plan(planners[name], found.offer, LEFT, confirmed=found.refusal)
    again = plan(planners[name], again.offer, LEFT, confirmed=again.refusal) if again.offer else again
    assert dict(again.settings).get("target_speed_mps") == pytest.approx(speed_mps, abs=0.01)


@pytest.mark.parametrize("name", _PLANNERS)
@pytest.mark.parametrize("wish", ["Drive at 20 km/h.", "Drive at 4 m/s.", "Slow down to 10 mph."])
def test_a_crawl_among_faster_traffic_is_driven_only_after_a_yes(
    planners: dict[str, Planner], name: str, wish: str
) -> None:
    found = plan(planners[name], wish, LEFT)
    assert found.policy is None
    assert "less than half the speed of the traffic" in found.refusal
    assert plan(planners[name], found.offer, LEFT, confirmed=found.refusal).policy is not None


def test_a_yes_answers_the_question_that_was_asked_and_no_other(planners: dict[str, Planner]) -> None:
    found = plan(planners["onboard"], "Drive at 20 km/h.", LEFT)
    assert plan(planners["onboard"], "Drive at 10 km/h.", LEFT, confirmed=found.refusal).policy is None
    assert plan(planners["onboard"], found.offer, LEFT, confirmed="Did you mean 100 km/h?").policy is None


@pytest.mark.parametrize("name", _PLANNERS)
@pytest.mark.parametrize("wish", ["Pouvez-vous doubler ce camion ?", "请开慢一点。"])
def test_another_language_is_not_guessed_at(planners: dict[str, Planner], name: str, wish: str) -> None:
    found = plan(planners[name], wish, LEFT)
    assert found.policy is None
    assert found.refusal == ENGLISH_ONLY


def test_where_nobody_can_answer_the_best_reading_is_driven(planners: dict[str, Planner]) -> None:
    for name in ("onboard", "talk2drive"):
        asked = PlanRequest(Instruction("Drive at 20 km/h.", source="benchmark"), Context("", LEFT), SystemMessage(""))
        assert asyncio.run(planners[name].plan(asked)).policy is not None


_SPEEDS = st.floats(0.0, 45.0)


@given(_SPEEDS, _SPEEDS, st.floats(-8.0, 8.0), st.sampled_from(sorted(PACES)))
def test_a_mood_counts_from_the_present_speed(now: float, sign: float, leaning: float, mood: str) -> None:
    situation = replace(LEFT, speed_mps=now, speed_limit_mps=max(2.0, sign))
    options = Options(situation, Limits(), Leaning(speed_mps=leaning))
    chosen = choose_style(Meaning("style", variant=mood), options)
    assert isinstance(chosen, Chosen)
    target = dict(chosen.settings)["target_speed_mps"]
    if PACES[mood] < 0:
        assert target <= now + 0.006
    else:
        assert target >= min(now, options.cap_mps) - 0.006


@pytest.mark.parametrize(("wish", "pace"), [("I'm in a hurry.", 1), ("Drive calmly, please.", -1), ("Relax.", -1)])
def test_no_mood_turns_the_pace_round_whatever_the_person_liked_before(
    planners: dict[str, Planner], wish: str, pace: int
) -> None:
    liked = tuple(
        HistoryItem(
            trip_id=f"t{day}",
            when=f"2026-01-0{day}T08:00:00Z",
            instruction=wish,
            context="",
            world="highway",
            intent="style.hurry" if pace > 0 else "style.relax",
            thoughts="",
            policy="",
            settings=(("target_speed_mps", 0.6 * SIGN if pace > 0 else 0.99 * SIGN), ("sign_mps", SIGN)),
            feedback=(interpret_feedback("too fast" if pace > 0 else "too slow"),),
            similarity=1.0,
        )
        for day in (1, 2, 3)
    )
    now = replace(BEHIND, speed_mps=0.7 * SIGN)
    for name in ("onboard", "talk2drive"):
        found = plan(planners[name], wish, now, history=History(liked))
        if found.policy is not None:
            target = dict(found.settings)["target_speed_mps"]
            assert (target - now.speed_mps) * pace >= -0.01, (name, target)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=25)
@given(st.integers(40, 120), st.sampled_from(("l", "O", " ", "'", "km", ".000")), st.integers(1, 2))
def test_no_perturbed_speed_is_driven_as_another(planners: dict[str, Planner], number: int, slip: str, at: int) -> None:
    text = str(number)
    wish = f"Drive at {text[:at]}{slip}{text[at:]} km/h."
    for planner in planners.values():
        target = _target(planner, wish, LEFT)
        assert target is None or target == pytest.approx(number / 3.6, abs=0.01), wish


def test_a_slow_speed_is_slow_against_traffic_only() -> None:
    assert slow_speed_words(10.0, LEFT, Limits())
    assert not slow_speed_words(20.0, LEFT, Limits())
    jam = replace(BEHIND, speed_mps=6.0, front=None)
    assert not slow_speed_words(2.0, jam, Limits())
    assert slow_speed_words(0.0, jam, Limits())
    assert not slow_speed_words(0.0, LOT, Limits())
    assert not slow_speed_words(8.0, LEFT, Limits(max_speed_mps=10.0))


@given(_SPEEDS, _SPEEDS, _SPEEDS)
def test_within_a_mood(speed: float, now: float, most: float) -> None:
    assert within_mood(speed, -1, now, most) <= now
    assert within_mood(speed, 1, now, most) >= min(now, most)
    assert within_mood(speed, 0, now, most) == speed


@pytest.mark.parametrize("name", _PLANNERS)
def test_who_is_late_on_a_bad_road_is_driven_no_faster(planners: dict[str, Planner], name: str) -> None:
    now = BEHIND.speed_mps
    assert (_target(planners[name], "I'm late.", BEHIND) or 0.0) > now
    slippery = _target(planners[name], "I'm late, but it is slippery.", BEHIND)  # None where it is asked about first
    assert slippery is None or slippery == pytest.approx(now, abs=0.01)
    # A denial that the parser reads as no hurry is asked about; it never makes the drive slower or faster unasked.
    dry = _target(planners[name], "I'm late, and it is not slippery.", BEHIND)
    assert dry is None or dry > now
