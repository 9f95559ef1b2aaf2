"""Open loop with doScenes' instructions: its files, what an oracle scores, and who gains by words and who does not."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import openloop_data
import pytest
from coached_data import server_module
from openloop_data import EFFORT, Scripted, circle, straight, write_nuscenes
from typer.testing import CliRunner

from chauffeur.bench.kernel.conformance import faults
from chauffeur.bench.kernel.report import fill
from chauffeur.bench.kernel.run import BenchRun
from chauffeur.bench.openloop.doscenes import SceneInstruction, read_annotations
from chauffeur.bench.openloop.extrapolation import constant_turn_and_acceleration, constant_velocity
from chauffeur.bench.openloop.instructed import HISTORY_ONLY, MODEL, STEPS, InstructedBenchmark
from chauffeur.bench.openloop.nuscenes import NuScenesTables
from chauffeur.bench.openloop.requests import question
from chauffeur.cli.main import app
from chauffeur.concept import ConfigError, DataError
from chauffeur.foreign.waypoints import read_waypoints
from chauffeur.planners.prompts.waypoints import read_motion, waypoints_text
from small_run import quiet

HEAD = "Scene Number,Instruction Type,Instruction\n"
SAYS = "The passenger says: "


def turning_after(steps: int, speed: float, radius: float) -> list[tuple[float, float, float]]:
    """Straight on until the fifth key frame, then along a circle: motion does not tell that, words do."""
    start = straight(5, speed, 0.0)
    x, y, _ = start[-1]
    return [*start, *((x + dx, y + dy, yaw) for dx, dy, yaw in circle(steps - 4, speed, radius)[1:])]


TURNS = {
    "scene-0001": turning_after(20, 6.0, 15.0),
    "scene-0002": turning_after(20, 6.0, -15.0),
    "scene-0003": straight(20, 6.0, 0.0),
    "scene-0004": straight(12, 6.0, 0.0),  # 3.5 s after its fifth key frame
}
FIRST = (
    HEAD
    + "1,,turn left\n"
    + '1,s,"turn left, at the kiosk"\n'
    + "2,d,turn right behind the tram\n"
    + '3,"s,d",go straight\n'
    + "4,,go straight\n"
    + "900,,go straight\n"
    + "901,,\n"
)
SECOND = "Scene Number,Instruction Type,Instruction,,,\n2.0,DS,  turn   right ,,,note\n\n"
CALLED = {"left": 15.0, "right": -15.0}


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(openloop_data, "SCENES", TURNS)
    write_nuscenes(tmp_path / "data")
    annotations = tmp_path / "data" / "Annotations"
    annotations.mkdir()
    (annotations / "doScenesAnnotations - Annotator 1.csv").write_text(FIRST)
    (annotations / "doScenesAnnotations - Annotator 2.csv").write_bytes(b"\xef\xbb\xbf" + SECOND.encode())
    return tmp_path / "data"


def run(data: Path, answer: Callable[[str], str], **options: Any) -> tuple[InstructedBenchmark, list[dict[str, Any]]]:
    bench = InstructedBenchmark(str(data), str(data / "Annotations"), **options)
    folder = data.parent / f"run-{len(list(data.parent.iterdir()))}"
    return bench, BenchRun(folder, bench, Scripted(answer)).run(quiet, EFFORT)


def column(bench: InstructedBenchmark, rows: list[dict[str, Any]], table: int, line: str, head: str) -> float | None:
    found = fill(bench.tables[table], rows)
    at = list(found.header).index(head) - 2
    return next(one.found[at].value for one in found.lines if one.name == line)


def told(text: str) -> str:
    """The instruction in a question; empty for none."""
    return next((line.removeprefix(SAYS) for line in text.splitlines() if line.startswith(SAYS)), "")


def obedient(text: str) -> str:
    """Straight on, or along the circle that the words name."""
    history, _ = read_motion(text)
    ahead = constant_velocity(history, STEPS)
    radius = next((radius for side, radius in CALLED.items() if side in told(text)), None)
    if radius is not None:
        ahead = np.array([pose[:2] for pose in circle(STEPS + 1, 6.0, radius)[1:]])
    return waypoints_text(ahead)


def deaf(text: str) -> str:
    return waypoints_text(constant_velocity(read_motion(text)[0], STEPS))


# The annotations ------------------------------------------------------------------------------------------------------


def test_annotations_are_read_as_they_are_published(data: Path) -> None:
    found = read_annotations(data / "Annotations")
    one, two = (f"doScenesAnnotations - Annotator {i}.csv" for i in (1, 2))
    assert found.instructions == (
        SceneInstruction("scene-0001", "no reference", "turn left", f"{one}:2"),
        SceneInstruction("scene-0001", "static", "turn left, at the kiosk", f"{one}:3"),
        SceneInstruction("scene-0002", "dynamic", "turn right behind the tram", f"{one}:4"),
        SceneInstruction("scene-0003", "static and dynamic", "go straight", f"{one}:5"),
        SceneInstruction("scene-0004", "no reference", "go straight", f"{one}:6"),
        SceneInstruction("scene-0900", "no reference", "go straight", f"{one}:7"),
        SceneInstruction("scene-0002", "static and dynamic", "turn right", f"{two}:2"),
    )
    assert found.blank == 1 and found.malformed == ()
    alone = read_annotations(data / "Annotations" / two)
    assert len(alone.instructions) == 1 and alone.sha256 != found.sha256


@pytest.mark.parametrize(
    ("row", "said"),
    [
        (b"one,,turn left", "'one' is no scene number"),
        (b",s,turn left", "'' is no scene number"),
        (b"1.5,,turn left", "'1.5' is no scene number"),
        (b"-3,,turn left", "'-3' is no scene number"),
        (b"3,x,turn left", "'x' is no instruction type"),
        (b"3,,turn \xff left", "not UTF-8"),
        (b"3,,turn \x00 left", "cannot be printed"),
        (b'3,,"turn left', "no CSV"),
        (b'3,,"turn" left', "no CSV"),
        (b"3,," + b"left " * 1_000, "4999 characters"),
        (b"3,," + b"x" * 200_000, "no CSV"),
    ],
)
def test_a_malformed_row_costs_itself_and_is_named(tmp_path: Path, row: bytes, said: str) -> None:
    rows = [b"1,,before", row, *(b"%d,s,after" % i for i in range(2, 20))]
    (tmp_path / "a.csv").write_bytes(HEAD.encode() + b"\n".join(rows) + b"\n")
    found = read_annotations(tmp_path)
    assert [one.text for one in found.instructions] == ["before", *["after"] * 18]
    assert [one.place for one in found.instructions][:2] == ["a.csv:2", "a.csv:4"]
    (malformed,) = found.malformed
    assert malformed.startswith("a.csv:3: ") and said in malformed


def test_a_quoted_text_may_span_lines(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(HEAD + '1,s,"turn left,\nthen ""stop"""\r\n2,,go on\n')
    found = read_annotations(tmp_path)
    assert [(one.text, one.place) for one in found.instructions] == [
        ('turn left, then "stop"', "a.csv:2"),
        ("go on", "a.csv:4"),
    ]
    assert not found.malformed


