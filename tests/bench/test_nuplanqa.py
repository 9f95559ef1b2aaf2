"""NuPlanQA as a benchmark: its format, its pictures, its controls, and what goes wrong with single questions."""

from __future__ import annotations

import base64
import json
import pickle
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from nuplanqa_data import questions, write_set

from chauffeur.bench.kernel.benchmark import ItemOutcome
from chauffeur.bench.kernel.calls import Patience
from chauffeur.bench.kernel.conformance import faults
from chauffeur.bench.kernel.report import fill, published_lines
from chauffeur.bench.kernel.run import BenchError, BenchRun, Effort
from chauffeur.bench.nuplanqa import NuPlanQaBenchmark
from chauffeur.bench.nuplanqa.frames import CAMERAS, FrameSource
from chauffeur.bench.nuplanqa.metadata import load_metadata
from chauffeur.bench.nuplanqa.questions import SKILLS, SUBTASKS, load_questions
from chauffeur.bench.nuplanqa.table6 import TABLE_VI, strict_accuracy
from chauffeur.concept import DataError, Usage
from chauffeur.planners.base import Prose
from chauffeur.planners.llm_errors import RefusedError, blind
from small_run import Inline, quiet

EFFORT = Effort(workers=1, engine=Inline, patience=Patience(attempts=2, base_s=0.001))


class Oracle:
    """Knows the answers by heart, or always says one letter; keeps what it was asked."""

    id = model = "oracle"

    def __init__(self, always: str = "", error: Exception | None = None) -> None:
        self.always, self.error = always, error
        self.seen: list[Any] = []
        self._right = {item.question: item.options[item.answer] for item in questions()}

    async def write(self, messages: Sequence[Any]) -> Prose:
        content = messages[-1]["content"]
        self.seen.append(content)
        if self.error is not None:
            raise self.error
        text = content if isinstance(content, str) else content[-1]["text"]
        right = next(answer for question, answer in self._right.items() if question in text)
        return Prose(self.always or f"The answer is: {right}", whole=True, model="oracle", usage=Usage())


def run(folder: Path, oracle: Oracle, **options: Any) -> tuple[BenchRun, list[dict[str, Any]]]:
    bench = NuPlanQaBenchmark(str(folder), **options)
    one = BenchRun(folder / f"run-{len(list(folder.iterdir()))}", bench, oracle)
    return one, one.run(quiet, EFFORT)


def test_the_format_goes_round(tmp_path: Path) -> None:
    read = load_questions(write_set(tmp_path))
    assert [item.json() for item in read.items] == [item.json() for item in questions()]
    assert not read.unreadable
    assert [item.chain for item in read.items[:3]] == [questions()[0].token] * 3


def test_a_question_with_a_list_of_its_own_is_split_at_the_last_one(tmp_path: Path) -> None:
    entry = questions()[0].json()
    asked = entry["QA"][0]
    asked["q"] = asked["q"].replace(
        "What do the lights show?", "Which of (a) red, (b) green?\n        \n(a) Red.\n(b) None.?"
    )
    path = tmp_path / "odd.json"
    path.write_text(json.dumps([entry, {"QA": []}, {**entry, "QA": [{**asked, "a": "(b) Purple."}]}]))
    read = load_questions(path)
    assert read.items[0].options == questions()[0].options
    assert "(a) red" in read.items[0].question
    assert [one.place for one in read.unreadable] == [1, 2]


def test_shifts_move_the_options_and_the_answer() -> None:
    item = questions()[1]
    for places in range(4):
        moved = item.shifted(places)
        assert moved.options[moved.answer] == item.options[item.answer]
        assert moved.answer == (item.answer + places) % 4


def test_it_is_a_benchmark_of_the_kernel(tmp_path: Path) -> None:
    write_set(tmp_path)
    bench = NuPlanQaBenchmark(str(tmp_path))
    assert faults(bench) == []
    assert list(bench.rows(ItemOutcome(bench.items()[0], None, "", None))) == [], (
        "nothing is said of what was not asked"
    )


