"""Run folders: what is whole is read, what is not is refused in words, and rulers and items never mix."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from report_folders import mixed, outcome, read_lines, write, write_lines, write_run

from chauffeur.bench.lampilot.benchmark import NOT_ASKED
from chauffeur.bench.lampilot.merge import merge_shards
from chauffeur.bench.report.rulers import under_one_ruler
from chauffeur.bench.report.runs import load_run, load_runs, on_common_items
from chauffeur.concept import ConfigError, DataError

PAPER = "lampilot-paper-v1"


def test_a_finished_run_is_read_in_the_plans_order(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", mixed(), labels=("critic: evaluator",))
    rows = read_lines(folder / "results.jsonl")
    write_lines(folder / "results.jsonl", rows[::-1])
    run = load_run(folder)
    assert [row["item"] for row in run.rows] == [row["item"] for row in rows]
    assert (run.name, run.planned, run.labels) == ("onboard", 24, ("critic: evaluator",))


def test_rows_of_the_first_version_are_read(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", mixed())
    gone = ("metrics", "labels", "lane_ttc_s", "stop", "fault")
    rows = [{k: v for k, v in row.items() if k not in gone} for row in read_lines(folder / "results.jsonl")]
    write_lines(folder / "results.jsonl", [row | {"schema": "lampilot-results-v1"} for row in rows])
    assert load_run(folder).ruler == "lampilot-origin-v1"


def test_a_run_of_another_benchmark_is_named(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    write(folder / "plan.json", {"bench": "leaderboard-1.0-v1", "items": ["a-s0"]})
    with pytest.raises(DataError, match="holds a run of leaderboard-1") as error:
        load_run(folder)
    assert "table.md" in error.value.hint
    with pytest.raises(DataError, match="leaderboard") as error:
        merge_shards(tmp_path / "whole", [folder])
    assert "without --shard" in error.value.hint


def _missing(folder: Path) -> None:
    for path in sorted(folder.iterdir()):
        path.unlink()
    folder.rmdir()


def _foreign(folder: Path) -> None:
    (folder / "plan.json").unlink()


def _stopped(folder: Path) -> None:
    (folder / "results.jsonl").unlink()


def _short(folder: Path) -> None:
    write_lines(folder / "results.jsonl", read_lines(folder / "results.jsonl")[:-3])


def _stranger(folder: Path) -> None:
    rows = read_lines(folder / "results.jsonl")
    write_lines(folder / "results.jsonl", [*rows, rows[0] | {"item": "elsewhere_s0_c0"}])


def _newer(folder: Path) -> None:
    rows = read_lines(folder / "results.jsonl")
    write_lines(folder / "results.jsonl", [row | {"schema": "lampilot-results-v9"} for row in rows])


def _damaged(folder: Path) -> None:
    path = folder / "results.jsonl"
    path.write_text(path.read_text().replace("{", "(", 1))


def _column_gone(folder: Path) -> None:
    rows = read_lines(folder / "results.jsonl")
    write_lines(folder / "results.jsonl", [{k: v for k, v in row.items() if k != "outcome"} for row in rows])


def _two_rulers(folder: Path) -> None:
    rows = read_lines(folder / "results.jsonl")
    write_lines(folder / "results.jsonl", [*rows[:-1], rows[-1] | {"metrics": PAPER}])


def _empty_plan(folder: Path) -> None:
    write(folder / "plan.json", {"items": []})


def _no_json(folder: Path) -> None:
    (folder / "plan.json").write_text("{")


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (_missing, "No such run folder"),
        (_foreign, "not a run folder"),
        (_stopped, "24 items planned, 24 plans made, 24 drives made, no results.jsonl"),
        (_short, "21 of 24 planned items"),
        (_stranger, "elsewhere_s0_c0, which this run never planned"),
        (_newer, "'lampilot-results-v9'"),
        (_damaged, "line 1, is not JSON"),
        (_column_gone, "lacks outcome"),
        (_two_rulers, "mixes several metrics"),
        (_empty_plan, "plans no items"),
        (_no_json, "plan.json is not JSON"),
    ],
)
def test_a_folder_that_cannot_be_reported_says_why_and_what_to_do(tmp_path: Path, spoil: object, said: str) -> None:
    folder = write_run(tmp_path / "run", mixed())
    spoil(folder)  # type: ignore[operator]
    with pytest.raises(DataError) as error:
        load_run(folder)
    assert said in error.value.message
    assert error.value.hint or spoil is _empty_plan


def test_reading_changes_nothing(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", mixed())
    with (folder / "generate.jsonl").open("a") as stream:
        stream.write('{"item": "half a li')
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert len(load_run(folder).stage("generate", "item")) == 24
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_runs_that_share_a_name_are_told_apart_by_their_folders(tmp_path: Path) -> None:
    folders = [write_run(tmp_path / name, mixed()) for name in ("a/run", "b/run")]
    other = write_run(tmp_path / "c", mixed(), planner="openai/gpt-x", setting="zero-shot")
    assert [run.name for run in load_runs([*folders, other])] == [
        "onboard (a/run)",
        "onboard (b/run)",
        "openai/gpt-x (zero-shot)",
    ]
    with pytest.raises(ConfigError, match="twice"):
        load_runs([folders[0], tmp_path / "b" / ".." / "a" / "run"])
    with pytest.raises(ConfigError, match="No run folder"):
        load_runs([])


def test_items_that_were_never_asked_are_counted(tmp_path: Path) -> None:
    drives = [[outcome(), outcome("not_driven", detail=NOT_ASKED)] for _ in range(3)]
    assert load_run(write_run(tmp_path / "run", drives)).not_asked == 3


def test_runs_are_compared_on_the_items_they_share(tmp_path: Path) -> None:
    a = write_run(tmp_path / "a", mixed(12), planner="a")
    b = write_run(tmp_path / "b", mixed(8)[::-1], planner="b")
    shared = on_common_items(load_runs([a, b]))
    first, second = ([row["item"] for row in run.rows] for run in shared.runs)
    assert first == second
    assert len(first) == 16
    assert "a 24, b 16" in shared.note and "16 are in all" in shared.note
    assert on_common_items(load_runs([a])).note == ""


def test_the_same_id_in_another_data_set_is_another_item_unless_seed_and_words_agree(tmp_path: Path) -> None:
    a = write_run(tmp_path / "a", mixed(), planner="a")
    words = write_run(tmp_path / "b", mixed(), planner="b", data="e" * 64, command="Stop.")
    same = write_run(tmp_path / "c", mixed(), planner="c", data="e" * 64)
    assert on_common_items(load_runs([a, words])).runs[0].rows == ()
    shared = on_common_items(load_runs([a, same]))
    assert len(shared.runs[0].rows) == 24


def test_two_rulers_are_refused_and_one_named_scores_all(tmp_path: Path) -> None:
    a = write_run(tmp_path / "a", mixed(), planner="a")
    b = write_run(tmp_path / "b", mixed(), planner="b", ruler=PAPER)
    runs = load_runs([a, b])
    with pytest.raises(ConfigError, match="a by lampilot-origin-v1; b by lampilot-paper-v1") as error:
        under_one_ruler(runs)
    assert "--metrics origin or --metrics paper" in error.value.hint
    by_paper = under_one_ruler(runs, "paper")
    assert {run.ruler for run in by_paper} == {row["metrics"] for run in by_paper for row in run.rows} == {PAPER}
    own = {"planner", "metrics"}
    first, second = ([{k: v for k, v in row.items() if k not in own} for row in run.rows] for run in by_paper)
    assert first == second
    assert by_paper[0].rows[0]["ttc"] != runs[0].rows[0]["ttc"]
    back = under_one_ruler(by_paper, "lampilot-origin-v1")
    assert back[0].rows == runs[0].rows


def test_a_run_without_signals_cannot_change_its_ruler(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", mixed())
    rows = read_lines(folder / "rollout.jsonl")
    write_lines(folder / "rollout.jsonl", [{k: v for k, v in row.items() if k != "signals"} for row in rows])
    runs = load_runs([folder])
    assert under_one_ruler(runs, "origin") == runs
    with pytest.raises(DataError, match="kept no signals"):
        under_one_ruler(runs, "paper")
    with pytest.raises(ConfigError, match="Unknown ruler 'inches'"):
        under_one_ruler(runs, "inches")


def test_plans_with_scenes_give_them_back(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", mixed())
    plan = json.loads((folder / "plan.json").read_text())
    scene = {"id": "x_s0", "world": "highway", "config": {}, "seed": 10**42, "goal": {}, "wish": "", "title": ""}
    write(folder / "plan.json", plan | {"samples": {"x_s0": scene}, "planned": 96})
    run = load_run(folder)
    assert run.scenes["x_s0"].seed == 10**42
    assert run.planned == 96
    write(folder / "plan.json", plan | {"samples": {"x_s0": {"name": "?"}}})
    with pytest.raises(DataError, match="scenes"):
        _ = load_run(folder).scenes