@pytest.mark.parametrize(
    "content", [b"", b"a,b,c\n1,s,turn\n", b"Scene Number,Instruction\n1,turn\n", b"\xff\xfe\x00\x01", b'"']
)
def test_a_file_without_the_columns_is_refused_by_name(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.csv").write_bytes(content)
    with pytest.raises(DataError, match=r"a\.csv is no file of doScenes' annotations"):
        read_annotations(tmp_path)


def test_no_file_and_too_large_a_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="0 CSV files"):
        read_annotations(tmp_path)
    with pytest.raises(DataError, match="cannot be read"):
        read_annotations(tmp_path / "none.csv")
    with (tmp_path / "a.csv").open("wb") as file:
        file.truncate(10_000_001)
    with pytest.raises(DataError, match="10 MB"):
        read_annotations(tmp_path)


# Items ----------------------------------------------------------------------------------------------------------------


def test_each_scene_is_asked_about_once_without_and_with_each_instruction(data: Path) -> None:
    bench = InstructedBenchmark(str(data), str(data / "Annotations"))
    assert faults(bench) == []
    asked = [(one.sample.id, one.instruction) for one in bench.items()]
    assert asked == [
        ("scene-0001-4", ""),
        ("scene-0001-4", "turn left"),
        ("scene-0001-4", "turn left, at the kiosk"),
        ("scene-0002-4", ""),
        ("scene-0002-4", "turn right behind the tram"),
        ("scene-0002-4", "turn right"),
        ("scene-0003-4", ""),
        ("scene-0003-4", "go straight"),
    ]
    assert all(one.sample.future.shape == (STEPS, 2) and one.sample.whole for one in bench.items())
    assert bench.left_out == (
        "Rows without an instruction: 1.",
        "Scenes not in the set: 1 (instructions: 1).",
        "Scenes not asked for, or without 8 s in one piece: 1 (instructions: 1).",
    )
    limited = InstructedBenchmark(str(data), str(data / "Annotations"), limit=1)
    assert {one.sample.scene for one in limited.items()} == {"scene-0001"}
    assert "8 s in one piece: 3 (instructions: 4)." in limited.left_out[-1]