def test_a_model_that_knows_is_right_and_one_that_says_b_is_not(tmp_path: Path) -> None:
    write_set(tmp_path)
    knows = Oracle()
    done, rows = run(tmp_path, knows, shifts="all")
    assert len(rows) == 36 and all(row["correct"] for row in rows)
    assert strict_accuracy(rows) == (1.0, 9)
    table = (done.folder / "table.md").read_text()
    assert all(skill in table for skill in SKILLS) and all(task in table for task in SUBTASKS)
    assert "kind 0" in table
    _, fixed = run(tmp_path, Oracle("(b)"), shifts="all")
    assert sum(row["correct"] for row in fixed) == 9
    assert strict_accuracy(fixed) == (0.0, 9)


def test_what_a_model_is_shown(tmp_path: Path) -> None:
    write_set(tmp_path)
    many, one, blank, text = Oracle(), Oracle(), Oracle(), Oracle()
    run(tmp_path, many)
    run(tmp_path, one, frames="single", cameras="CAM_F0,CAM_B0")
    run(tmp_path, blank, frames="single", control="blank")
    run(tmp_path, text, control="text")
    pictures = [[part for part in seen if part["type"] == "image_url"] for seen in many.seen]
    assert sorted(map(len, pictures)) == [6, 6, 6, 12, 12, 12, 18, 18, 18]  # fewer where a scene begins
    assert all(len(seen) == 2 * 2 + 1 for seen in one.seen)
    assert one.seen[0][0]["text"] == "CAM_F0 (front), now:"
    grey = {part["image_url"]["url"] for seen in blank.seen for part in seen if part["type"] == "image_url"}
    assert len(grey) == 1
    assert base64.b64decode(grey.pop().partition(",")[2]).startswith(b"\xff\xd8")
    assert all(isinstance(seen, str) and "(d)" in seen for seen in text.seen)


def test_what_is_wrong_with_one_question_costs_that_one_alone(tmp_path: Path) -> None:
    path = write_set(tmp_path)
    entries = json.loads(path.read_text())
    entries[8]["task"] = "Parking"
    path.write_text(json.dumps(entries))
    (tmp_path / "part_0" / f"{questions()[0].token}_CAM_L0.jpg").unlink()
    (tmp_path / "part_0" / f"{questions()[3].token}_CAM_B0.jpg").write_bytes(b"\xff\xd8 cut off")
    metadata = json.loads((tmp_path / "metadata.json").read_text())
    del metadata[questions()[6].token]
    del metadata[questions()[7].token]["cams"]["CAM_R2"]
    (tmp_path / "metadata.json").write_text(json.dumps(metadata))
    bench = NuPlanQaBenchmark(str(tmp_path), frames="single")
    every = [item.token for item in questions()]
    assert [one.name for one in bench.frames.missing(every)] == [f"{questions()[0].token}_CAM_L0.jpg"]
    done, rows = run(tmp_path, Oracle(), frames="single")
    statuses = [row["status"] for row in rows]
    assert statuses == [
        "missing view", "answered", "answered", "corrupt image", "answered", "answered", "no metadata", "missing view",
        "unknown subtask",
    ]  # fmt: skip
    assert [row["correct"] for row in rows if row["status"] != "answered"] == [None] * 5
    assert "CAM_L0" in rows[0]["detail"] and "Parking" in rows[8]["detail"]
    assert "| corrupt image | 1 | 1 |" in (done.folder / "table.md").read_text()
    assert done.halt is None


@pytest.mark.parametrize(
    ("status", "words"),
    [
        (400, "This model does not support image input."),
        (400, "At most 0 image(s) may be provided in one request."),
        (500, "image input is not supported - hint: if this is unexpected, you may need to provide the mmproj"),
        (422, "unknown variant `image_url`, expected `text`"),
    ],
)
def test_an_endpoint_without_vision_is_told_of_every_item(tmp_path: Path, status: int, words: str) -> None:
    write_set(tmp_path)
    failure = blind(RefusedError(status, {"message": words}), "http://x/v1", "m", str)
    assert failure is not None
    assert failure.kind == "no_vision" and not failure.retryable
    with pytest.raises(BenchError, match=r"None of the 9 items.*9 times: .*takes no pictures"):
        run(tmp_path, Oracle(error=failure))
    (folder,) = tmp_path.glob("run-*")
    rows = [json.loads(line) for line in (folder / "results.jsonl").read_text().splitlines()]
    assert [row["status"] for row in rows] == ["no vision"] * 9


