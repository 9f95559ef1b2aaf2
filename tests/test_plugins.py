"""Toy plug-ins of every kind, in new files and entry points alone.

`tests/bench/test_kernel.py` runs the benchmark of questions, `tests/worlds/test_conformance.py` checks the world.
"""

from __future__ import annotations

import asyncio
import importlib
import re
import shlex
import tomllib
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from chauffeur.cli.main import app
from chauffeur.concept import (
    CameraImage,
    Instruction,
    Limits,
    Observation,
    Plan,
    Policy,
    Scenario,
    ScenarioError,
    SystemMessage,
    Thoughts,
    Trip,
)
from chauffeur.concept.registry import load_plugin
from chauffeur.describe import describe
from chauffeur.driving.episode import drive_policy, make_world
from chauffeur.driving.loop import drive, steps_at
from chauffeur.driving.planning import Planned, declined
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Forgetful, check_drive
from chauffeur.driving.trips import make_trip
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.safety.checks import DRIVE_CHECKS, run_checks

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
POINTS = """[chauffeur.worlds]
one-lane = one_lane:OneLane
[chauffeur.executors]
speed-profile = speed_profile:SpeedProfileExecutor
unvouched = one_lane:OneLane
[chauffeur.planners]
lookout = lookout:Lookout
[chauffeur.benchmarks]
right-of-way = right_of_way:RightOfWay
[chauffeur.checks]
people-first = people_first:check_people_first
[chauffeur.commands]
lanes = lanes:lanes
"""
PLACE = Scenario("road", "one-lane", {}, 3)


def installed(folder: Path, monkeypatch: pytest.MonkeyPatch, points: str) -> None:
    """Make a folder a place where a package with these entry points is installed."""
    meta = folder / "toys-1.0.dist-info"
    meta.mkdir()
    (meta / "METADATA").write_text("Metadata-Version: 2.1\nName: toys\nVersion: 1.0\n")
    (meta / "entry_points.txt").write_text(points)
    monkeypatch.syspath_prepend(str(folder))


