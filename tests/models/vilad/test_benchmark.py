"""Tab. XIII as a benchmark: its commands, what is meant by them, and one drive of each task scored."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import pytest

from chauffeur.bench.kernel.benchmark import ItemOutcome
from chauffeur.bench.lampilot.rollout import plan_adapter
from chauffeur.concept import ConfigError, Frame, Parameters, Plan, Thoughts
from chauffeur.describe.dispatch import describe
from chauffeur.driving.episode import make_world
from chauffeur.models.vilad.benchmark import InstructionBenchmark, InstructionItem, drive_statistics
from chauffeur.planners.vilad.driving import reference
from chauffeur.planners.vilad.driving_planning import trajectory_of

pytest.importorskip("vehiclemodels")
pytest.importorskip("osqp")


def row_for(item: InstructionItem, plan: Plan) -> dict[str, Any]:
    bench = InstructionBenchmark()
    answer = plan_adapter.dump_python(plan, mode="json")
    job = bench.job(item, answer)
    assert job is not None
    return asdict(bench.rows(ItemOutcome(item, answer, "", job.run()))[0])


def test_the_items_are_those_of_the_splits() -> None:
    bench = InstructionBenchmark(count=3)
    items = bench.items()
    assert len(items) == 2 * 4 * 3
    assert len({one.id for one in items}) == len(items)
    assert [one.text for one in InstructionBenchmark(count=3).items()] == [one.text for one in items]
    assert {one.scenario.world for one in InstructionBenchmark("driving", "phrasing", 2).items()} == {"track"}
    with pytest.raises(ConfigError, match="unknown"):
        InstructionBenchmark(task="flying")


def test_a_drive_that_does_what_was_meant_succeeds_and_another_does_not() -> None:
    items = InstructionBenchmark("driving", "seen", 12).items()
    item = next(one for one in items if one.asked["halt"] == "stop" and one.asked["pace"] == "-")
    context = describe(make_world(item.scenario).reset(item.scenario))
    assert context.street is not None
    from chauffeur.concept import Limits

    values = reference(context.street, item.asked)
    assert values["way"] != 0
    policy = trajectory_of(context.street, values, Limits(), 25.0 / 3.0)
    row = row_for(item, Plan(Thoughts(""), policy, settings=(("passes", 3.0), ("agreed", 1.0)), latency_s=0.02))
    assert (row["success"], row["outcome"], row["agreed"], row["passes"]) == (True, "success", True, 3.0)
    assert 0.5 < row["measured"]["acceleration_x"] < 3.0
    assert row["measured"]["speed_variance_y"] < 0.1
    refused = row_for(item, Plan(Thoughts("no"), None, refusal="no"))
    assert (refused["success"], refused["refused"], refused["measured"]) == (False, True, None)


def test_a_spot_that_is_as_good_as_any_is_a_success() -> None:
    from chauffeur.models.vilad.benchmark import _meant_spots

    for item in InstructionBenchmark("parking", "seen", 6).items():
        world = make_world(item.scenario)
        meant = _meant_spots(world.reset(item.scenario), item.asked)
        if meant:
            break
    row = row_for(item, Plan(Thoughts(""), Parameters(3.0, 4.0, 1.0, route=meant[0])))
    assert row["success"]
    assert row["metres"] > 5.0


def test_what_is_too_short_is_not_measured() -> None:
    frames: list[Frame] = []
    assert drive_statistics(frames, 0.05) is None
