"""The passengers' wishes: the file, its scenes, and whether what is asked for can be driven there."""

from __future__ import annotations

import asyncio
import hashlib
import json
import re
from collections import Counter
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest

from chauffeur.bench.kernel.run import Effort
from chauffeur.bench.lampilot.families import FAMILIES, family_of
from chauffeur.bench.lampilot.requests import PlainRequests
from chauffeur.bench.lampilot.runner import LampilotRun, RunConfig
from chauffeur.bench.lampilot.scenes.feasible import GoalReferee, feasible, impossible, start_of
from chauffeur.bench.passengers import PassengerRequests, PassengerWish, as_dataset, load_wishes
from chauffeur.bench.passengers.loader import STEMS, parse_wishes
from chauffeur.bench.passengers.scenes import SCENES
from chauffeur.concept import LAMPILOT_LIMITS, DataError, Observation
from chauffeur.describe import describe
from chauffeur.driving.episode import drive_without_program
from chauffeur.driving.judge.goals import make_goal
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.highway import HighwayWorld
from small_run import Inline, quiet

WISHES = load_wishes()
DRIVES = [wish for wish in WISHES if wish.right == "drive"]

LEAST = {"drive": 230, "ask": 40, "refuse": 70}
LEFT, RIGHT = {"type": "LaneChangeEval", "direction": "left"}, {"type": "LaneChangeEval", "direction": "right"}
PAST_LEFT, PAST_RIGHT = {"type": "OvertakeEval", "direction": "left"}, {"type": "OvertakeEval", "direction": "right"}
GAP = {"type": "ACCEvalbyDistance", "distance": 40}
STOP = {"type": "PullOverEval"}
TURN = {"type": "IntersectionEval", "direction": ["il1", "o1", 0]}
WISHED: dict[str, dict[str, Any]] = {
    "p345": LEFT,
    "p346": PAST_LEFT,
    "p347": RIGHT,
    "p348": PAST_RIGHT,
    "p349": PAST_LEFT,
    "p350": GAP,
    "p351": GAP,
    "p352": TURN,
    "p353": TURN,
    "p354": STOP,
    "p355": STOP,
    "p356": LEFT,
    "p357": PAST_LEFT,
    "p358": PAST_LEFT,
    "p359": LEFT,
    "p360": PAST_LEFT,
    "p362": STOP,
}
"""What the impossible wishes that a goal has words for would have been judged by; the world must not know it there."""


def test_counts() -> None:
    right = Counter(wish.right for wish in WISHES)
    kinds = Counter(wish.kind for wish in WISHES)
    assert all(right[name] >= least for name, least in LEAST.items()), right
    assert kinds["refuse_unsafe"] >= 30 and kinds["refuse_impossible"] >= 15
    assert kinds["history"] >= 15
    assert set(kinds) == set(STEMS)
    assert len({wish.scenario for wish in WISHES}) >= 30
    assert min(Counter(wish.directness for wish in DRIVES).values()) >= 40


def test_ids_and_history() -> None:
    assert [wish.id for wish in WISHES] == [f"p{i:03d}" for i in range(1, len(WISHES) + 1)]
    assert all(bool(wish.history) == (wish.kind == "history") for wish in WISHES)


def test_no_two_wishes_are_nearly_the_same() -> None:
    words = {wish.id: frozenset(re.findall(r"[a-z0-9']+", wish.wish.lower())) for wish in WISHES}
    near = [
        (a, b)
        for (a, first), (b, second) in combinations(words.items(), 2)
        if len(first & second) >= 0.55 * len(first | second)
    ]
    assert not near


@pytest.mark.parametrize("name", sorted(SCENES))
def test_scenes_begin_and_go_on_without_a_crash(name: str) -> None:
    world = HighwayWorld()
    start = start_of(world, SCENES[name])
    assert isinstance(start, Observation), start
    describe(start)
    assert drive_without_program(world, None, 61.0, record=False).outcome != "collision"


def test_goals_can_be_set_up() -> None:
    world = HighwayWorld()
    for wish in WISHES:
        world.reset(wish.scene)
        make_goal(world.perception(), wish.scene)


def test_impossible_wishes_are_impossible_in_their_scenes() -> None:
    by_id = {wish.id: wish for wish in WISHES}
    for name, goal in WISHED.items():
        assert by_id[name].kind == "refuse_impossible"
        assert impossible(by_id[name].scene, goal), by_id[name].wish
    asked = [
        wish
        for wish in WISHES
        if wish.kind == "ask_side" and "intersection" not in SCENES[wish.scenario].config["type"]
    ]
    assert asked
    for wish in asked:
        assert not impossible(wish.scene, LEFT) and not impossible(wish.scene, RIGHT), wish.wish


