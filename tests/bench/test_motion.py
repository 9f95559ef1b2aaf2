"""The motion benchmark: Eq. 26 and 27 at their edges, its rows, and that it conforms to the kernel."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import pytest

from chauffeur.bench.kernel.benchmark import ItemOutcome
from chauffeur.bench.kernel.conformance import faults
from chauffeur.bench.lampilot.rollout import plan_adapter
from chauffeur.bench.motion import MotionBenchmark
from chauffeur.bench.motion.items import SKY, STYLES, commands, style_ranges
from chauffeur.bench.motion.scoring import (
    WEIGHTS,
    MotionStatistics,
    command_alignment,
    driving_score,
    parameter_score,
)
from chauffeur.concept import ActionMatrix, ConfigError, Context, Plan, Situation, Thoughts
from chauffeur.concept.registry import plugin_names
from chauffeur.concept.weather import WEATHERS
from chauffeur.safety.gain_box import care, gain_box
from chauffeur.worlds.track import MANOEUVRES

pytest.importorskip("osqp")
pytest.importorskip("vehiclemodels")

CALM = ActionMatrix((0.18, 0.01, 0.15), (5.0, 10.0, 300.0))
SHARP = ActionMatrix((0.8, 0.04, 0.03), (18.0, 32.0, 85.0))
DRIVE = MotionStatistics(3.0, 4.0, 0.02, 0.4, 1.0, 0.5, 1.0)


@pytest.mark.parametrize(
    ("value", "style", "score"),
    [
        *((value, (2.0, 3.0), score) for value, score in
          [(0.9, 0.0), (1.0, 0.0), (1.5, 50.0), (2.0, 100.0), (3.0, 100.0), (3.5, 50.0), (4.0, 0.0), (4.1, 0.0)]),
        (1.0, (1.0, 2.0), 100.0), (4.0, (3.0, 4.0), 100.0), (0.5, (1.0, 2.0), 0.0),
    ],
)  # fmt: skip
def test_equation_27(value: float, style: tuple[float, float], score: float) -> None:
    assert parameter_score(value, 1.0, *style, 4.0) == pytest.approx(score)


def test_styles_lie_in_the_certified_box_and_mean_what_they_say() -> None:
    box, middle = gain_box(), {}
    for style, ranges in style_ranges().items():
        values = []
        for name, (low, high) in ranges.items():
            assert box.low[name.capitalize()] <= low < high <= box.high[name.capitalize()]
            values.append((low * high) ** 0.5 if low > 0.0 else (low + high) / 2.0)
        middle[style] = ActionMatrix((values[0], values[1], values[2]), (values[3], values[4], values[5]))
        assert command_alignment(middle[style], ranges) == 100.0
    assert care(middle["conservative"]) > care(middle["moderate"]) > care(middle["aggressive"])
    assert command_alignment(middle["aggressive"], style_ranges()["conservative"]) < 60.0


def test_there_are_ten_commands_a_manoeuvre_in_every_style() -> None:
    for name in MANOEUVRES:
        mine = [one for one in commands() if one.manoeuvre == name]
        assert len(mine) == 10
        assert {one.style for one in mine} == set(STYLES)
        assert {one.directness for one in mine} == {1, 2, 3}
    assert len(MotionBenchmark().items()) == 150


def test_weights_of_equation_26_sum_to_one_and_a_worse_drive_scores_less() -> None:
    for weights in WEIGHTS.values():
        assert sum(weights.values()) == pytest.approx(1.0)
    even = driving_score("lane_change", DRIVE, DRIVE, None, 100.0, 100.0)
    assert even == pytest.approx(100.0 - 20.0 * 0.5)
    assert driving_score("lane_change", replace(DRIVE, jerk_y=2.0), DRIVE, None, 100.0, 100.0) < even
    assert driving_score("lane_change", replace(DRIVE, min_ttc_s=1.0), DRIVE, None, 100.0, 100.0) < even - 10.0
    assert driving_score("lane_change", DRIVE, DRIVE, 1.98, 100.0, 100.0) < even
    assert driving_score("lane_change", DRIVE, DRIVE, None, 0.0, 100.0) < even


def rows_for(gains: dict[str, ActionMatrix]) -> list[dict[str, Any]]:
    bench, found = MotionBenchmark(), list[dict[str, Any]]()
    for item in bench.items()[:5]:
        plan = plan_adapter.dump_python(Plan(Thoughts(""), gains[item.weather], latency_s=0.5), mode="json")
        measured = asdict(DRIVE)
        result = {"infra_failed": False, "outcome": "ended", "measured": measured, "baseline": measured}
        found += [asdict(row) for row in bench.rows(ItemOutcome(item, plan, "", result))]
    return [dict(row) for row in bench.together(found)]


def test_scenario_alignment_compares_a_command_with_itself_in_sunshine() -> None:
    careful = rows_for({weather: SHARP if weather == "sunny" else CALM for weather in WEATHERS})
    assert [row["scenario_aligned"] for row in careful] == [None, True, True, True, True]
    blind = rows_for(dict.fromkeys(WEATHERS, SHARP))
    assert [row["scenario_aligned"] for row in blind] == [None, False, False, False, False]
    assert sum(row["score"] for row in careful) > sum(row["score"] for row in blind) - 100.0
    assert all(0.0 < row["score"] <= 100.0 for row in careful)


def test_gains_outside_the_box_align_with_nothing_and_what_crashed_scores_nothing() -> None:
    outside = replace(SHARP, pid=(50.0, 0.0, 0.0))
    assert rows_for(dict.fromkeys(WEATHERS, outside))[0]["command_alignment"] == 0.0
    row = rows_for(dict.fromkeys(WEATHERS, CALM))[1] | {"outcome": "collision"}
    assert MotionBenchmark().together([row])[0]["score"] == 0.0


def test_a_drive_is_checked_driven_and_measured() -> None:
    bench = MotionBenchmark()
    item = next(one for one in bench.items() if one.id.startswith("lane_change"))
    job = bench.job(item, plan_adapter.dump_python(Plan(Thoughts(""), SHARP), mode="json"))
    assert job is not None
    row = job.run()
    assert row["outcome"] == "ended"
    assert row["measured"]["min_ttc_s"] == pytest.approx(1.2, abs=0.4), "before the course leads past the lead vehicle"
    assert 0.1 < row["measured"]["acceleration_y"] < 1.5
    bad = bench.job(
        item, plan_adapter.dump_python(Plan(Thoughts(""), replace(SHARP, pid=(50.0, 0.0, 0.0))), mode="json")
    )
    assert bad is not None
    assert "certified" in bad.run()["detail"]


def test_it_conforms_to_the_kernel() -> None:
    if "track" not in plugin_names("chauffeur.worlds"):
        pytest.skip("the installed package is older than its track; install it anew")
    assert faults(MotionBenchmark()) == []


def test_what_is_told_of_the_weather() -> None:
    item = next(one for one in MotionBenchmark().items() if one.weather == "snow")
    context = Context("Here.", Situation("track", 0.0, 13.9, 2, 1, False, None, None))
    assert SKY["snow"] in item.told(context, "told").text
    assert not any(sky in item.told(context, "hidden").text for sky in SKY.values())
    assert SKY["sunny"] in item.told(context, "wrong").text
    with pytest.raises(ConfigError, match="unknown"):
        MotionBenchmark(plant="tank")  # type: ignore[arg-type]
