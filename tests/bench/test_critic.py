"""What critics say: a person's answers are read, and the evaluator's verdict is put into words that fit the drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from coached_data import GO_LEFT, IDLE

from chauffeur.bench.lampilot.coaching import Coach
from chauffeur.bench.lampilot.critic import Attempt, CriticJudgement, EvaluatorCritic, PersonCritic, evaluator_words
from chauffeur.bench.lampilot.seen import watch
from chauffeur.concept import LAMPILOT_LIMITS, Plan, PlanRequest, Program, Thoughts
from chauffeur.memory.policies import PolicyRepository
from chauffeur.worlds.highway.dblv1 import Item
from chauffeur.worlds.highway.scenarios import BUILT_IN

Drive = Callable[..., Attempt]

TO_THE_LEFT = GO_LEFT + "    while True:\n        yield autopilot()\n"
TAILGATE = IDLE.replace("    while", "    set_target_speed(39)\n    set_desired_time_headway(0.01)\n    while")
DYING = "def die():\n    yield autopilot()\n    x = 1 / 0\n    yield autopilot()\n"
SHORT = "def brief():\n    yield autopilot()\n"
TURN_RIGHT = """def turn():
    turn_right_at_next_intersection()
    for _ in range(300):
        recover_from_stop()
        yield autopilot()
