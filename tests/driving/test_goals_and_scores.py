from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept import ConfigError, Scenario, ScenarioError
from chauffeur.driving.judge.goals import GIVE_UP_S, HOLD_S, make_goal
from chauffeur.driving.judge.metrics import PAPER, RULERS, metrics_of, points
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.scenarios import BUILT_IN

RIGHT = {"type": "LaneChangeEval", "direction": "right"}
BY_ID = {s.id: s for s in BUILT_IN}


def _world(name: str) -> HighwayWorld:
    world = HighwayWorld()
    world.reset(BY_ID[name])
    return world


def _with_goal(name: str, **goal: object) -> Scenario:
    scenario = BY_ID[name]
    return Scenario(scenario.id, scenario.world, scenario.config, scenario.seed, goal=dict(goal))


def test_a_speed_must_be_held_for_longer_than_five_seconds_within_a_minute() -> None:
    road = _world("cruise").perception()
    now = road.instant()
    there, elsewhere = now._replace(speed_mps=20.0), now._replace(speed_mps=25.0)

    def ruled(*instants: tuple[float, bool]) -> list[str]:
        goal = make_goal(road, _with_goal("cruise", type="ACCEvalbySpeed", speed=20))
        return [goal.rule(t, there if reached else elsewhere) for t, reached in instants]

    rulings = ruled(*((t / 10, True) for t in range(1, 60)))
    # Reached at 0.1 s; the first instant more than 5 s later is 5.2 s (float time, as in the origin).
    assert rulings.index("success") in (50, 51)
    assert (rulings.index("success") + 1) / 10 > 0.1 + HOLD_S
    lost = ruled((0.1, True), (4.0, False), (4.1, True), (9.0, True), (9.3, True))
    assert lost == ["open"] * 4 + ["success"]
    assert ruled((GIVE_UP_S + 0.1, False)) == ["failure"]


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
    road = _world(scenario).perception()
    assert make_goal(road, _with_goal(scenario, **goal)).rule(0.1, road.instant()) == "open"


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
        ("overtake", {"type": "SequenceEval"}, "malformed"),
        ("overtake", {"type": "SequenceEval", "steps": []}, "steps"),
        ("overtake", {"type": "SequenceEval", "steps": [RIGHT, RIGHT]}, "no lane to the right"),
        ("overtake", {"type": "ChangeEval", "quantity": "colour", "change": 1}, "colour"),
        ("overtake", {"type": "ChangeEval", "quantity": "speed", "change": 2}, "not 2"),
        ("overtake", {"type": "ReachEval"}, "malformed"),
        ("cruise", {"type": "ReachEval", "distance": 20}, "none within 100 m"),
        ("cruise", {"type": "ChangeEval", "quantity": "distance", "change": 1}, "none within 100 m"),
    ],
)
def test_goals_that_cannot_apply_say_so(scenario: str, goal: dict[str, object], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        make_goal(_world(scenario).perception(), _with_goal(scenario, **goal))


def _drive(*, success: bool = True, **signals: object) -> dict[str, object]:
    """A rollout row: 30 s at constant speed without any conflict, but for what is given."""
    quiet = {
        "steps": 300,
        "ttc_along_s": None,
        "ttc_plane_s": None,
        "ttc_lane_s": None,
        "speed_mean_mps": 20.0,
        "speed_std_mps": 0.0,
        "crashed": False,
        "off_road": False,
        "past_end": False,
        "stop_speed_mps": None,
        "fault": "",
    }
    return {"success": success, "signals": quiet | signals}


@pytest.mark.parametrize("ruler", RULERS)
def test_scores_on_analytic_cases(ruler: str) -> None:
    row = points(_drive(), ruler)
    assert (row["ttc"], row["speed_variance"]) == (100.0, 100.0)
    assert row["time_efficiency"] == pytest.approx(50.0)
    assert row["score"] == pytest.approx(0.5 * 100 + 0.3 * 100 + 0.2 * 50)
    assert points(_drive(success=False), ruler)["score"] == 0.0
    assert row["metrics"] == RULERS[ruler]


@pytest.mark.parametrize(("ttc", "expected"), [(2.0, 99.5), (2.1, 100.0), (0.5, 98.0), (0.1, 90.0), (0.001, -100.0)])
def test_ttc_score(ttc: float, expected: float) -> None:
    assert points(_drive(ttc_along_s=ttc), "origin")["ttc"] == pytest.approx(expected)
    assert points(_drive(ttc_plane_s=ttc), "paper")["ttc"] == pytest.approx(max(0.0, expected))
    assert points(_drive(ttc_along_s=ttc), "paper")["ttc"] == 100.0  # each ruler reads its own signal


def test_rulers_differ_where_the_code_differs_from_the_print() -> None:
    wild = _drive(speed_std_mps=12.0, steps=700)
    assert points(wild, "origin")["speed_variance"] == pytest.approx(-20.0)
    assert points(wild, "paper")["speed_variance"] == 0.0
    assert points(wild, "origin")["success"]
    assert not points(wild, "paper")["success"]  # after the time limit
    over_the_end = _drive(success=False, off_road=True, past_end=True, fault="road_end")
    assert points(over_the_end, "origin")["collision"]
    assert not points(over_the_end, "paper")["collision"]
    struck = _drive(crashed=True, fault="struck")
    assert points(struck, "origin")["success"]
    assert not points(struck, "paper")["success"]
    with pytest.raises(ConfigError, match="Unknown ruler"):
        points(wild, "mine")


def test_what_was_not_driven_has_no_parts() -> None:
    row = points({"success": False, "signals": None}, "origin")
    assert row["ttc"] is None
    assert row["score"] == 0.0


@pytest.mark.parametrize(("speed", "word"), [(None, ""), (0.4, "stopped"), (1.0, "rolled"), (9.0, "rolled")])
def test_stop_sign_column(speed: float | None, word: str) -> None:
    assert points(_drive(stop_speed_mps=speed), "origin")["stop"] == word


def test_metrics_of_a_failure_do_not_apply() -> None:
    metrics = {m.id: m for m in metrics_of(_drive(success=False, ttc_along_s=1.0))}
    assert not metrics["lampilot-ttc-v1"].applies
    assert metrics["lampilot-score-v1"].applies
    assert metrics["lampilot-score-v1"].value == 0.0
    assert "lampilot-paper-score-v1" in {m.id for m in metrics_of(_drive(), PAPER)}


@given(st.floats(0, 30), st.floats(1e-6, 50), st.integers(1, 10_000), st.sampled_from(sorted(RULERS)))
def test_score_is_never_negative_nor_above_100(std: float, ttc: float, steps: int, ruler: str) -> None:
    row = points(_drive(speed_std_mps=std, ttc_along_s=ttc, ttc_plane_s=ttc, steps=steps), ruler)
    assert 0.0 <= row["score"] <= 100.0