@pytest.mark.parametrize("setting", ["zero-shot", "chain-of-thought"])
def test_the_instruction_is_all_that_differs_and_no_navigation_leaks(data: Path, setting: str) -> None:
    bench = InstructedBenchmark(str(data), str(data / "Annotations"), setting=setting, limit=1)
    who = Scripted(deaf if setting == "zero-shot" else lambda text: "I think so.")
    BenchRun(data.parent / "run", bench, who).run(quiet, EFFORT)
    opened = sorted(
        {"\n".join(part["text"] for part in turns[0]["content"] if "text" in part) for turns in who.seen}, key=len
    )
    assert [told(text) for text in opened] == ["", "turn left", "turn left, at the kiosk"]
    assert {text.replace(f"{SAYS}{told(text)}\n", "") for text in opened} == {opened[0]}
    assert not any("Navigation" in text for text in opened)
    if setting == "zero-shot":
        assert "5.5 and 6.0 s from now? Answer with twelve positions" in opened[0]
        assert opened[0].count("(x, y)") == STEPS


def test_the_question_for_three_seconds_is_the_one_that_its_figures_belong_to(data: Path) -> None:
    sample = NuScenesTables(data, "v1.0-mini").samples()[0]
    assert question(sample, "zero-shot").endswith(
        "Navigation: turn left\n"
        "Where will the car be 0.5, 1.0, 1.5, 2.0, 2.5 and 3.0 s from now? Answer with six positions, nothing else: "
        "[(x, y), (x, y), (x, y), (x, y), (x, y), (x, y)]"
    )


def test_navigation_is_still_read_off_the_first_three_seconds(data: Path) -> None:
    tables = NuScenesTables(data, "v1.0-mini")
    longer = {one.id: one for one in tables.samples(steps=STEPS)}
    for one in tables.samples():
        assert longer[one.id].command == one.command
        assert np.array_equal(longer[one.id].future[:6], one.future, equal_nan=True)


@pytest.mark.parametrize(
    ("options", "error"),
    [({"setting": "sft"}, ConfigError), ({"scene_list": "none"}, DataError), ({"stride": 0}, ConfigError)],
)
def test_what_cannot_be_asked_is_refused(data: Path, options: dict[str, Any], error: type[Exception]) -> None:
    with pytest.raises(error):
        InstructedBenchmark(str(data), str(data / "Annotations"), **options)


def test_annotations_of_other_scenes_alone_are_refused(data: Path) -> None:
    (data / "other.csv").write_text(HEAD + "900,,go straight\n")
    with pytest.raises(DataError, match="None of the 1 scenes"):
        InstructedBenchmark(str(data), str(data / "other.csv"))


# Figures --------------------------------------------------------------------------------------------------------------


def test_an_oracle_has_no_error_and_nothing_to_gain(data: Path) -> None:
    futures = iter([one.sample.future for one in InstructedBenchmark(str(data), str(data / "Annotations")).items()])
    bench, rows = run(data, lambda text: waypoints_text(next(futures)))
    assert next(futures, None) is None
    for head in ("ADE m", "ADE without m", "FDE m", "FDE without m"):
        assert column(bench, rows, 0, MODEL, head) == pytest.approx(0.0, abs=0.01)
    assert column(bench, rows, 0, MODEL, "gain ADE m") == pytest.approx(0.0, abs=0.01)


