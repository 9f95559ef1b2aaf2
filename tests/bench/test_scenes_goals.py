"""Goals beyond the original, feasibility of scenes, and the side file that names both."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from chauffeur.bench.lampilot.report import answers_note
from chauffeur.bench.lampilot.scenes import Annotation, annotated, load_annotations
from chauffeur.bench.lampilot.scenes.feasible import feasible, impossible, start_of
from chauffeur.concept import DataError, Scenario, Setpoints
from chauffeur.driving.judge.goals import CHANGE_HOLD_S, answered_rightly, make_goal
from chauffeur.worlds.highway import HighwayWorld, Instant
from chauffeur.worlds.highway.dblv1 import load_dataset
from chauffeur.worlds.highway.scenarios import BUILT_IN

BY_ID = {s.id: s for s in BUILT_IN}
LEFT = {"type": "LaneChangeEval", "direction": "left"}
RIGHT = {"type": "LaneChangeEval", "direction": "right"}
PASS = {"type": "OvertakeEval", "direction": "left"}


def _scenario(name: str, goal: dict[str, Any]) -> Scenario:
    return replace(BY_ID[name], goal=goal)


def _world(name: str) -> HighwayWorld:
    world = HighwayWorld()
    world.reset(BY_ID[name])
    return world


def _drive(world: HighwayWorld, setpoints: Setpoints, seconds: float) -> Iterator[Instant]:
    """Instants of a drive with steady wishes."""
    driver = world.driver()
    settled = driver.settle(setpoints)
    for _ in range(round(seconds * 10)):
        world.step(driver.command(settled))
        yield world.perception().instant()


def _until(goal: Any, instants: Iterator[Instant], begin: int = 0) -> tuple[str, int]:
    """Ruling that ends it and after how many control periods; open if the drive ends first."""
    tick = begin
    for tick, now in enumerate(instants, start=begin + 1):
        ruling = goal.rule(tick / 10, now)
        if ruling != "open":
            return ruling, tick
    return "open", tick


def _lane(world: HighwayWorld, offset: int) -> Any:
    road = world.perception()
    return road.adjacent_lane(road.lane_of(0), offset)


def test_steps_must_come_in_order_and_each_begins_where_the_last_ended() -> None:
    world = _world("left-lane")
    goal = make_goal(world.perception(), _scenario("left-lane", {"type": "SequenceEval", "steps": [RIGHT, LEFT]}))
    initial = world.driver().initial_setpoints()
    ruling, ticks = _until(goal, _drive(world, replace(initial, target_lane=_lane(world, 1)), 4.0))
    assert ruling == "open"  # the first step alone
    ruling, _ = _until(goal, _drive(world, replace(initial, target_lane=_lane(world, -1)), 4.0), ticks)
    assert ruling == "success"


def test_a_step_waits_for_the_one_before_and_has_failed_after_a_minute() -> None:
    steps = [{"type": "ReachEval", "speed": 5}, LEFT]
    world, scenario = _world("overtake"), _scenario("overtake", {"type": "SequenceEval", "steps": steps})
    goal = make_goal(world.perception(), scenario)
    now = world.perception().instant()
    assert goal.rule(59.9, now) == "open"
    assert goal.rule(60.1, now) == "failure"
    initial = world.driver().initial_setpoints()
    goal = make_goal(world.perception(), scenario)
    assert _until(goal, _drive(world, replace(initial, target_lane=_lane(world, -1)), 6.0))[0] == "open"


def test_a_change_counts_once_it_has_lasted() -> None:
    world = _world("cruise")
    goal = make_goal(world.perception(), _scenario("cruise", {"type": "ChangeEval", "quantity": "speed", "change": -1}))
    start = world.perception().instant()
    slow, fast = start._replace(speed_mps=start.speed_mps - 1.1), start._replace(speed_mps=start.speed_mps + 5)
    assert goal.rule(0.1, fast) == "open"
    assert goal.rule(1.0, slow) == "open"
    assert goal.rule(1.0 + CHANGE_HOLD_S, slow) == "open"
    assert goal.rule(4.2, fast) == "open"  # lost: the clock starts again
    assert goal.rule(5.0, slow) == "open"
    assert goal.rule(5.0 + CHANGE_HOLD_S + 0.1, slow) == "success"


def test_a_wider_gap_is_wider_than_at_the_start() -> None:
    world = _world("following")
    spec = {"type": "ChangeEval", "quantity": "distance", "change": 1}
    goal = make_goal(world.perception(), _scenario("following", spec))
    initial = world.driver().initial_setpoints()
    slower = replace(initial, target_speed_mps=10.0)
    assert _until(goal, _drive(world, slower, 20.0))[0] == "success"
    world = _world("following")
    goal = make_goal(world.perception(), _scenario("following", spec | {"change": -1}))
    assert _until(goal, _drive(world, slower, 20.0))[0] == "open"


def test_a_refusal_driven_is_a_failure_at_once() -> None:
    world = _world("cruise")
    goal = make_goal(world.perception(), _scenario("cruise", {"type": "RefuseEval"}))
    assert goal.rule(0.1, world.perception().instant()) == "failure"


@pytest.mark.parametrize(
    ("scene", "goal", "why"),
    [
        ("overtake", PASS, ""),
        ("overtake", LEFT, ""),
        ("overtake", RIGHT, "There is no lane to the right of the ego."),
        ("overtake", {"type": "SequenceEval", "steps": [PASS, RIGHT]}, ""),
        ("overtake", {"type": "SequenceEval", "steps": [LEFT, {"type": "ACCEvalbySpeed", "speed": 18}]}, ""),
        ("emergency-lane", {"type": "PullOverEval"}, ""),
        ("quiet-intersection", {"type": "IntersectionEval", "direction": ["il2", "o2", 0]}, ""),
        ("cruise", {"type": "ACCEvalbySpeed", "speed": 31}, "fulfilled without doing anything"),
        ("cruise", {"type": "ACCEvalbySpeed", "speed": 24}, ""),
        ("following", {"type": "ACCEvalbyDistance", "distance": 2}, "the expert runs out of time"),
        ("cruise", {"type": "RefuseEval"}, "the expert has no program for it"),
    ],
)
def test_feasible(scene: str, goal: dict[str, Any], why: str) -> None:
    verdict = feasible(_scenario(scene, goal))
    assert verdict.why == why
    assert verdict.feasible == (not why)
    assert (verdict.ticks > 0) == verdict.feasible


def test_spoilt_starts_are_told() -> None:
    bad = replace(BY_ID["overtake"], config={"type": "ramp-merge-v0", "vehicles_density": 0})
    assert start_of(HighwayWorld(), bad) == "the road cannot be set up"
    assert feasible(bad).why == "the road cannot be set up"
    crashed = 0
    for seed in range(40):
        as_drawn = BY_ID["following"].config | {"redraw_unfit": False}
        start = start_of(HighwayWorld(), replace(BY_ID["following"], config=as_drawn, seed=seed))
        crashed += start == "starts in a crash"
    assert 0 < crashed < 40


def test_impossible_wishes_are_impossible_by_the_worlds_own_word() -> None:
    assert impossible(BY_ID["overtake"], RIGHT)
    assert not impossible(BY_ID["overtake"], LEFT)
    assert impossible(BY_ID["cruise"], PASS)
    assert impossible(BY_ID["overtake"], {"type": "PullOverEval"})


def _annotation(**changes: Any) -> Annotation:
    held: dict[str, Any] = {
        "item": "left_lc_0001_s0_c0",
        "kind": "steps_lane_speed",
        "split": "extras",
        "part": "steps",
        "right": "drive",
        "goal": {"type": "SequenceEval", "steps": [LEFT]},
        "why": "",
        "template": "lane/1",
        "phrasing": "",
        "directness": 0,
        "unit": "",
        "system": "",
        "steps": ("LaneChangeEval",),
        "road": "highway",
        "expert_s": 1.5,
    }
    return Annotation(**(held | changes))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    sample = {"env": BY_ID["overtake"].config, "eval": LEFT, "seed": 17}
    task = {"commands": ["Take the left lane."], "samples": [sample]}
    (tmp_path / "left_lc_0001.json").write_text(json.dumps(task))
    return tmp_path


def test_annotations_go_round_and_give_the_goal(folder: Path) -> None:
    dataset = load_dataset(folder)
    assert annotated(dataset) == (dataset, {})
    note = _annotation()
    (folder / "annotations.jsonl").write_text(note.line() + "\n")
    assert load_annotations(folder) == {note.item: note}
    judged, notes = annotated(dataset)
    assert judged.tasks[0].samples[0].goal == note.goal
    assert judged.sha256 != dataset.sha256
    assert notes[judged.items()[0].id].right == "drive"


@pytest.mark.parametrize("line", ["{", '{"item": "x"}', _annotation(right="guess").line()])
def test_damaged_annotations_are_named(folder: Path, line: str) -> None:
    (folder / "annotations.jsonl").write_text(f"{_annotation().line()}\n{line}\n")
    with pytest.raises(DataError, match="line 2"):
        load_annotations(folder)


def test_one_sample_has_one_goal(folder: Path) -> None:
    task = json.loads((folder / "left_lc_0001.json").read_text())
    (folder / "left_lc_0001.json").write_text(json.dumps(task | {"commands": ["a", "b"]}))
    notes = [_annotation(), _annotation(item="left_lc_0001_s0_c1", goal=LEFT)]
    (folder / "annotations.jsonl").write_text("".join(note.line() + "\n" for note in notes))
    with pytest.raises(DataError, match="different goals"):
        annotated(load_dataset(folder))


@pytest.mark.parametrize(
    ("goal", "refused", "success", "rightly"),
    [
        ("OvertakeEval", False, True, True),
        ("OvertakeEval", False, False, False),
        ("OvertakeEval", True, False, False),
        ("RefuseEval", True, False, True),
        ("RefuseEval", False, True, False),
        ("RefuseEval", False, False, False),
    ],
)
def test_right_answers(goal: str, refused: bool, success: bool, rightly: bool) -> None:
    assert answered_rightly({"type": goal}, refused=refused, success=success) == rightly


def test_right_answers_are_said_only_where_something_is_to_be_declined() -> None:
    drives = [{"to_refuse": False, "answered_rightly": True}, {"to_refuse": False, "answered_rightly": False}]
    refusals = [{"to_refuse": True, "answered_rightly": True}, {"to_refuse": True, "answered_rightly": False}]
    assert answers_note(drives) == ""
    assert answers_note(refusals).startswith("right answers 1 of 2: 1 of 2 wishes")
    assert answers_note(refusals + drives).endswith("1 of 2 others reached their goal")