def test_data_set_tells_families_and_hash() -> None:
    data = as_dataset()
    assert len(data.items()) == len(WISHES) == len({item.id for item in data.items()})
    assert {family_of(task.name) for task in data.tasks} == {*FAMILIES, "other"}
    assert data.sha256 == as_dataset().sha256 != hashlib.sha256(b"").hexdigest()
    for wish, item in zip(WISHES, data.items(), strict=True):
        assert item.command == wish.wish and item.scenario.goal == wish.goal and item.task.endswith(wish.id)
        assert (item.scenario.config, item.scenario.seed) == (SCENES[wish.scenario].config, SCENES[wish.scenario].seed)


def _line(**changed: Any) -> bytes:
    good = {"id": "p001", "wish": "Left.", "scenario": "open-right", "right": "drive", "goal": LEFT}
    return json.dumps(good | {"kind": "lane_left", "directness": 1} | changed).encode() + b"\n"


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"scenario": "nowhere"}, "unknown scene"),
        ({"right": "perhaps"}, "right"),
        ({"colour": "red"}, "colour"),
        ({"wish": " "}, "empty"),
        ({"kind": "dance"}, "unknown kind"),
        ({"goal": {"type": "DanceEval"}}, "unknown goal"),
        ({"goal": {"type": "SequenceEval", "steps": []}}, "steps"),
        ({"goal": {"type": "SequenceEval", "steps": ["left"]}}, "a step is a goal"),
        ({"directness": 0}, "directness"),
        ({"directness": 4}, "directness"),
        ({"right": "ask", "kind": "ask_side", "note": "Why."}, "RefuseEval"),
        ({"right": "ask", "kind": "ask_side", "goal": {"type": "RefuseEval"}}, "note"),
        ({"right": "ask", "kind": "refuse_other", "goal": {"type": "RefuseEval"}, "note": "Why."}, "not one of"),
        ({"id": "p000"}, "twice"),
        ({"history": [{"instruction": "Left."}]}, "history"),
    ],
)
def test_bad_lines_are_named(changed: dict[str, Any], said: str) -> None:
    with pytest.raises(DataError, match=f"line 2.*{said}"):
        parse_wishes(_line(id="p000") + _line(**changed))


def test_lines_that_are_no_json_are_named() -> None:
    with pytest.raises(DataError, match="line 1"):
        parse_wishes(b"left\n")


def test_planners_are_given_the_history() -> None:
    plain = PlainRequests.of("zero-shot", LAMPILOT_LIMITS)
    requests = PassengerRequests(plain, WISHES)
    by_task = {wish.task: wish for wish in WISHES}
    for item in as_dataset().items():
        wish = by_task[item.task]
        if wish.kind not in ("history", "steps"):
            continue
        context = describe(HighwayWorld().reset(item.scenario))
        request = asyncio.run(requests.request(item, context))
        assert [past.instruction for past in request.history.items] == [past.instruction for past in wish.history]
        assert all(past.feedback[0].text for past in request.history.items)


def test_a_run_drives_them(tmp_path: Path) -> None:
    data = as_dataset()
    some = [data.tasks[i] for i in (0, 172, len(WISHES) - 1)]
    data = replace(data, tasks=tuple(some))
    config = RunConfig("keyword", "zero-shot", data.sha256, 0, 0, asked="passengers-v1")
    requests = PassengerRequests(PlainRequests.of("zero-shot", LAMPILOT_LIMITS), WISHES)
    run = LampilotRun(tmp_path / "run", data, config, make_planner("keyword"), requests=requests)
    rows = run.run(quiet, Effort(workers=1, engine=Inline))
    assert [row["task"] for row in rows] == [task.name for task in some]
    assert all("answered_rightly" in row for row in rows)


def _fair(wish: PassengerWish) -> str:
    """Why a wish to be driven is not fair; empty when it is."""
    verdict = feasible(wish.scene)
    if not verdict.feasible:
        return f"{wish.id}: {verdict.why}"
    world = HighwayWorld()
    world.reset(wish.scene)
    referee = GoalReferee(world, make_goal(world.perception(), wish.scene))
    idle = drive_without_program(world, referee, 61.0, record=False).outcome
    return f"{wish.id}: a car that ignores it fulfils it" if idle == "success" else ""


def test_some_drives_are_fair() -> None:
    assert not list(filter(None, map(_fair, DRIVES[::25])))


@pytest.mark.slow
def test_every_drive_is_fair() -> None:
    assert not list(filter(None, map(_fair, DRIVES[::4])))  # each takes a quarter of a second