def test_an_answer_that_chooses_nothing_counts_as_wrong(tmp_path: Path) -> None:
    write_set(tmp_path)
    _, rows = run(tmp_path, Oracle("I cannot see any images."))
    assert {(row["status"], row["correct"], row["detail"]) for row in rows} == {("no choice", False, "refused")}


class _Planted:
    def __reduce__(self) -> Any:
        return (print, ("run by a pickle",))


def test_a_pickle_that_runs_anything_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bad = tmp_path / "nuplan_metadata.pkl"
    bad.write_bytes(pickle.dumps({"token": {"cams": _Planted()}}))
    with pytest.raises(DataError, match=r"builtins\.print"):
        load_metadata(bad)
    assert capsys.readouterr().out == ""
    bad.write_bytes(pickle.dumps({"token": {"cams": {}}})[:-3])
    with pytest.raises(DataError, match="cannot be read"):
        load_metadata(bad)


def test_a_pickle_with_classes_of_nuplan_is_read_without_them(tmp_path: Path) -> None:
    good = tmp_path / "nuplan_metadata.pkl"
    # c<module>\n<name>\n, as pickle's first protocol names a class; then a call of it with one argument
    call = b"cnuplan.common.maps.maps_datatypes\nTrafficLightStatusType\n(I0\ntR"
    good.write_bytes(b"(S'token'\n(S'cams'\n(dS'traffic_light'\n" + call + b"dd.")
    assert load_metadata(good)["token"]["traffic_light"].given == (0,)


def test_the_papers_rows_stand_beside_ours() -> None:
    rows = [
        {"item": str(place), "chain": str(place), "question": str(place), "subtask": task, "frames": 5, "correct": True,
         "blind": place < 3}
        for place, task in enumerate(SUBTASKS)
    ]  # fmt: skip
    multi, single = (
        {line.name: line for line in published_lines(TABLE_VI, [row | {"frames": frames} for row in rows])}
        for frames in (5, 1)
    )
    assert len(multi) == len(single) == 9
    assert [round(100 * (one.value or 0.0), 1) for one in multi["BEV-LLM"].found] == [
        61.1, 89.4, 89.6, 80.0, 78.5, 75.5, 68.2, 74.1, 79.1, 83.2, 83.4, 81.9, 78.7,
    ]  # fmt: skip
    ours, blind = fill(TABLE_VI, rows).cells
    assert ours[-1] == "100.0" and blind[5] == "100.0" and blind[-1] == "33.3"
    assert fill(TABLE_VI, rows[:8]).cells[0][-1] == "n/a"


CAMS = {one: {"data_path": "x.jpg"} for one in CAMERAS}


@pytest.mark.parametrize(
    ("odd", "says"),
    [
        ({"cams": None}, "Missing view"),
        ({"cams": ["CAM_F0"]}, "Missing view"),
        ({"cams": dict.fromkeys(CAMERAS, "file.jpg")}, "Missing view"),
        ({"cams": {one: {"data_path": 3} for one in CAMERAS}}, "Missing view"),
        ({"cams": {one: {"data_path": "../../x.jpg"} for one in CAMERAS}}, "outside of the set"),
        ({"cams": {one: {"data_path": "/etc/passwd"} for one in CAMERAS}}, "outside of the set"),
        *(
            ({"cams": CAMS, "timestamp": now, "prev": "a"}, "time stamps")
            for now in ("noon", 5, 4, [], float("nan"), 10**400)
        ),
    ],
    ids=lambda one: str(one)[:12],
)
def test_metadata_of_another_shape_are_named(tmp_path: Path, odd: dict[str, Any], says: str) -> None:
    source = FrameSource(tmp_path, {"t": odd, "a": {"cams": CAMS, "timestamp": 5}})
    with pytest.raises(DataError, match=says):
        source.paths("t")
