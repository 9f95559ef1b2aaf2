from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.bench.lampilot.goals import GIVE_UP_S, HOLD_S, _Held, make_goal
from chauffeur.bench.lampilot.metrics import Scorer, driving_score
from chauffeur.concept import Scenario, ScenarioError
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.scenarios import BUILT_IN

BY_ID = {s.id: s for s in BUILT_IN}


def _world(name: str) -> HighwayWorld:
    world = HighwayWorld()
    world.reset(BY_ID[name])
    return world


def _with_goal(name: str, **goal: object) -> Scenario:
    scenario = BY_ID[name]
    return Scenario(scenario.id, scenario.world, scenario.config, scenario.seed, goal=dict(goal))


def test_a_condition_must_be_held_for_longer_than_five_seconds() -> None:
    held = _Held()
    rulings = [held.judge(t / 10, reached=True, lost=False) for t in range(1, 60)]
    # Reached at 0.1 s; the first instant more than 5 s later is 5.2 s (float time, as in the origin).
    assert rulings.index("success") in (50, 51)
    assert (rulings.index("success") + 1) / 10 > 0.1 + HOLD_S


def test_losing_the_condition_restarts_the_clock() -> None:
    held = _Held()
    for t in range(1, 40):
        assert held.judge(t / 10, reached=True, lost=False) == "open"
    assert held.judge(4.0, reached=False, lost=True) == "open"
    assert held.judge(4.1, reached=True, lost=False) == "open"
    assert held.judge(9.0, reached=True, lost=False) == "open"
    assert held.judge(9.3, reached=True, lost=False) == "success"


def test_time_runs_out() -> None:
    assert _Held().judge(GIVE_UP_S + 0.1, reached=False, lost=False) == "failure"


@pytest.mark.parametrize(
    ("scenario", "goal"),
    [
        ("overtake", {"type": "OvertakeEval", "direction": "left"}),
        ("overtake", {"type": "LaneChangeEval", "direction": "left"}),
        ("following", {"type": "ACCEvalbyDistance", "rel_distance": 10}),
        ("cruise", {"type": "ACCEvalbySpeed", "speed": 25}),
        ("emergency-lane", {"type": "PullOverEval"}),
        ("intersection", {"type": "IntersectionEval", "direction": ["il1", "o1", 0]}),
    ],
)
def test_goals_start_open(scenario: str, goal: dict[str, object]) -> None:
    world = _world(scenario)
    assert make_goal(world, _with_goal(scenario, **goal)).rule(0.1) == "open"


@pytest.mark.parametrize(
    ("scenario", "goal", "message"),
    [
        ("overtake", {"type": "Fly"}, "unknown goal"),
        ("overtake", {}, "unknown goal"),
        ("overtake", {"type": "LaneChangeEval", "direction": "up"}, "left"),
        ("overtake", {"type": "LaneChangeEval", "direction": "right"}, "no lane to the right"),
        ("overtake", {"type": "LaneChangeEval"}, "malformed"),
        ("overtake", {"type": "PullOverEval"}, "emergency lane"),
        ("cruise", {"type": "ACCEvalbyDistance", "distance": 20}, "vehicle ahead"),
        ("cruise", {"type": "OvertakeEval", "direction": "left"}, "overtake"),
        ("intersection", {"type": "IntersectionEval", "direction": ["x", "y", 0]}, "not on this road"),
    ],
)
def test_goals_that_cannot_apply_say_so(scenario: str, goal: dict[str, object], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        make_goal(_world(scenario), _with_goal(scenario, **goal))


def _scorer(speeds: list[float], ttcs: list[float]) -> Scorer:
    return Scorer(speeds_mps=list(speeds), ttcs_s=list(ttcs))


def test_scores_on_analytic_cases() -> None:
    scorer = _scorer([20.0] * 300, [-1.0] * 300)
    assert scorer.ttc_score == 100.0
    assert scorer.speed_variance_score == 100.0
    assert scorer.time_efficiency_score == pytest.approx(50.0)
    assert scorer.score(success=True) == pytest.approx(0.5 * 100 + 0.3 * 100 + 0.2 * 50)
    assert scorer.score(success=False) == 0.0


@pytest.mark.parametrize(("ttc", "points"), [(2.0, 99.5), (2.1, 100.0), (0.5, 98.0), (0.1, 90.0), (0.001, -100.0)])
def test_ttc_score(ttc: float, points: float) -> None:
    assert _scorer([20.0], [ttc]).ttc_score == pytest.approx(points)


def test_metrics_of_a_failure_do_not_apply() -> None:
    metrics = {m.id: m for m in _scorer([20.0], [1.0]).metrics(success=False)}
    assert not metrics["lampilot-ttc-v1"].applies
    assert metrics["lampilot-score-v1"].applies
    assert metrics["lampilot-score-v1"].value == 0.0


@given(st.lists(st.floats(0, 40), min_size=1, max_size=50), st.lists(st.floats(-1, 50), min_size=1, max_size=50))
def test_score_is_never_negative_nor_above_100(speeds: list[float], ttcs: list[float]) -> None:
    assert 0.0 <= _scorer(speeds, ttcs).score(success=True) <= 100.0


def test_paper_rows_follow_from_their_columns() -> None:
    # All rows but two follow from their own printed columns, within the rounding of a rate that is weighed 500-fold.
    from chauffeur.bench.lampilot.paper import TABLE_IV

    for method, setting, collision, completion, ttc, sv, te, published in TABLE_IV:
        if (method, setting) in {("Human driver", "-"), ("GPT-4", "human feedback")}:
            continue
        mean = 0.5 * ttc + 0.3 * sv + 0.2 * te
        assert driving_score(completion / 100, mean, collision / 100) == pytest.approx(published, abs=0.85)
