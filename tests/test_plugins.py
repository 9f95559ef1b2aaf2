"""Toy plug-ins of every kind, in new files and entry points alone.

`tests/bench/test_kernel.py` runs the benchmark of questions, `tests/worlds/test_conformance.py` checks the world.
"""

from __future__ import annotations

import asyncio
import importlib
from collections.abc import Iterator
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
    Program,
    Scenario,
    ScenarioError,
    SystemMessage,
    Thoughts,
    Trip,
)
from chauffeur.concept.registry import load_plugin
from chauffeur.describe import describe
from chauffeur.driving.conformance import check_api
from chauffeur.driving.episode import drive_policy, make_world
from chauffeur.driving.loop import drive, steps_at
from chauffeur.driving.planning import Planned, declined
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Forgetful, check_drive
from chauffeur.driving.trips import make_trip
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.programs import Api, Param, render_docs
from chauffeur.programs.catalogue import apis_of, plugged_apis
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
[chauffeur.apis]
time-gap = time_gap:TIME_GAP
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


def forget_apis() -> None:
    """Look for driving APIs anew: a process reads the table once."""
    apis_of.cache_clear()
    plugged_apis.cache_clear()


@pytest.fixture
def toys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The examples, installed as a package of somebody else's; the policy kind's module."""
    installed(tmp_path, monkeypatch, POINTS)
    monkeypatch.syspath_prepend(str(EXAMPLES))
    forget_apis()
    yield importlib.import_module("speed_profile")
    monkeypatch.undo()
    forget_apis()


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


DROPPING_BACK = """def drive():
    set_desired_time_headway(2.0)
    set_target_speed(30.0)
    front = detect_front_vehicle_in(get_lane_of(get_ego_vehicle()), 200)
    while front is not None and get_time_gap_to(front) < 1.8:
        yield autopilot()
    say("Far enough behind.")
    yield autopilot()
"""


def test_a_driving_api_of_ones_own_is_documented_gated_verified_and_answered(toys: ModuleType) -> None:
    world, scenario = make_world(find("overtake")), find("overtake")
    start = world.reset(scenario)
    verdicts = run_checks(planned(Program(DROPPING_BACK)), start, Limits(), DRIVE_CHECKS)
    assert not any(verdict.stops for verdict in verdicts)
    assert "def get_time_gap_to(veh: Vehicle) -> float:" in render_docs() and "get_time_gap_to" in render_docs("town")
    assert "get_time_gap_to" in CliRunner().invoke(app, ["show", "apis"]).output
    episode = drive_policy(world, Program(DROPPING_BACK), None, 30.0, Limits())
    ((said_s, words),) = episode.said
    assert words == "Far enough behind."
    seen = next(frame.observation for frame in episode.frames if frame.observation.time_s >= said_s - 1e-6)
    assert seen.front is not None
    assert seen.front.distance_m / seen.ego.speed_mps == pytest.approx(1.8, abs=0.1)
    refused = planned(Program(DROPPING_BACK.replace("get_time_gap_to(front)", "get_time_gap_to(12)")))
    assert "needs a vehicle" in declined(refused, run_checks(refused, start, Limits(), DRIVE_CHECKS))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"name": "autopilot"}, "belongs to the driving language"),
        ({"effect": "wish"}, "only set-points act"),
        ({"answer": None}, "no `answer`"),
        ({"example": "gap = get_gap()"}, "needs 'veh'"),
        ({"answer": lambda *_: float("nan")}, "'nan', no number"),
        ({"answer": lambda *_: {}["gone"]}, "raised KeyError"),
    ],
)
def test_a_driving_api_that_breaks_its_contract_is_told_so(change: dict[str, Any], words: str) -> None:
    veh = Param("veh", "vehicle", "a vehicle")
    api = Api("get_gap", "A gap.", "number", "gap = get_gap(front)", params=(veh,), answer=lambda *_: 1.0)
    assert not any(finding.faults for finding in check_api(api))
    assert words in " ".join(fault for finding in check_api(replace(api, **change)) for fault in finding.faults)


def test_a_broken_answer_is_the_programs_error_and_not_the_drives(
    toys: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = replace(plugged_apis()["get_time_gap_to"], answer=lambda *_: "soon")
    monkeypatch.setattr(importlib.import_module("time_gap"), "TIME_GAP", broken)
    forget_apis()
    world = make_world(find("overtake"))
    world.reset(find("overtake"))
    episode = drive_policy(world, Program(DROPPING_BACK), None, 2.0, Limits())
    assert episode.causes.policy_failed and "it answered 'soon', no number" in episode.causes.detail


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