@pytest.fixture
def toys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The examples, installed as a package of somebody else's; the policy kind's module."""
    installed(tmp_path, monkeypatch, POINTS)
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return importlib.import_module("speed_profile")


def planned(policy: Any) -> Plan:
    return Plan(Thoughts("As a stranger's planner would."), policy, planner="stranger")


def test_each_toy_is_found_by_its_name_and_is_short(toys: ModuleType) -> None:
    for line in POINTS.splitlines():
        if "=" in line:
            name, _, module = (part.strip() for part in line.partition("="))
            path = EXAMPLES / f"{module.partition(':')[0]}.py"
            assert len(path.read_text(encoding="utf-8").splitlines()) < 80, name
    assert make_planner("lookout").id == "lookout"
    assert make_world(PLACE).engine == "one lane 1"
    assert load_plugin("chauffeur.benchmarks", "right-of-way").id == "right-of-way-v1"


@pytest.mark.parametrize("scenario", [PLACE, Scenario("road", "highway", {}, 3)], ids=["one-lane", "highway"])
def test_a_policy_kind_of_ones_own_is_checked_bounded_and_driven(toys: ModuleType, scenario: Scenario) -> None:
    scenario = find("cruise") if scenario.world == "highway" else scenario
    world = make_world(scenario)
    start = world.reset(scenario)
    policy = toys.SpeedProfile((18.0, 19.0, 17.0), 2.0)
    assert not any(verdict.stops for verdict in run_checks(planned(policy), start, Limits(), DRIVE_CHECKS))
    episode = drive_policy(world, policy, None, 20.0, Limits(max_speed_mps=18.5))
    asked = dict.fromkeys(frame.setpoints.target_speed_mps for frame in episode.frames)
    assert list(asked) == [18.0, 18.5, 17.0], "what the person's limits forbid is brought within them"
    assert dict(episode.bounded) == {"target_speed": 20}
    assert episode.outcome == "ended"
    assert episode.duration_s == pytest.approx(9.0, abs=0.2), "six seconds, and three after its end"


@pytest.mark.parametrize(
    ("speeds", "words"), [((60.0,), "not between 0 and"), ((), "no speeds"), ((float("nan"),), "not between")]
)
def test_a_policy_kind_of_ones_own_is_judged_by_its_executor(
    toys: ModuleType, speeds: tuple[float, ...], words: str
) -> None:
    world = make_world(PLACE)
    verdicts = run_checks(planned(toys.SpeedProfile(speeds, 1.0)), world.reset(PLACE), Limits(), DRIVE_CHECKS)
    assert words in declined(planned(None), verdicts)


@pytest.mark.parametrize(("away_m", "stopped"), [(5.0, ["people-first-v1"]), (12.0, [])])
def test_a_check_of_ones_own_stands_before_every_drive(toys: ModuleType, away_m: float, stopped: list[str]) -> None:
    start = make_world(PLACE).reset(PLACE)
    person = replace(start.ego, id=7, kind="pedestrian", y_m=away_m)
    verdicts = check_drive(planned(toys.SpeedProfile((18.0,), 1.0)), replace(start, others=(person,)), Limits())
    assert [verdict.check for verdict in verdicts if verdict.stops] == stopped


def test_a_command_of_ones_own_is_listed_and_runs(toys: ModuleType) -> None:
    assert "lanes of a scenario" in CliRunner().invoke(app, ["--help"]).output
    result = CliRunner().invoke(app, ["lanes", "cruise"])
    assert result.exit_code == 0, result.output
    assert len(result.output.splitlines()) == len(make_world(find("cruise")).reset(find("cruise")).road.lanes)


def test_what_nobody_vouches_for_is_not_driven(toys: ModuleType) -> None:
    world = make_world(PLACE)
    start = world.reset(PLACE)
    for kind, words in (("unvouched", "no `fault`"), ("telepathy", "no executor knows")):
        policy: Policy = replace(toys.SpeedProfile((18.0,), 1.0), kind=kind)
        verdicts = run_checks(planned(policy), start, Limits(), DRIVE_CHECKS)
        assert verdicts[0].stops
        assert words in verdicts[0].reason
    with pytest.raises(ScenarioError, match=r"no executor.*|Known"):
        drive_policy(world, replace(toys.SpeedProfile((18.0,), 1.0), kind="telepathy"), None, 1.0, Limits())


@pytest.mark.parametrize(("brightness", "speed"), [(20, 14.0), (200, 18.0)])
def test_a_planner_that_looks_is_given_pictures_and_drives_by_them(
    toys: ModuleType, brightness: int, speed: float
) -> None:
    """All of the loop: the pictures reach the planner, and what it makes of them is checked and driven."""
    world, planner = make_world(PLACE), make_planner("lookout")
    seen: list[CameraImage] = []

    def see(observation: Observation) -> tuple[CameraImage, ...]:
        picture = np.full((6, 8, 3), brightness, dtype=np.uint8)
        seen.append(CameraImage("front", observation.time_s, picture))
        return tuple(seen)

    def execute(planned: Planned) -> Trip:
        assert planned.request.images == tuple(seen)
        assert not planned.refusal
        assert planned.plan.policy is not None
        episode = drive_policy(world, planned.plan.policy, None, 12.0, planned.request.limits)
        return make_trip(planned, PLACE, 3, episode)

    assert isinstance(planner, Planner)
    steps = steps_at(
        world.reset(PLACE, 3),
        planner,
        Forgetful(),
        Limits(),
        describe=describe,
        system=lambda _: SystemMessage(""),
        check=check_drive,
        see=see,
    )
    trip = asyncio.run(drive(Instruction("Drive as the light allows."), steps, execute, Forgetful()))
    assert dict(trip.plan.settings)["target_speed_mps"] == pytest.approx(speed, abs=0.01)
    assert trip.outcome == "ended"


def test_the_planner_of_the_page_is_checked_and_drives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (EXAMPLES.parent / "docs" / "your-planner.md").read_text(encoding="utf-8")
    blocks = {text.partition("\n")[0]: text for text in re.findall(r"```\w+\n(# .*?)```", page, re.DOTALL)}
    (tmp_path / "my_planner.py").write_text(blocks["# my_planner.py"], encoding="utf-8")
    points = tomllib.loads(blocks["# pyproject.toml"])["project"]["entry-points"]["chauffeur.planners"]
    listed = "".join(f"{name} = {value}\n" for name, value in points.items())
    installed(tmp_path, monkeypatch, f"[chauffeur.planners]\n{listed}")
    for name in ("my_planner:MyPlanner", "my_planner:MyPlanner/22", "mine", "mine/22"):
        result = CliRunner().invoke(app, ["check", "planner", name])
        assert result.exit_code == 0, result.output
    (line,) = re.findall(r"^chauffeur (drive .*)$", page, re.MULTILINE)
    words = shlex.split(line.replace("trips/mine", str(tmp_path / "trips")))
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    assert "79" in result.output, "22 m/s are 79 km/h"
