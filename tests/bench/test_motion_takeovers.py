"""Simulated passengers of gains: who is off takes over, days are the same for all systems, memory is only read."""

from __future__ import annotations

import pytest

pytest.importorskip("osqp")
pytest.importorskip("onnxruntime")

from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.bench.kernel.benchmark import ItemOutcome
from chauffeur.bench.motion.passengers import draw_manners, judged, meant, wanted
from chauffeur.bench.motion.takeovers import TakeoverBenchmark
from chauffeur.concept import ActionMatrix, ConfigError
from chauffeur.planners.prompts.motion import MODERATE
from chauffeur.safety.gain_box import care

BOLD = ActionMatrix((1.0, 0.06, 0.0), (20.0, 60.0, 80.0))
CAREFUL = ActionMatrix((0.15, 0.0, 0.3), (1.0, 10.0, 800.0))


def test_a_larger_count_adds_people_and_changes_none() -> None:
    assert draw_manners(9, 4)[:3] == draw_manners(3, 4)
    assert draw_manners(3, 4) != draw_manners(3, 5)
    quick, slow = (sorted(draw_manners(60, 1), key=lambda one: one.who.usual_share)[i] for i in (-1, 0))
    assert quick.taste < slow.taste, "who likes it quick wants it bolder"


def test_styles_mean_what_their_ranges_say() -> None:
    assert 0.0 < meant()["aggressive"] < meant()["moderate"] < meant()["conservative"] < 1.0


@settings(max_examples=60)
@given(st.integers(0, 40), st.sampled_from(["conservative", "moderate", "aggressive"]), st.floats(-2.0, 2.0))
def test_bad_weather_is_never_wanted_bolder_and_who_is_met_never_takes_over(
    number: int, style: str, day: float
) -> None:
    manner = draw_manners(number + 1, 2)[number]
    sunny, snow = (wanted(manner, style, weather, day) for weather in ("sunny", "snow"))  # type: ignore[arg-type]
    assert snow >= sunny
    assert not judged(manner, care(MODERATE), MODERATE, "ended", "left_turn").takes_over


def test_what_is_off_is_said_as_it_is_felt() -> None:
    manner = draw_manners(1, 1)[0]
    harsh = judged(manner, 0.9, BOLD, "ended", "acceleration")
    assert (harsh.takes_over, harsh.topic, harsh.force) == (True, "harsh", "much") and harsh.deviation < 0.0
    assert judged(manner, 0.9, BOLD, "ended", "lane_change").topic == "swerving"
    assert judged(manner, 0.1, CAREFUL, "ended", "left_turn").topic == "too_slow"
    assert judged(manner, 0.1, BOLD, "collision", "left_turn").topic == "close_call"
    assert judged(manner, 0.1, None, "refused", "left_turn").topic == "waited"


def test_a_sitting_asks_every_system_the_same_and_teaches_the_memory_only_before() -> None:
    bench = TakeoverBenchmark(passengers=1, trips=2)
    item = bench.items()[2]
    result = bench.job(item, None).run()
    rows = bench.rows(ItemOutcome(item, None, "", result))
    learning, measured = rows[:2], rows[2:]
    assert [row.phase for row in learning] == ["learning"] * 2 and len(measured) == 9
    for level in (1, 2, 3):
        day = [row for row in measured if row.level == level]
        assert {row.arm for row in day} == {"fixed", "without", "with"}
        assert len({(row.wish, row.weather, row.wanted) for row in day}) == 1
    fixed = [row for row in measured if row.arm == "fixed"]
    assert {row.gave for row in fixed if row.outcome == "ended"} <= {round(care(MODERATE), 4)}
    assert all(row.recalled == 0 for row in measured if row.arm != "with")
    assert all(row.recalled <= 2 for row in measured), "what measures does not teach"
    assert all(row.takeover == (abs(row.deviation) > 1.0) for row in rows if row.outcome == "ended")
    assert bench.job(item, None).run() == result, "the same seed gives the same trips"


def test_options_that_cannot_be_are_refused() -> None:
    for options in ({"passengers": 0}, {"trips": -1}, {"plant": "cart"}, {"planner": "nobody"}):
        with pytest.raises(ConfigError):
            TakeoverBenchmark(**options)  # type: ignore[arg-type]
