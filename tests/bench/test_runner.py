"""The benchmark's stages on a tiny data set written here, driven for real."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from chauffeur.bench.kernel.calls import Patience
from chauffeur.bench.kernel.progress import Standing
from chauffeur.bench.kernel.report import tables
from chauffeur.bench.kernel.run import BenchRun, Effort
from chauffeur.bench.lampilot.benchmark import choose_items
from chauffeur.bench.lampilot.report import COMPLETION, FAMILY_TABLE, SCORE_TABLE
from chauffeur.concept import (
    ConfigError,
    Context,
    DataError,
    Instruction,
    Plan,
    PlannerError,
    PlanRequest,
    Program,
    Round,
    SystemMessage,
    Thoughts,
)
from chauffeur.worlds.highway.dblv1 import Dataset, Item, load_dataset
from chauffeur.worlds.highway.scenarios import BUILT_IN
from small_run import Inline, benchmark

LEFT = """
def change():
    set_target_lane(get_left_lane(get_ego_vehicle()))
    while True:
        yield autopilot()
"""
DYING = """
def change():
    set_target_lane(get_left_lane(get_ego_vehicle()))
    yield autopilot()
    x = 1 / 0
    yield autopilot()
"""


class ScriptedPlanner:
    """Gives a fixed answer for each command; counts how often it is asked."""

    id = "scripted"
    model = "scripted-1"

    def __init__(self) -> None:
        self.asked = 0

    async def plan(self, request: PlanRequest) -> Plan:
        self.asked += 1
        if request.instruction.text == "broken line":
            raise PlannerError("No answer.", retryable=True)
        if request.instruction.text == "say no":
            return Plan(Thoughts("No."), None, refusal="I will not.")
        source = DYING if request.instruction.text == "die" else LEFT
        return Plan(Thoughts("Left."), Program(source), intent="lane.left")


@pytest.fixture
def dataset(tmp_path: Path) -> Dataset:
    folder = tmp_path / "data"
    folder.mkdir()
    scenario = next(s for s in BUILT_IN if s.id == "overtake")
    sample = {"env": scenario.config, "eval": {"type": "LaneChangeEval", "direction": "left"}, "seed": scenario.seed}
    bad = {**sample, "env": {"type": "ramp-merge-v0", "vehicles_density": 0}}
    commands = ["go left", "left please", "say no", "die", "broken line"]
    (folder / "left_lc.json").write_text(json.dumps({"commands": commands, "samples": [sample]}))
    (folder / "broken.json").write_text(json.dumps({"commands": ["go left"], "samples": [bad]}))
    return load_dataset(folder)


def _quiet(standing: Standing) -> None:
    pass


EFFORT = Effort(engine=Inline, patience=Patience(attempts=2, base_s=0.01))


def _run(tmp_path: Path, dataset: Dataset, planner: ScriptedPlanner) -> list[dict[str, object]]:
    return BenchRun(tmp_path / "run", benchmark(dataset, "scripted"), planner).run(_quiet, EFFORT)


@pytest.mark.slow
def test_outcomes_and_causes_are_apart_and_the_denominator_is_fixed(tmp_path: Path, dataset: Dataset) -> None:
    planner = ScriptedPlanner()
    rows = {row["item"]: row for row in _run(tmp_path, dataset, planner)}
    assert len(rows) == 6
    assert rows["left_lc_s0_c0"]["success"]
    assert rows["left_lc_s0_c0"]["rollout_key"] == rows["left_lc_s0_c1"]["rollout_key"]
    refused = rows["left_lc_s0_c2"]
    assert (refused["outcome"], refused["refused"], refused["detail"]) == ("refused", True, "I will not.")
    died = rows["left_lc_s0_c3"]
    assert died["policy_failed"] and died["fallback_used"] and not died["success"]
    assert died["score"] == 0.0, "what the fallback achieved is not the policy's"
    silent = rows["left_lc_s0_c4"]
    assert silent["infra_failed"] and silent["outcome"] == "not_driven"
    assert rows["broken_s0_c0"]["infra_failed"]
    assert COMPLETION.aggregate(list(rows.values()), "sample").value == pytest.approx(2 / 6)

    # Resume: plans and rollouts are kept, only what failed for want of infrastructure is asked again.
    asked = planner.asked
    again = _run(tmp_path, dataset, planner)
    assert {r["item"]: r for r in again} == rows
    assert planner.asked == asked + EFFORT.patience.attempts
    families, scores = tables((FAMILY_TABLE, SCORE_TABLE), again, "scripted")
    assert "lane change" in [line.name for line in families.lines]
    assert {"scripted", "Human driver"} <= {line.name for line in scores.lines}


def test_a_run_folder_keeps_its_configuration(tmp_path: Path, dataset: Dataset) -> None:
    BenchRun(tmp_path / "run", benchmark(dataset, "idm"))
    with pytest.raises(ConfigError, match="another configuration"):
        BenchRun(tmp_path / "run", benchmark(dataset, "mobil"))
    with pytest.raises(ConfigError, match="asks for plans"):
        BenchRun(tmp_path / "other", benchmark(dataset, "magic"))


@pytest.mark.slow
def test_labels_stand_in_every_row_and_the_request_can_be_replaced(tmp_path: Path, dataset: Dataset) -> None:
    class Coached:
        """What a learning loop asks instead of the plain wish."""

        id = "coached"
        labels: tuple[str, ...] = ()

        async def request(self, item: Item, context: Context) -> PlanRequest:
            rounds = (Round("def before(): ...", "Too slow."),)
            return PlanRequest(Instruction("go left"), context, SystemMessage("S"), rounds=rounds)

    class Labelled(ScriptedPlanner):
        labels = ("critic: evaluator",)

        async def plan(self, request: PlanRequest) -> Plan:
            assert request.rounds[0].feedback == "Too slow."
            return await super().plan(request)

    coached = benchmark(dataset, "scripted", Coached())
    run = BenchRun(tmp_path / "run", coached, Labelled())
    rows = run.run(_quiet, EFFORT)
    assert {tuple(row["labels"]) for row in rows} == {("critic: evaluator",)}
    assert sum(row["success"] for row in rows) == 5, "every command became the same wish; one sample is broken"
    assert "critic: evaluator" in (run.folder / "table.md").read_text()
    assert json.loads((run.folder / "provenance.json").read_text())["labels"] == ["critic: evaluator"]
    with pytest.raises(ConfigError, match="another configuration"):
        BenchRun(tmp_path / "run", coached, ScriptedPlanner())


def test_items_are_drawn_as_the_origin_draws_them(dataset: Dataset) -> None:
    items = dataset.items()
    assert [i.id for i in choose_items(dataset, 0, 42)] == [i.id for i in items]
    drawn = choose_items(dataset, 3, 42)
    assert [i.id for i in drawn] == [i.id for i in choose_items(dataset, 3, 42)]
    assert len({i.id for i in drawn}) == 3


@pytest.mark.parametrize(
    ("content", "message"),
    [("{", "not a DbLv1"), ("[]", "not a DbLv1"), ('{"commands": ["x"], "samples": [{"env": {}}]}', "not a DbLv1")],
)
def test_damaged_task_files_are_named(tmp_path: Path, content: str, message: str) -> None:
    (tmp_path / "task.json").write_text(content)
    with pytest.raises(DataError, match=message) as caught:
        load_dataset(tmp_path)
    assert "task.json" in str(caught.value)


def test_missing_data_is_said(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="No such data folder"):
        load_dataset(tmp_path / "nowhere")
    with pytest.raises(DataError, match="no task files"):
        load_dataset(tmp_path)
    (tmp_path / "config_list.txt").write_text("gone.json")
    with pytest.raises(DataError, match=r"gone\.json"):
        load_dataset(tmp_path)


def test_the_official_files_are_read_unchanged(lampilot_data: Path) -> None:
    dataset = load_dataset(lampilot_data / "DbLv1-dev")
    assert len(dataset.tasks) == 32
    assert len(dataset.items()) == 3136
    assert dataset.scenario("left_overtake_s0_c3") is dataset.scenario("left_overtake_s0")
