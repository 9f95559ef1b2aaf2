"""Recorded answers, played back."""

from __future__ import annotations

import asyncio
import json
from dataclasses import asdict, replace

import pytest
from server import PROGRAM, REPLY

from chauffeur.concept import (
    ActionMatrix,
    DataError,
    Feedback,
    History,
    HistoryItem,
    Limits,
    Parameters,
    Plan,
    PlannerError,
    Program,
    Round,
    Thoughts,
    Trajectory,
    Usage,
)
from chauffeur.planners import Planner, make_planner
from chauffeur.planners.replay import ReplayPlanner, request_key

PLAN = Plan(
    Thoughts("because é"), Program(PROGRAM), intent="speed.hold", settings=(("target_speed_mps", 25.0),),
    planner="fake", model="fake-1", usage=Usage(10, 5, 0.5, 2), latency_s=1.5, raw=REPLY,
)  # fmt: skip


def record(path, request, plan: Plan) -> None:
    """Add a line that answers exactly this request."""
    line = {"version": 1, "request": request_key(request), "instruction": request.instruction.text}
    with path.open("a") as file:
        file.write(json.dumps(line | {"plan": asdict(plan)}) + "\n")


def play(planner: Planner, request) -> Plan:
    return asyncio.run(planner.plan(request))


@pytest.mark.parametrize(
    "policy",
    [
        Program(PROGRAM),
        Program(PROGRAM, library="def helper():\n    yield autopilot()\n"),
        None,
        Parameters(20.0, 5.0, 0.4, -1),
        ActionMatrix((1.0, 0.0, 0.1), (1.0, 2.0, 3.0)),
        Trajectory(((1.0, 0.0), (2.0, 0.5)), 0.5),
    ],
)
def test_a_recorded_plan_comes_back(tmp_path, make_request, policy):
    plan = replace(PLAN, policy=policy, refusal="" if policy else "no")
    path = tmp_path / "run.jsonl"
    record(path, make_request("go"), plan)
    replayed = make_planner(f"replay/{path}")
    assert replayed.id == "replay/run.jsonl" and replayed.model.startswith("sha256:")
    back = play(replayed, make_request("go"))
    assert back == replace(plan, planner=replayed.id, usage=Usage(10, 5, 0.0, 0, cached=True), latency_s=0.0)
    assert play(replayed, make_request("go")) == back


def test_the_exact_request_wins_over_the_words(tmp_path, make_request):
    path = tmp_path / "run.jsonl"
    near, far = make_request("go"), make_request("go", limits=Limits(max_speed_mps=10.0))
    record(path, near, replace(PLAN, intent="near"))
    record(path, far, replace(PLAN, intent="far"))
    planner = ReplayPlanner(path)
    assert play(planner, near).intent == "near"
    assert play(planner, far).intent == "far"
    assert play(planner, make_request("  GO ", limits=Limits(name="other"))).intent == "far"


def test_rounds_are_told_apart(tmp_path, make_request):
    path = tmp_path / "run.jsonl"
    lines = [{"version": 1, "instruction": "go", "round": n, "reply": f"REFUSE: answer {n}"} for n in (0, 1)]
    path.write_text("\n".join(json.dumps(line) for line in lines) + "\n\n")
    planner = ReplayPlanner(path)
    assert play(planner, make_request("go")).refusal == "answer 0"
    assert play(planner, make_request("go", rounds=(Round("p", "f"),))).refusal == "answer 1"
    with pytest.raises(PlannerError, match="round 2"):
        play(planner, make_request("go", rounds=(Round("p", "f"),) * 2))


def test_a_recording_written_by_hand(tmp_path, make_request):
    path = tmp_path / "run.jsonl"
    path.write_text(json.dumps({"version": 1, "instruction": "go", "reply": REPLY}))
    plan = play(ReplayPlanner(path), make_request("go"))
    assert (plan.policy, plan.thoughts.text, plan.raw) == (Program(PROGRAM), "Hold 25 m/s.", REPLY)
    assert plan.model == ReplayPlanner(path).model


def test_what_was_not_recorded_is_an_error_with_a_remedy(tmp_path, make_request):
    path = tmp_path / "run.jsonl"
    path.write_text("")
    with pytest.raises(PlannerError, match="Write a line for it"):
        play(ReplayPlanner(path), make_request("go"))


@pytest.mark.parametrize(
    "line",
    ["{", "[]", "5", "null", "{}", '{"version": 2}', '{"version": 1, "instruction": "x"}', "\ufffd",
     '{"version": 1, "instruction": "x", "plan": {}}', '{"version": 1, "instruction": "x", "plan": {"thoughts": 5}}',
     '{"version": 1, "instruction": "x", "plan": {"thoughts": {"text": ""}, "policy": {"kind": "magic"}}}',
     '{"version": 1, "instruction": "x", "plan": {"thoughts": {"text": ""}, "policy": null, "more": 1}}'],
)  # fmt: skip
def test_a_bad_line_is_named(tmp_path, line):
    path = tmp_path / "run.jsonl"
    path.write_text(json.dumps({"version": 1, "instruction": "go", "reply": REPLY}) + f"\n{line}\n")
    with pytest.raises(DataError, match="Line 2"):
        ReplayPlanner(path)


def test_a_missing_recording(tmp_path):
    with pytest.raises(DataError, match="cannot be read"):
        make_planner(f"replay/{tmp_path}/none.jsonl")
    with pytest.raises(DataError):
        make_planner("replay")


def test_the_hash_covers_the_whole_request(make_request):
    base = make_request("go")
    item = HistoryItem("t", "w", "i", "c", "highway", "", "", "", feedback=(Feedback("f"),))
    others = [
        make_request("stop"),
        make_request("go", history=History((item,))),
        make_request("go", rounds=(Round("p", "f"),)),
        make_request("go", limits=Limits(max_speed_mps=1.0)),
        replace(base, system=replace(base.system, text="else")),
        replace(base, context=replace(base.context, text="else")),
    ]
    keys = {request_key(request) for request in [base, *others]}
    assert len(keys) == 7 and request_key(make_request("go")) in keys
