"""The gallery's drives are real: a stored program on its scene, driven again, ends as its row says."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from chauffeur.bench.lampilot.rollout import RolloutJob, roll_out
from chauffeur.bench.report.build import Choices, build_report
from chauffeur.bench.report.model import Card
from chauffeur.concept import LAMPILOT_LIMITS, DataError, Scenario
from chauffeur.driving.recording import RecordedTrip
from chauffeur.worlds.highway.scenarios import BUILT_IN
from report_folders import outcome, read_lines, write, write_lines, write_run

STAY = """def stay():
    while True:
        yield autopilot()
"""
DYING = """def go():
    yield autopilot()
    x = 1 / 0
    yield autopilot()
"""


def _scene() -> Scenario:
    scenario = next(s for s in BUILT_IN if s.id == "overtake")
    return Scenario(
        "task0_s0", "highway", scenario.config, scenario.seed, {"type": "OvertakeEval", "direction": "left"}
    )


def _run(folder: Path, source: str, *, planner: str = "scripted", keep_scenes: bool = True) -> Path:
    """A run of one item that really happened: no overtaking."""
    scene = _scene()
    plan: dict[str, Any] = {
        "thoughts": {"text": "I stay behind."},
        "policy": {"source": source, "kind": "program"},
        "planner": planner,
        "model": "scripted-1",
        "usage": {},
    }
    baseline = planner if planner in ("idm", "mobil") else ""
    row = roll_out(RolloutJob("task0_s0_c0", scene, baseline, None if baseline else plan, LAMPILOT_LIMITS))
    drive = {name: value for name, value in row.items() if name not in ("key", "sample", "rollout")}
    write_run(folder, [[outcome() | drive]], planner=planner, command="Overtake the car.")
    stored = read_lines(folder / "plan.json")[0]
    if keep_scenes:
        write(folder / "plan.json", stored | {"samples": {scene.id: asdict(scene)}})
    write_lines(folder / "generate.jsonl", [{"item": "task0_s0_c0", "plan": None if baseline else plan, "error": ""}])
    return folder


def _failure(folder: Path, **choices: Any) -> Card:
    seen: list[tuple[int, int]] = []
    report = build_report([folder], Choices(**choices), lambda what, done, total: seen.append((done, total)))
    assert seen == [(1, 1)]
    (gallery,) = report.galleries
    assert (gallery.missed, gallery.items) == (1, 1)
    return gallery.cards[0]


def _driven(card: Card) -> tuple[RecordedTrip, str]:
    """The card's drive, driven again."""
    assert card.drive is not None
    drive, note = card.drive()
    assert drive is not None
    return drive, note


@pytest.mark.parametrize(("planner", "source"), [("scripted", STAY), ("scripted", DYING), ("idm", ""), ("mobil", "")])
def test_a_failure_is_driven_again_to_the_same_end(tmp_path: Path, planner: str, source: str) -> None:
    folder = _run(tmp_path / "run", source, planner=planner)
    row = read_lines(folder / "results.jsonl")[0]
    failure = _failure(folder)
    drive, note = _driven(failure)
    assert (failure.drive_note, note) == ("", "")
    assert len(drive.frames) == row["steps"] > 0
    assert drive.trip.outcome == row["outcome"]
    assert failure.goal.startswith("Be in the lane to the left")
    assert "highway" in drive.trip.context.text
    assert (failure.program is not None) == (planner == "scripted")
    assert failure.thoughts == ("I stay behind." if planner == "scripted" else "")
    if source == DYING:
        assert any("failed while it ran" in sentence for sentence in failure.why)


def test_a_drive_that_ends_otherwise_than_recorded_says_so(tmp_path: Path) -> None:
    folder = _run(tmp_path / "run", STAY)
    row = read_lines(folder / "results.jsonl")[0]
    write_lines(folder / "results.jsonl", [row | {"steps": row["steps"] - 7}])
    failure = _failure(folder)
    assert "it ended differently" in _driven(failure)[1]


def test_without_scenes_there_is_no_drive_and_the_report_says_what_to_do(tmp_path: Path) -> None:
    folder = _run(tmp_path / "run", STAY, keep_scenes=False)
    failure = _failure(folder)
    assert failure.drive is None
    assert "kept no scenes" in failure.drive_note and "--data" in failure.drive_note


def test_a_data_set_gives_the_scenes_of_an_old_run_and_a_foreign_one_is_refused(tmp_path: Path) -> None:
    import json

    from chauffeur.worlds.highway.dblv1 import load_dataset

    folder = _run(tmp_path / "run", STAY, keep_scenes=False)
    scene, data = _scene(), tmp_path / "data"
    data.mkdir()
    sample = {"env": scene.config, "eval": scene.goal, "seed": scene.seed}
    (data / "task0.json").write_text(json.dumps({"commands": ["Overtake the car."], "samples": [sample]}))
    with pytest.raises(DataError, match="is not the data set of scripted"):
        _failure(folder, data=data)
    row = read_lines(folder / "results.jsonl")[0]
    write_lines(folder / "results.jsonl", [row | {"data_sha256": load_dataset(data).sha256}])
    assert _failure(folder, data=data).drive is not None


def test_what_was_never_driven_is_shown_without_a_drive(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", [[outcome("refused", detail="I will not.")], [outcome("not_driven")]])
    report = build_report([folder], Choices(), lambda what, done, total: None)
    failures = report.galleries[0].cards
    assert [failure.drive for failure in failures] == [None, None]
    assert {failure.drive_note for failure in failures} == {"Nothing was driven."}
    assert "I will not." in failures[0].why


def test_plans_of_another_form_do_not_stop_a_report(tmp_path: Path) -> None:
    folder = _run(tmp_path / "run", STAY)
    write_lines(folder / "generate.jsonl", [{"item": "task0_s0_c0", "plan": {"thoughts": 3}, "error": ""}])
    failure = _failure(folder)
    assert failure.drive is not None and failure.program is None
    drive, note = failure.drive()
    assert drive is None
    assert "no program that" in note