def test_a_model_that_uses_words_gains_and_one_that_ignores_them_does_not(data: Path) -> None:
    bench, rows = run(data, obedient)
    assert column(bench, rows, 0, MODEL, "ADE m") == pytest.approx(0.0, abs=0.01)
    assert column(bench, rows, 1, "no reference", "gain ADE m") > 5.0
    assert column(bench, rows, 1, "dynamic", "gain FDE m") > 10.0
    straight_on = next(
        row for row in rows if row["method"] == MODEL and row["scene"] == "scene-0003" and row["instruction"]
    )
    assert straight_on["ade_m"] == straight_on["ade_without_m"]
    for name in ("constant velocity", "constant turn and acceleration"):
        assert column(bench, rows, 0, name, "gain ADE m") == column(bench, rows, 0, name, "gain FDE m") == 0.0
        assert column(bench, rows, 2, name, "gain ADE m") == 0.0
        assert column(bench, rows, 0, name, "ADE m") > 3.0
    bench, rows = run(data, deaf)
    for table in (0, 2):
        assert column(bench, rows, table, MODEL, "gain ADE m") == 0.0
    assert column(bench, rows, 0, MODEL, "ADE m") == pytest.approx(
        column(bench, rows, 0, "constant velocity", "ADE m"), abs=0.01
    )
    assert "gain 0 by construction" in bench.tables[0].title


def test_a_model_misled_by_words_loses(data: Path) -> None:
    bench, rows = run(
        data, lambda text: obedient(text.replace("left", "LEFT").replace("right", "left").replace("LEFT", "right"))
    )
    assert column(bench, rows, 0, MODEL, "gain ADE m") < -3.0


def test_errors_by_hand(data: Path) -> None:
    """Scene 3 goes straight on; the answer is 1 m aside at first and 1 m more at every step."""
    aside = np.stack([3.0 * np.arange(1, STEPS + 1), np.arange(1.0, STEPS + 1)], axis=1)
    (data / "one.csv").write_text(HEAD + "3,,go straight\n")
    bench = InstructedBenchmark(str(data), str(data / "one.csv"))
    who = Scripted(lambda text: waypoints_text(aside) if told(text) else waypoints_text(aside * [1.0, 0.5]))
    rows = BenchRun(data.parent / "run", bench, who).run(quiet, EFFORT)
    row = next(row for row in rows if row["method"] == MODEL and row["kind"] != HISTORY_ONLY)
    assert [row[name] for name in ("ade_m", "fde_m", "ade_without_m", "fde_without_m")] == [6.5, 12.0, 3.25, 6.0]
    assert column(bench, rows, 0, MODEL, "gain ADE m") == -3.25


def test_no_waypoints_are_a_car_that_stays_and_no_answer_counts_nowhere(data: Path) -> None:
    def silent(text: str) -> str:
        if told(text) == "turn right":
            raise DataError("down")
        return "I had rather not." if told(text) == "go straight" else deaf(text)

    bench, rows = run(data, silent)
    unreadable = next(
        row for row in rows if row["method"] == MODEL and row["scene"] == "scene-0003" and row["instruction"]
    )
    assert unreadable["status"] == "unreadable" and unreadable["fde_m"] == pytest.approx(36.0)
    assert column(bench, rows, 0, MODEL, "no waypoints %") == 1 / 4
    assert column(bench, rows, 0, MODEL, "no waypoints without %") == 0.0
    lost = next(row for row in rows if row["method"] == MODEL and row["instruction"] == "turn right")
    assert lost["status"] == "no answer" and lost["ade_m"] is None and lost["kept"] is None
    assert [line.items for line in fill(bench.tables[0], rows).lines if line.name == MODEL] == [4]


def test_a_gain_of_form_alone_can_be_told(data: Path) -> None:
    """A model that answers only when spoken to gains over a car that stays; the share of answers says so."""
    bench, rows = run(data, lambda text: deaf(text) if told(text) else "Where to?")
    assert column(bench, rows, 0, MODEL, "gain ADE m") > 1.0
    assert column(bench, rows, 0, MODEL, "no waypoints %") == 0.0
    assert column(bench, rows, 0, MODEL, "no waypoints without %") == 1.0
    assert column(bench, rows, 0, "constant velocity", "no waypoints %") is None


