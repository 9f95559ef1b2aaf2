"""Open-loop planning: nuScenes' format, the three conventions, answers of all shapes, and a real endpoint."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coached_data import server_module
from openloop_data import EFFORT, ROTATION, SCENES, Scripted, write_nuscenes
from typer.testing import CliRunner

from chauffeur.bench.kernel.conformance import faults
from chauffeur.bench.kernel.report import fill, published_lines
from chauffeur.bench.kernel.run import BenchRun
from chauffeur.bench.openloop import OpenLoopBenchmark
from chauffeur.bench.openloop.benchmark import TABLE_XII, errors_of
from chauffeur.bench.openloop.conventions import CONVENTIONS, L2Errors, errors, fails, standing
from chauffeur.bench.openloop.extrapolation import constant_turn_and_acceleration, constant_velocity, kind_of
from chauffeur.bench.openloop.nuscenes import NuScenesTables
from chauffeur.bench.openloop.requests import THOUGHTS, context_of, training_lines
from chauffeur.cli.main import app
from chauffeur.concept import ConfigError, DataError
from chauffeur.foreign.waypoints import read_waypoints
from chauffeur.planners.prompts.waypoints import read_motion, waypoints_text
from chauffeur.planners.registry import make_answerer
from small_run import quiet

PATH = np.array([[4.0, 0.1], [8.0, 0.2], [12.0, -0.3], [16.0, 0.4], [20.0, 0.5], [24.0, 0.6]])


def run(folder: Path, who: Any, **options: Any) -> tuple[BenchRun, list[dict[str, Any]]]:
    one = BenchRun(folder / f"run-{len(list(folder.iterdir()))}", OpenLoopBenchmark(str(folder), **options), who)
    return one, one.run(quiet, EFFORT)


def straight_on(text: str) -> str:
    history, _ = read_motion(text.partition("\n")[2] if text.startswith("You drive") else text)
    return waypoints_text(constant_velocity(history))


# The format -----------------------------------------------------------------------------------------------------------


def test_poses_come_out_in_the_ego_frame(tmp_path: Path) -> None:
    samples = NuScenesTables(write_nuscenes(tmp_path), "v1.0-mini").samples()
    assert [one.id for one in samples if one.scene == "scene-0001"] == [f"scene-0001-{i}" for i in range(4, 12)]
    first = samples[0]
    assert ROTATION != 0.0
    assert np.allclose(first.history, [[-16, 0, 0], [-12, 0, 0], [-8, 0, 0], [-4, 0, 0], [0, 0, 0]], atol=1e-9)
    assert np.allclose(first.future, [[4 * i, 0] for i in range(1, 7)], atol=1e-9)
    assert np.allclose(first.speeds_mps, 8.0)
    assert first.picture == tmp_path / "samples" / "CAM_FRONT" / "scene-0001-4.jpg"
    turning = next(one for one in samples if one.scene == "scene-0002")
    assert turning.future[-1, 1] > 2.0 and turning.command == "turn left"
    assert first.command == "go straight"


def test_where_a_scene_ends_the_truth_is_not_known(tmp_path: Path) -> None:
    samples = NuScenesTables(write_nuscenes(tmp_path), "v1.0-mini").samples(frozenset({"scene-0003"}))
    assert [int(np.isfinite(one.future[:, 0]).sum()) for one in samples] == [3, 2, 1]
    assert samples[0].command == ""
    found = {name: errors(PATH, samples[0].future, name) for name in CONVENTIONS}
    assert found["stp3"] == found["openemma"] == found["openemma-code"] == L2Errors(None, None, None)
    assert found["uniad"].at_1s is not None and found["uniad"].at_2s is None and found["uniad"].average is None
    published = found["uniad-published"]  # the step that is known counts, those after the end of the log as 0
    assert (published.at_1s, published.at_2s, published.at_3s) == (found["uniad"].at_1s, 0.0, 0.0)


@pytest.mark.parametrize(
    ("spoil", "named"),
    [
        (lambda folder: (folder / "ego_pose.json").unlink(), "ego_pose"),
        (lambda folder: (folder / "sample.json").write_text("{nothing"), "sample.json"),
        (lambda folder: (folder / "ego_pose.json").write_text("[]"), "ego_pose.json has no row"),
        (lambda folder: (folder / "openloop.json").write_text('[{"token": 1}]'), "openloop.json"),
    ],
)
def test_damaged_tables_are_named(tmp_path: Path, spoil: Any, named: str) -> None:
    spoil(write_nuscenes(tmp_path) / "v1.0-mini")
    with pytest.raises(DataError, match=named):
        NuScenesTables(tmp_path, "v1.0-mini").samples()


def test_a_version_that_is_not_there_is_told_with_those_that_are(tmp_path: Path) -> None:
    write_nuscenes(tmp_path)
    with pytest.raises(DataError) as told:
        NuScenesTables(tmp_path, "v1.0-trainval")
    assert "v1.0-mini" in str(told.value.hint)


# The conventions ------------------------------------------------------------------------------------------------------


def test_the_conventions_by_hand() -> None:
    truth = np.zeros((6, 2))
    guess = np.array([[1.0, 0], [2.0, 0], [0, 3.0], [0, 4.0], [5.0, 0], [6.0, 0]])
    assert errors(guess, truth, "uniad") == errors(guess, truth, "uniad-published") == L2Errors(2.0, 4.0, 6.0)
    assert errors(guess, truth, "stp3") == errors(guess, truth, "openemma") == L2Errors(1.5, 2.5, 3.5)
    # Up to 2 s the positions 0, 1, 2, 3 m are compared, up to 3 s also 4 and 5: the present is the first of them.
    assert errors(guess, truth, "openemma-code") == L2Errors(1.5, 1.5, 2.5)
    assert errors(guess, truth, "uniad").average == 4.0


@pytest.mark.parametrize("speed", [0.0, 3.0, 8.0, 20.0])
@pytest.mark.parametrize("offset", [(0.0, 0.0), (3.0, 4.0), (0.0, -2.0)])
def test_an_oracle_scores_its_own_offset(speed: float, offset: tuple[float, float]) -> None:
    truth = np.outer(np.arange(1, 7), [0.5 * speed, 0.0]) + np.outer(np.arange(1, 7) ** 2, [0.0, 0.1])
    found = {name: errors(truth + offset, truth, name) for name in CONVENTIONS}
    for name in ("stp3", "uniad", "uniad-published", "openemma"):
        for part in ("at_1s", "at_2s", "at_3s", "average"):
            assert getattr(found[name], part) == pytest.approx(math.hypot(*offset)), name


def _as_openemma_computes(pred_traj: np.ndarray, truth: np.ndarray) -> list[float]:
    """The three lines of its `main.py`, on a trajectory that begins with the present position as its own does."""
    return [
        float(np.mean(np.linalg.norm(truth[:2] - pred_traj[1:3], axis=1))),
        float(np.mean(np.linalg.norm(truth[:4] - pred_traj[:4], axis=1))),
        float(np.mean(np.linalg.norm(truth[:6] - pred_traj[:6], axis=1))),
    ]


def test_openemmas_published_lines_are_followed_to_the_digit() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        truth, guess = rng.normal(size=(6, 2)).cumsum(axis=0), rng.normal(size=(6, 2)).cumsum(axis=0)
        found = errors(guess, truth, "openemma-code")
        theirs = _as_openemma_computes(np.vstack([np.zeros((1, 2)), guess]), truth)
        assert [found.at_1s, found.at_2s, found.at_3s] == pytest.approx(theirs)
    straight = np.outer(np.arange(1, 7), [4.0, 0.0])  # 8 m/s, predicted perfectly
    assert errors(straight, straight, "openemma-code") == L2Errors(0.0, 4.0, 4.0)


def test_uniads_published_mean_is_over_all_samples() -> None:
    """Two samples 2 m off; of one the log ends after 1.5 s. UniAD sums masked errors and divides by both."""
    whole = np.outer(np.arange(1, 7), [1.0, 0.0])
    cut = whole.copy()
    cut[3:] = np.nan
    beside = whole + np.array([0.0, 2.0])
    pair = [errors(beside, truth, "uniad-published") for truth in (whole, cut)]
    columns = [[getattr(one, part) for one in pair] for part in ("at_1s", "at_2s", "at_3s", "average")]
    assert [sum(column) / 2 for column in columns] == pytest.approx([2.0, 1.0, 1.0, 4.0 / 3.0])
    known = [errors(beside, truth, "uniad").at_3s for truth in (whole, cut)]
    assert known == [2.0, None]


def test_a_failure_is_over_ten_metres_within_the_first_second() -> None:
    truth = np.zeros((6, 2))
    for place, limit in ((0, True), (1, True), (2, False)):
        guess = np.zeros((6, 2))
        guess[place] = 0.0, 10.1
        assert fails(guess, truth) is limit
        guess[place] = 0.0, 10.0
        assert not fails(guess, truth)
    assert fails(None, truth)
    assert not standing().any()


def test_what_motion_tells_and_what_it_does_not() -> None:
    steady = np.array([[-20, 0, 0], [-15, 0, 0], [-10, 0, 0], [-5, 0, 0], [0, 0, 0]], float)
    assert np.allclose(constant_velocity(steady)[-1], [30, 0])
    assert np.allclose(constant_turn_and_acceleration(steady), constant_velocity(steady))
    slowing = np.array([[-14, 0, 0], [-9, 0, 0], [-5, 0, 0], [-2, 0, 0], [0, 0, 0]], float)
    stops = constant_turn_and_acceleration(slowing)
    assert np.hypot(*stops[-1]) < 5.0 and np.all(np.diff(stops[:, 0]) >= 0.0)  # it stands, it does not go back
    still = np.zeros((5, 3))
    kinds = {
        "goes on": kind_of(steady, constant_velocity(steady)),
        "brakes": kind_of(steady, constant_velocity(steady) * 0.7),
        "speeds up": kind_of(steady, constant_velocity(steady) * 1.3),
        "turns": kind_of(steady, constant_velocity(steady) + np.outer(np.arange(1, 7), [0.0, 1.0])),
        "stays": kind_of(still, np.zeros((6, 2))),
        "starts": kind_of(still, PATH),
    }
    assert {name: name for name in kinds} == kinds


# Answers --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "words",
    [
        waypoints_text(PATH),
        "```json\n" + json.dumps(PATH.tolist()) + "\n```",
        json.dumps([{"x": x, "y": y} for x, y in PATH.tolist()]),
        "The car was at (-8.0, 0.0) and (-4.0, 0.0).\nSo: " + waypoints_text(PATH),
        "\n".join(f"{0.5 * (i + 1)} s: ({x:+}, {y:+})" for i, (x, y) in enumerate(PATH)),
        " ".join(f"({0.5 * (i + 1)}, {x}, {y})" for i, (x, y) in enumerate(PATH)),
        "\n".join(f"- x = {x} m, y = {y} m" for x, y in PATH),
        *(
            waypoints_text(PATH).replace("-", sign)
            for sign in ("\u2212", "\u2013", "\uff0d", "- ", "\u2212 ", "minus ")
        ),
        waypoints_text(PATH).replace("0.10", "0.10000000000000001").replace("(", "（").replace(")", "）"),
        waypoints_text(PATH).translate({48 + i: 0xFF10 + i for i in range(10)}),
        waypoints_text(PATH).translate({48 + i: 0x660 + i for i in range(10)} | {46: 0x66B}),
        waypoints_text(PATH).replace(", ", "; ").replace(".", ","),
        " ".join(f"({x:e}, {y:e})" for x, y in PATH.tolist()),
        "\n".join(f"{i + 1}. {x}, {y}" for i, (x, y) in enumerate(PATH.tolist())),
        "| t | x | y |\n|---|---|---|\n" + "\n".join(f"| {i / 2 + 0.5} | {x} | {y} |" for i, (x, y) in enumerate(PATH)),
        waypoints_text(PATH) + " relative to the car at (0, 0).",
        waypoints_text(PATH) + ". All from (0.0, 0.0) on, heading (1, 0).",
        " ".join(f"Waypoint {i + 1}: ({x}, {y})." for i, (x, y) in enumerate(PATH)),
        f"<thinking>{waypoints_text(PATH * 2)}</thinking>{waypoints_text(PATH)}",
        f"{waypoints_text(PATH * 2)}</think>{waypoints_text(PATH)}",
        f"{waypoints_text(PATH)}<|im_end|>\n<|im_start|>user\nThen?\n<|im_start|>assistant\n{waypoints_text(PATH * 2)}",
        f"{waypoints_text(PATH)}\nThat is, {waypoints_text(PATH)}",
    ],
)
def test_waypoints_are_read_however_they_are_written(words: str) -> None:
    found = read_waypoints(words)
    assert found is not None and np.allclose(found, PATH)


@pytest.mark.parametrize(
    "words",
    [
        "",
        "I cannot say.",
        "[(1, 2), (3, 4)]",
        "(1e99, 0) " * 6,
        "(nan, nan) " * 6,
        "(1, 2, 3) " * 6,
        "(" * 100_000,
        "(2.5 ahead, 0.1 right), " * 6,
        "(10², 0.1) " * 6,
        "(2.5-0.1) " * 6,
        f"{waypoints_text(PATH)} or {waypoints_text(PATH * 2)}",
        f"<think>{waypoints_text(PATH)}",
    ],
)
def test_what_are_no_waypoints_is_not_read_as_some(words: str) -> None:
    assert read_waypoints(words) is None


@pytest.mark.parametrize(
    ("case", "file", "sign"),
    [
        ("waypoints-long-floats", "reply.txt", 1),
        ("waypoints-long-floats", "fullwidth-brackets.txt", 1),
        ("waypoints-sign-lost", "en-dash.txt", -1),
        ("waypoints-sign-lost", "fullwidth.txt", -1),
        ("waypoints-sign-lost", "space.txt", -1),
    ],
)
def test_recorded_waypoints_keep_their_signs(
    case_folder: Callable[[str], Path], case: str, file: str, sign: int
) -> None:
    found = read_waypoints((case_folder(case) / file).read_text(encoding="utf-8"))
    steps = np.arange(1, 7)
    assert found is not None and np.allclose(found, np.stack([2.5 * steps, sign * 0.1 * steps], axis=1))


# Runs -----------------------------------------------------------------------------------------------------------------


def test_it_is_a_benchmark_of_the_kernel(tmp_path: Path) -> None:
    assert faults(OpenLoopBenchmark(str(write_nuscenes(tmp_path)))) == []


def test_a_model_that_goes_straight_on_is_constant_velocity(tmp_path: Path) -> None:
    who = Scripted(straight_on)
    done, rows = run(write_nuscenes(tmp_path), who)
    assert len(rows) == sum(len(poses) - 5 for poses in SCENES.values())
    for row in rows:
        for name in CONVENTIONS:
            mine, theirs = errors_of(row, name), errors_of(row, name, "cv")
            for part in ("at_1s", "at_2s", "at_3s"):
                one, other = getattr(mine, part), getattr(theirs, part)
                assert (one is None and other is None) or math.isclose(one, other, abs_tol=0.15)  # two decimals a text
    assert not any(row["failed"] for row in rows)
    content = who.seen[0][-1]["content"]
    assert content[1]["image_url"]["url"].startswith("data:image/jpeg;base64,")
    assert "Speed over each half second, m/s: 8.0, 8.0, 8.0, 8.0." in content[2]["text"]
    assert "Navigation: go straight" in content[2]["text"]
    table = (done.folder / "table.md").read_text()
    assert all(part in table for part in (*CONVENTIONS, "failures left out", "failures counted"))


def test_a_model_that_knows_the_future_scores_nothing(tmp_path: Path) -> None:
    samples = NuScenesTables(write_nuscenes(tmp_path), "v1.0-mini").samples()
    futures = iter([np.nan_to_num(one.future, nan=7.0) for one in samples])
    _, rows = run(tmp_path, Scripted(lambda text: waypoints_text(next(futures))))
    assert len(rows) == len(samples)
    for convention in ("openemma", "stp3", "uniad", "uniad-published"):
        for row in rows:
            found = errors_of(row, convention)
            assert all((value or 0.0) < 0.005 for value in (found.at_1s, found.at_2s, found.at_3s))
    late, kept, *_ = fill(TABLE_XII, rows).cells
    assert kept[2:6] == ["0.00"] * 4
    assert late[2] == "0.00" and all(float(cell) > 2.0 for cell in late[3:5])


def test_failures_are_counted_both_ways(tmp_path: Path) -> None:
    answers = iter(["I would rather not."] + [waypoints_text(PATH)] * 30)
    _, rows = run(write_nuscenes(tmp_path), Scripted(lambda text: next(answers)), scene_list="", limit=8)
    assert [row["status"] for row in rows].count("unreadable") == 1
    assert fill(TABLE_XII, rows).cells[1][-1] == f"{100 / 8:.2f}"
    kept, counted = (fill(OpenLoopBenchmark.tables[place], rows).lines[-1].found[2].value for place in (0, 1))
    assert kept is not None and counted is not None and kept < counted
    bad = next(row for row in rows if row["failed"])
    assert bad["l2_30"] == pytest.approx(24.0)  # it counts as a car that stays


def test_an_endpoint_that_gives_nothing_counts_nowhere(tmp_path: Path) -> None:
    answered = iter([True])

    def refuse(text: str) -> str:
        if next(answered, False):  # a run in which nothing at all was answered is an error and has no rows
            return waypoints_text(PATH)
        raise DataError("down")

    _, rows = run(write_nuscenes(tmp_path), Scripted(refuse), limit=3)
    silent = [row for row in rows if row["status"] == "no answer"]
    assert len(silent) == 2 and all(row["failed"] is None for row in silent)
    assert [line.name for line in fill(TABLE_XII, silent).lines if "constant" not in line.name] == []
    assert all(errors_of(row, name) == L2Errors(None, None, None) for row in silent for name in CONVENTIONS)
    counted = next(row for row in rows if row["status"] == "answered")
    assert fill(TABLE_XII, rows).lines[1] == fill(TABLE_XII, [counted]).lines[1]


def test_the_chain_of_thought_asks_before_it_asks(tmp_path: Path) -> None:
    who = Scripted(lambda text: waypoints_text(PATH) if "Where will" in text else f"I think of: {text[:20]}")
    _, rows = run(write_nuscenes(tmp_path), who, setting="chain-of-thought", limit=1)
    assert [len(turns) for turns in who.seen] == [1, 3, 5, 7]
    last = who.seen[-1]
    assert [turn["role"] for turn in last] == ["user", "assistant"] * 3 + ["user"]
    assert [last[2]["content"], last[4]["content"]] == list(THOUGHTS[1:])
    assert rows[0]["status"] == "answered"


def test_the_fine_tuning_lines_are_what_the_sft_setting_asks(tmp_path: Path) -> None:
    bench = OpenLoopBenchmark(str(write_nuscenes(tmp_path)), setting="sft", limit=1)
    who = Scripted(lambda text: waypoints_text(PATH))
    run(tmp_path, who, setting="sft", limit=1)
    line = json.loads(next(iter(training_lines(bench.samples, tmp_path))))
    asked, answer = line["messages"]
    assert asked["content"][1]["text"] == who.seen[0][-1]["content"][-1]["text"]
    assert np.allclose(read_waypoints(answer["content"]), bench.samples[0].future, atol=0.01)
    history, said = read_motion(context_of(bench.samples[0]))
    assert np.allclose(history, bench.samples[0].history, atol=0.01) and said == "go straight"


def test_a_picture_that_is_missing_costs_its_own_frame(tmp_path: Path) -> None:
    write_nuscenes(tmp_path)
    (tmp_path / "samples" / "CAM_FRONT" / "scene-0001-5.jpg").unlink()
    _, rows = run(tmp_path, Scripted(straight_on), limit=3)
    assert [row["status"] for row in rows] == ["answered", "no answer", "answered"]
    assert "scene-0001-5.jpg" in rows[1]["detail"]


@pytest.mark.parametrize(
    "options",
    [{"setting": "guessing"}, {"shown": "nothing"}, {"stride": 0}, {"tables": "v9"}, {"scene_list": "no-file"}],
)
def test_options_that_make_no_sense_are_refused(tmp_path: Path, options: dict[str, Any]) -> None:
    write_nuscenes(tmp_path)
    with pytest.raises((ConfigError, DataError)):
        OpenLoopBenchmark(str(tmp_path), **options)


def test_a_model_behind_a_real_endpoint(tmp_path: Path) -> None:
    write_nuscenes(tmp_path)
    module = server_module()
    server = module.ModelServer()
    server.script(module.whole(f"Here: {waypoints_text(PATH)}"))
    try:
        who = make_answerer("openai/some-vlm", base_url=server.url, attempts=1, stream=False)
        _, rows = run(tmp_path, who, limit=2)
    finally:
        server.close()
    asked = server.requests[0].body["messages"][-1]["content"]
    assert [row["status"] for row in rows] == ["answered", "answered"]
    assert [part["type"] for part in asked] == ["text", "image_url", "text"]
    assert rows[0]["l2_05"] == pytest.approx(0.1, abs=1e-3)


def test_the_papers_table_stands_beside_ours() -> None:
    lines = {line.name: [one.value for one in line.found] for line in published_lines(TABLE_XII, [])}
    assert len(lines) == 13
    assert lines["ViLaD-SFT, SFT"] == [0.79, 1.92, 2.83, 1.85, 0.0]
    for *values, mean, _ in lines.values():
        assert sum(value or 0.0 for value in values) / 3 == pytest.approx(mean, abs=0.016)  # as printed: they add up


def test_the_command_asks_and_shows_the_papers_rows(tmp_path: Path) -> None:
    write_nuscenes(tmp_path / "data")
    module = server_module()
    server = module.ModelServer()
    server.script(module.whole(waypoints_text(PATH)))
    arguments = ["bench", "openloop", "--data", str(tmp_path / "data"), "--limit", "2", "--out", str(tmp_path / "run")]
    try:
        asked = CliRunner().invoke(app, [*arguments, "--planner", "openai/some-vlm", "--base-url", server.url])
    finally:
        server.close()
    assert asked.exit_code == 0, asked.output
    said = (tmp_path / "run" / "table.md").read_text()
    assert "paper: ViLaD-Opt" in said and "| constant velocity, openemma |" in said
    assert "read off the true future" in asked.output
    written = CliRunner().invoke(app, ["bench", "scenes", "sft", arguments[3], "--out", str(tmp_path / "sft.jsonl")])
    assert written.exit_code == 0, written.output
    lines = (tmp_path / "sft.jsonl").read_text().splitlines()
    assert len(lines) >= 2 and json.loads(lines[0])["messages"]
    nobody = CliRunner().invoke(app, arguments)
    assert nobody.exit_code != 0