"""
WAIT_LEFT = "def turn():\n    turn_left_at_next_intersection()\n    while True:\n        yield autopilot()\n"

LEFT_EXIT = ["il1", "o1", 0]


class Scripted:
    id = "scripted"
    model = "1"

    def __init__(self, source: str) -> None:
        self.source = source

    async def plan(self, request: PlanRequest) -> Plan:
        if not self.source:
            return Plan(Thoughts(""), None, refusal="I do not want to.")
        return Plan(Thoughts(""), Program(self.source))


@pytest.fixture
def drive(tmp_path: Path) -> Drive:
    """One attempt at a goal on a built-in scenario, driven for real."""

    def make(scenario: str, goal: dict[str, Any], source: str) -> Attempt:
        place = replace(next(s for s in BUILT_IN if s.id == scenario), goal=goal)
        attempts: list[Attempt] = []
        coach = Coach(
            tmp_path / f"run{len(list(tmp_path.iterdir()))}",
            Scripted(source),
            PolicyRepository(tmp_path / "policies", create=True),
            EvaluatorCritic(),
            LAMPILOT_LIMITS,
            rounds=1,
            tell=lambda event, value: attempts.append(value) if event == "attempt" else None,
        )
        coach.coach([Item(f"{scenario}_c0", scenario, "Do it.", place)])
        return attempts[0]

    return make


LEFT_LANE = {"type": "LaneChangeEval", "direction": "left"}
OVERTAKE = {"type": "OvertakeEval", "direction": "left"}
PULL_OVER = {"type": "PullOverEval"}
GO = {"type": "IntersectionEval", "direction": LEFT_EXIT}


@pytest.mark.parametrize(
    ("scenario", "goal", "source", "parts"),
    [
        ("overtake", LEFT_LANE, IDLE, ["Road or time ran out after", "The car never changed into the left lane."]),
        ("overtake", LEFT_LANE, SHORT, ["The program ended after 0.1 s"]),
        ("overtake", LEFT_LANE, DYING, ["The program failed while it ran", "ZeroDivisionError"]),
        ("overtake", LEFT_LANE, "", ["The wish was declined (I do not want to.)", "it can be tried here"]),
        ("overtake", LEFT_LANE, "def a():\n    fly()\n    yield\n", ["the checks refused it", "fly is not defined"]),
        ("overtake", OVERTAKE, IDLE, ["The car never changed into the left lane."]),
        ("following", {"type": "ACCEvalbySpeed", "speed": 12}, IDLE, ["The speed asked for is 12.0 m/s", "between"]),
        ("cruise", {"type": "ACCEvalbySpeed", "rel_speed": -8}, IDLE, ["never held it within 1 m/s"]),
        ("following", {"type": "ACCEvalbyDistance", "distance": 60}, TAILGATE, ["The distance asked for is 60.0 m"]),
        ("emergency-lane", PULL_OVER, IDLE, ["came to the end of the road", "never reached the emergency lane"]),
        ("quiet-intersection", GO, IDLE, ["The program chose no route; the wish is to go left.", "still stood"]),
        ("quiet-intersection", GO, TURN_RIGHT, ["chose the route right; the wish is to go left."]),
        ("quiet-intersection", GO, WAIT_LEFT, ["still stood in the end"]),
    ],
)  # fmt: skip
def test_the_evaluators_words_fit_the_drive(drive: Drive, scenario: str, goal: Any, source: str, parts: Any) -> None:
    attempt = drive(scenario, goal, source)
    assert not attempt.success
    judgement = EvaluatorCritic().judge(attempt)
    assert judgement.kind == "critique" and judgement.words == evaluator_words(attempt)
    for part in parts:
        assert part in judgement.words, judgement.words
    assert len(judgement.words) < 1000


def test_what_is_done_is_kept_without_a_word(drive: Drive) -> None:
    assert EvaluatorCritic().judge(drive("overtake", LEFT_LANE, TO_THE_LEFT)) == CriticJudgement("keep")


def test_a_wish_that_must_be_refused_is_praised_for_being_refused(drive: Drive) -> None:
    refused = drive("overtake", LEFT_LANE, "")
    unsafe = replace(
        refused, item=replace(refused.item, scenario=replace(refused.item.scenario, goal={"type": "RefuseEval"}))
    )
    assert EvaluatorCritic().judge(unsafe).kind == "skip"
    driven = drive("cruise", LEFT_LANE, IDLE)
    driven = replace(driven, item=unsafe.item)
    assert "must not be driven" in EvaluatorCritic().judge(driven).words


def test_a_crash_is_told_with_whom(drive: Drive) -> None:
    attempt = drive("overtake", LEFT_LANE, IDLE)
    frames = attempt.recorded.frames
    other = replace(frames[-1].observation.others[0], crashed=True)
    ego = frames[-1].observation.ego
    for ahead, right, who in ((5.0, 0.0, "the car ahead of it"), (-5.0, 0.0, "ran into it"), (1.0, 3.0, "on its right"),
                              (1.0, -3.0, "on its left")):  # fmt: skip
        at = replace(other, x_m=ego.x_m + ahead, y_m=ego.y_m - right)
        final = replace(frames[-1].observation, ego=replace(ego, crashed=True, heading_rad=0.0), others=(at,))
        crashed = replace(
            attempt.recorded, final=final, trip=replace(attempt.recorded.trip, outcome="collision", duration_s=12.3)
        )
        words = evaluator_words(replace(attempt, recorded=crashed))
        assert words.startswith("The car crashed after 12.3 s") and who in words.split(".")[2], words


def test_what_is_seen_is_what_was_driven(drive: Drive) -> None:
    attempt = drive("overtake", LEFT_LANE, TO_THE_LEFT)
    seen = watch(attempt.recorded)
    assert seen is not None
    assert [move.side for move in seen.moves] == ["left"] and seen.side == -1
    assert len(seen.speeds_mps) == len(attempt.recorded.frames) + 1
    halted = watch(drive("quiet-intersection", GO, WAIT_LEFT).recorded)
    assert halted is not None and halted.stopped_s is not None and halted.emergency_s is None
    assert watch(drive("overtake", LEFT_LANE, "").recorded) is None


def answers(*given: str | None) -> PersonCritic:
    left = iter(given)
    return PersonCritic(lambda question: next(left))


def test_a_persons_answers(drive: Drive) -> None:
    done, undone = drive("overtake", LEFT_LANE, TO_THE_LEFT), drive("cruise", LEFT_LANE, SHORT)
    refused = drive("left-lane", LEFT_LANE | {"direction": "right"}, "def a():\n    fly()\n    yield\n")
    assert answers("Success.").judge(done).kind == "keep"
    assert answers("success", "commit").judge(undone).kind == "keep"
    assert answers("skip").judge(done).kind == "skip"
    assert answers("quit").judge(done).kind == answers(None).judge(done).kind == "stop"
    assert answers("", "  too   late ").judge(done) == CriticJudgement("critique", "too late")
    assert answers("commit", "skip").judge(refused).kind == "skip", "what was not driven cannot be kept"
    passed_on = answers("").judge(refused)
    assert passed_on.kind == "critique" and "fly is not defined" in passed_on.words
    crashed = replace(done, recorded=replace(done.recorded, trip=replace(done.recorded.trip, outcome="collision")))
    assert answers("commit", "success", "you crashed").judge(crashed) == CriticJudgement("critique", "you crashed")