def test_without_the_question_without_words_there_is_no_gain(data: Path) -> None:
    def silent(text: str) -> str:
        if not told(text):
            raise DataError("down")
        return deaf(text)

    bench, rows = run(data, silent)
    assert {line.name for line in fill(bench.tables[0], rows).lines} == {
        "constant velocity", "constant turn and acceleration",
    }  # fmt: skip
    assert all(row["ade_without_m"] is None for row in rows if row["method"] == MODEL)


def test_the_challenges_filter_leaves_out_the_worst_scenes() -> None:
    """40 scenes off by 1 m with the instruction and 2 m without; one of them by 1,000 m with it, another without."""
    rows = [
        {"scene": f"scene-{i:04}", "kind": "no reference", "method": MODEL, "status": "answered",
         "status_without": None, "ade_m": 1000.0 if i == 7 else 1.0, "fde_m": 1.0,
         "ade_without_m": None, "fde_without_m": None, "kept": None, "kept_without": None}
        for i in range(40)
    ]  # fmt: skip
    asked = [row | {"kind": HISTORY_ONLY, "ade_m": 1000.0 if i == 9 else 2.0} for i, row in enumerate(rows)]
    found = [dict(row) for row in InstructedBenchmark.together(None, [*asked, *rows])]  # type: ignore[arg-type]
    assert [row["scene"] for row in found if row["kept"] is False] == ["scene-0007"]
    assert [row["scene"] for row in found if row["kept_without"] is False] == ["scene-0009"]
    (line,) = fill(InstructedBenchmark.tables[2], found).lines
    assert [value.value for value in line.found] == [1.0, 2.0, 1.0]
    (whole,) = fill(InstructedBenchmark.tables[0], found).lines
    assert whole.found[0].value == pytest.approx((39 + 1000) / 40)
    gain = whole.found[2]
    assert gain.low is not None and gain.high is not None and gain.low < 1.0 < gain.high


# Twelve waypoints -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("predict", [constant_velocity, constant_turn_and_acceleration])
def test_longer_extrapolations_begin_like_the_shorter_ones(predict: Any) -> None:
    history = np.array([[-16, 0.5, 0.1], [-12, 0.3, 0.1], [-7.6, 0.1, 0.1], [-3.7, 0, 0.05], [0, 0, 0]])
    assert predict(history, STEPS).shape == (STEPS, 2)
    assert np.array_equal(predict(history, STEPS)[:6], predict(history))


def test_twelve_waypoints_are_read_as_six_are() -> None:
    path = np.stack([4.0 * np.arange(1, 13), 0.1 * np.arange(1, 13)], axis=1)
    for words in (
        waypoints_text(path),
        json.dumps(path.tolist()),
        " ".join(f"({0.5 * (i + 1)}, {x:.2f}, {y:.2f})" for i, (x, y) in enumerate(path)),
        "\n".join(f"{i + 1}. {x:.2f}, {y:.2f}" for i, (x, y) in enumerate(path)),
    ):
        found = read_waypoints(words, STEPS)
        assert found is not None and np.allclose(found, path)
    assert read_waypoints(waypoints_text(path[:6]), STEPS) is None


# The command ----------------------------------------------------------------------------------------------------------


def test_the_command_tells_gains_and_what_was_left_out(data: Path) -> None:
    with (data / "Annotations" / "more.csv").open("wb") as file:
        file.write(HEAD.encode() + b"2,q,turn right\n")
    module = server_module()
    server = module.ModelServer()
    server.script(module.whole(waypoints_text(np.stack([3.0 * np.arange(1, 13), np.zeros(12)], axis=1))))
    arguments = ["bench", "openloop", "--data", str(data), "--instructions", str(data / "Annotations")]
    out = data.parent / "run"
    try:
        asked = CliRunner().invoke(
            app, [*arguments, "--planner", "openai/some-vlm", "--base-url", server.url, "--out", str(out)]
        )
    finally:
        server.close()
    assert asked.exit_code == 0, asked.output
    said = " ".join(asked.output.split())
    assert "more.csv:2: 'q' is no instruction type" in said and "Scenes not in the set: 1" in said
    assert "constant velocity" in said and "No navigation is shown" in said and "read off the true future" not in said
    assert "more.csv:2" in (out / "left_out.txt").read_text()
    assert "gain 0 by construction" in (out / "table.md").read_text()
    assert CliRunner().invoke(app, [*arguments, "--beside", str(out)]).exit_code == 2
