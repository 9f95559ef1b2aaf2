"""What hints, complaints and moods are taken for, and what they must not be taken for."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import pytest
from parameters_asked import BEHIND, LEFT, LOT, SIGN, plan

from chauffeur.concept import (
    History,
    HistoryItem,
    Limits,
    Parameters,
    Situation,
)
from chauffeur.memory.feedback import interpret_feedback
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.planners.talk2drive import hints
from chauffeur.planners.talk2drive.hints import HINT_KINDS, hint_of
from chauffeur.planners.talk2drive.lanes import eased_mps, fitting_mps

RIGHT = replace(LEFT, lane_index=2)
CROSSING = Situation("intersection", 10.0, 10.0, 1, 0, False, None, None)


@pytest.fixture(scope="module")
def planner() -> Planner:
    return make_planner("talk2drive")


class Told:
    """A sorter that is sure of what it was told."""

    def __init__(self, **shares: float) -> None:
        self.told = shares

    def shares(self, text: str, among: Collection[str]) -> Mapping[str, float]:
        assert text
        return {kind: self.told.get(kind, 0.0) for kind in sorted(among, key=lambda one: -self.told.get(one, 0.0))}


@pytest.mark.parametrize(
    ("situation", "shares", "kind", "share"),
    [
        (BEHIND, {"stay": 0.36, "pass": 0.3, "hurry": 0.2, "faster": 0.1, "none": 0.04}, "pass", 0.6),
        (BEHIND, {"none": 0.28, "stay": 0.32, "calm": 0.2, "right": 0.2}, "stay", 0.72),
        (BEHIND, {"none": 0.4, "stay": 0.3, "calm": 0.2, "pass": 0.1}, "none", 0.4),
        (LEFT, {"faster": 0.4, "right": 0.35, "slower": 0.25}, "right", 0.6),
        (CROSSING, {"yield": 0.4, "go": 0.3, "hurry": 0.3}, "go", 0.6),
        (LOT, {"park.exit": 0.4, "faster": 0.35, "slower": 0.25}, "park.exit", 0.4),
    ],
)
def test_what_speaks_for_the_same_counts_together(
    situation: Situation, shares: dict[str, float], kind: str, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hints, "load_sorter", lambda _: Told(**shares))
    found = hint_of("Hm.", situation, History())
    assert found is not None
    assert (found.kind, found.share) == (kind, pytest.approx(share))


def test_nothing_is_meant_that_cannot_be_done_here() -> None:
    for wish in ("That van in front is crawling.", "The right lane is wide open.", "Stay behind him."):
        found = hint_of(wish, RIGHT, History())
        assert found is not None
        assert found.kind not in ("pass", "stay", "right")
    assert hint_of("Faster.", replace(RIGHT, world="town"), History()) is None
    assert all("none" in kinds and "else" in kinds for kinds in HINT_KINDS.values())


def trip(day: int, intent: str, wish: str = "Well, well.", remark: str = "", similarity: float = -1.0) -> HistoryItem:
    feedback = (interpret_feedback(remark),) if remark else ()
    when = f"2026-01-{day:02d}T08:00:00.000+00:00"
    return HistoryItem(f"t{day}", when, wish, "", "highway", intent, "", "{}", (), feedback, "ended", similarity)


def test_what_somebody_meant_before_decides_what_is_unclear() -> None:
    wish = "Oh, look at that."
    alone = hint_of(wish, BEHIND, History())
    assert alone is not None
    told = [trip(day, "follow", remark="You should have overtaken that slow car.") for day in (1, 2, 3)]
    known = hint_of(wish, BEHIND, History(tuple(told)))
    assert known is not None
    assert known.kind == "pass"
    assert known.share > alone.share or alone.kind != "pass"
    assert "2026-01-03" in known.because
    assert "You should have overtaken" in known.because


def test_who_parked_is_likelier_to_park_but_not_at_the_same_place() -> None:
    parked = [replace(trip(day, "park"), world="parking", policy='{"route": "exit"}', feedback=()) for day in (1, 2, 3)]
    for wish in ("Oh, look at that.", "I twisted my ankle.", "My ticket is somewhere in this bag."):
        alone, known = (hint_of(wish, LOT, History(tuple(trips))) for trips in ([], parked))
        assert alone is not None
        assert known is not None
        assert known.kind.startswith("park.")
        if alone.kind.startswith("park."):
            assert (known.kind, known.share > alone.share) == (alone.kind, True)


def test_no_habit_outweighs_plain_words() -> None:
    told = History(tuple(trip(day, "follow", remark="You should have overtaken that car.") for day in (1, 2, 3, 4)))
    for wish, kind in (
        ("Stay behind the car ahead.", "stay"),
        ("Please do not overtake anybody.", "stay"),
        ("Could you play some music?", "none"),
    ):
        found = hint_of(wish, BEHIND, told)
        assert found is not None
        assert found.kind == kind


def test_the_same_words_mean_what_they_were_told_to_mean() -> None:
    wish = "Oh, look at that."
    told = trip(3, "ask", wish, "I wanted you to change to the right lane.", similarity=0.95)
    other = replace(told, similarity=0.2)
    again, once = hint_of(wish, LEFT, History((told,))), hint_of(wish, LEFT, History((other,)))
    assert again is not None
    assert once is not None
    assert again.kind == "right"
    assert again.share > once.share or once.kind != "right"


def test_a_habit_that_decides_is_told(planner: Planner) -> None:
    told = History(tuple(trip(day, "follow", remark="You should have overtaken that slow car.") for day in (1, 2, 3)))
    found = plan(planner, "Oh, look at that.", BEHIND, history=told)
    assert isinstance(found.policy, Parameters)
    assert found.policy.lane == -1
    assert '"Well, well." on 2026-01-03' in found.thoughts.text


def test_what_a_hint_is_taken_for_is_done_whatever_the_model_saw_before(planner: Planner) -> None:
    """The words it is driven by are read as they stand: trips like them that ended otherwise are not shown."""
    told = [
        trip(day, "follow", "Stay behind the car ahead.", "You might have gone round that old thing.", 0.5)
        for day in (1, 2, 3)
    ]
    for wish in ("Oh, look at that.", "Look at this one.", "Overtake the car ahead."):
        found = plan(planner, wish, BEHIND, history=History(tuple(told)))
        assert isinstance(found.policy, Parameters)
        assert (found.intent.partition(".")[0], found.policy.lane) == ("overtake", -1)


@pytest.mark.parametrize("now", [18.0, 28.0])
@pytest.mark.parametrize("said", ["Way too fast!", "I hated it."])
@pytest.mark.parametrize("disliked", ["style.relax", "style.hurry", "speed.increase", "follow"])
def test_what_was_disliked_never_makes_it_faster(planner: Planner, now: float, said: str, disliked: str) -> None:
    """Also where what is wished for now is a mood of which that drive was one."""
    told = replace(trip(3, disliked, "Take it easy.", said, 0.9), settings=(("target_speed_mps", 29.0),))
    told = replace(told, settings=(*told.settings, ("speed_limit_mps", SIGN)))
    for wish in ("Take it easy.", "I'm in a hurry."):
        for place in (replace(BEHIND, speed_mps=now), replace(LEFT, speed_mps=now)):
            alone, known = (plan(planner, wish, place, history=each).policy for each in (None, History((told,))))
            assert isinstance(alone, Parameters)
            assert not isinstance(known, Parameters) or known.target_speed_mps <= alone.target_speed_mps


def test_a_complaint_lowers_a_calm_speed_still() -> None:
    calm = replace(LEFT, speed_mps=22.0)
    assert eased_mps(-1, calm, Limits()) == pytest.approx(19.36)
    assert eased_mps(1, calm, Limits()) == pytest.approx(24.64)


def test_speeds_that_words_leave_open() -> None:
    assert fitting_mps(26.0, "overtake.left", BEHIND, Limits()) == 26.0
    assert fitting_mps(30.0, "overtake.left", BEHIND, Limits()) == pytest.approx(29.4)
    assert fitting_mps(30.0, "overtake.left", LEFT, Limits()) == 30.0
    assert fitting_mps(22.0, "follow", BEHIND, Limits()) == pytest.approx(24.0)
    assert fitting_mps(28.0, "lane.right", LEFT, Limits()) == pytest.approx(25.5)
    assert fitting_mps(24.0, "lane.right", LEFT, Limits()) == 24.0
    assert fitting_mps(28.0, "lane.left", LEFT, Limits()) == 28.0
    assert fitting_mps(22.0, "follow", LEFT, Limits()) == 22.0
    assert fitting_mps(0.0, "follow", BEHIND, Limits()) == 0.0
    assert fitting_mps(27.0, "style.hurry", BEHIND, Limits(max_speed_mps=25.0)) == 27.0
