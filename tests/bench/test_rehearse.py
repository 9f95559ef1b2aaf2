"""Rehearsal on the benchmark: the judge agrees with the ruler, and what it breaks off could not have won."""

from __future__ import annotations

from pathlib import Path

import pytest

from chauffeur.bench.lampilot.expert import expert_program, variants
from chauffeur.bench.lampilot.rehearse import OriginJudge, candidates, rehearsed
from chauffeur.concept import Metric, Outcome, Scenario
from chauffeur.driving.episode import drive_program
from chauffeur.driving.judge.lampilot import LampilotReferee
from chauffeur.driving.judge.metrics import points
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import load_dataset

RUSH = "def drive():\n    go_straight_at_next_intersection()\n    set_target_speed(15.0)\n    yield autopilot()\n"
IDLE = "def drive():\n    while True:\n        yield autopilot()\n"


class Both:
    """The referee and the rehearsal's judge on the same trip; notes every ceiling."""

    def __init__(self, world: HighwayWorld, scenario: Scenario) -> None:
        self.referee = LampilotReferee(world, scenario)
        self.judge = OriginJudge(world.perception(), scenario)
        self.ceilings: list[float] = []

    def observe(self) -> None:
        self.referee.observe()
        self.judge.observe()
        self.ceilings.append(self.judge.ceiling)

    @property
    def over(self) -> bool:
        assert self.referee.over == self.judge.over
        return self.judge.over

    @property
    def success(self) -> bool:
        assert self.referee.success == self.judge.success
        return self.judge.success

    def outcome(self) -> Outcome:
        return self.referee.outcome()

    def metrics(self) -> tuple[Metric, ...]:
        return ()


def sample(folder: Path, name: str) -> Scenario:
    found = load_dataset(folder / "DbLv1-dev").scenario(name)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("name", "program"),
    [
        ("dec_abs_dis15_s1", ""),
        ("inc_rel_dis8_s0", ""),
        ("dec_abs_speed10_s0", ""),
        ("inc_rel_speed3_s0", IDLE),
        ("left_overtake_s1", ""),
        ("pull_over_s2", IDLE),
        ("turn_right_s4", ""),
        ("go_straight_s3", RUSH),
    ],
)
def test_worth_is_the_rulers_score_and_no_ceiling_was_below_it(lampilot_data: Path, name: str, program: str) -> None:
    scenario = sample(lampilot_data, name)
    world = HighwayWorld()
    world.reset(scenario)
    both = Both(world, scenario)
    episode = drive_program(world, program or expert_program(scenario.goal), both, 70.0, record=False)
    row = points({"success": episode.success, "signals": both.referee.signals().as_row()}, "origin")
    assert both.judge.collided == row["collision"]
    assert both.judge.worth == pytest.approx(row["score"] - 500.0 * row["collision"], abs=1e-6)
    assert min(both.ceilings) >= row["score"] - 1e-6
    assert all(later <= earlier + 1e-9 for earlier, later in zip(both.ceilings, both.ceilings[1:], strict=False))


def test_the_choice_is_as_good_as_it_was_rehearsed_and_better_than_the_program_alone(lampilot_data: Path) -> None:
    scenario = sample(lampilot_data, "go_straight_s4")
    world = HighwayWorld()
    world.reset(scenario)
    choice = rehearsed(world, scenario, variants(scenario.goal, 8, seed=0))
    referee = LampilotReferee(world, scenario)
    episode = drive_program(world, choice.source, referee, 120.0, record=False)
    score = points({"success": episode.success, "signals": referee.signals().as_row()}, "origin")["score"]
    assert score == pytest.approx(choice.rollouts[choice.index].worth, abs=1e-6)
    assert score > choice.rollouts[0].worth


def test_a_program_that_leaves_the_road_is_not_chosen(lampilot_data: Path) -> None:
    scenario = sample(lampilot_data, "pull_over_s0")
    world = HighwayWorld()
    world.reset(scenario)
    choice = rehearsed(world, scenario, [IDLE, expert_program(scenario.goal)])
    assert choice.rollouts[0].collided
    assert choice.index == 1


def test_a_planners_own_program_is_varied_and_the_expert_stands_in_where_there_is_none(lampilot_data: Path) -> None:
    goal = sample(lampilot_data, "left_lc_s0").goal
    assert candidates(goal, 4, 0) == variants(goal, 4, 0)
    texts = candidates(goal, 4, 0, "def drive():\n    set_target_speed(25.0)\n    yield autopilot()\n")
    assert len(texts) == 4
    assert all("get_left_lane" not in text for text in texts)
