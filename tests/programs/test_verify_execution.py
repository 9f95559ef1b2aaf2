"""The verifier against execution: what a program really does is always among what was said it can do."""

from __future__ import annotations

import asyncio
import math
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import pytest
from benign import BENIGN
from hypothesis import HealthCheck, given, settings
from random_programs import programs
from straight_road import StraightRoad

from chauffeur.concept import LAMPILOT_LIMITS, Instruction, LaneId, PlanRequest, Program, SystemMessage
from chauffeur.describe import describe
from chauffeur.planners.meaning import MeaningPlanner
from chauffeur.programs import APIS, DrivingApis, ProgramExecutor, Sandbox, check_source, starting_setpoints
from chauffeur.programs.rewrite import main_function, parse
from chauffeur.programs.verify import Circumstances, Verification, verify
from chauffeur.programs.verify.state import WISHES
from chauffeur.worlds.base import EGO, World
from chauffeur.worlds.highway.scenarios import BUILT_IN
from chauffeur.worlds.highway.world import HighwayWorld

TICKS = 6
MARK = re.compile(r'^\s*say\("@(\d+)"\)$')
RANDOM = settings(
    max_examples=100,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.function_scoped_fixture],
)


@cache
def start_of(name: str) -> HighwayWorld:
    world = HighwayWorld()
    world.reset(next(scenario for scenario in BUILT_IN if scenario.id == name))
    return world


def drive_on(world: Any, wishes: Any) -> None:
    driver = world.driver()
    world.step(driver.command(driver.settle(wishes)))


@dataclass(frozen=True)
class Call:
    """A call as it was made, and the lane the ego was in."""

    name: str
    line: int
    given: dict[str, Any]
    lane: LaneId
    in_library: bool


class TooMuch(BaseException):
    """A program that does not come to an end; no `except` of its own catches it."""


class Traced:
    """Runs a program in CPython over the bound APIs, and notes every line and every call with its real arguments."""

    def __init__(self, source: str, world: World, library: str = "") -> None:
        self._world = world
        perception = world.perception()
        self._apis = DrivingApis(perception, world.driver(), starting_setpoints(perception))
        self.lines: set[int] = set()
        self.calls: list[Call] = []
        self._left = 0
        main = main_function(parse(source))
        assert main is not None
        names: dict[str, Any] = {name: self._bound(name) for name in APIS}
        exec(compile(library, "traced library", "exec"), names)
        exec(compile(source, "traced program", "exec"), names)
        self._generator: Iterator[Any] = names[main.name]()

    def _bound(self, name: str) -> Any:
        def call(*args: Any, **keywords: Any) -> Any:
            self._left -= 1
            if self._left < 0:
                raise TooMuch
            given = {param.name: value for param, value in zip(APIS[name].params, args, strict=False)} | keywords
            frame = sys._getframe(1)
            in_library = frame.f_code.co_filename == "traced library"
            self.calls.append(Call(name, frame.f_lineno, given, self._world.perception().lane_of(EGO), in_library))
            return self._apis.call(name, args, keywords)

        return call

    def _line(self, frame: Any, event: str, arg: Any) -> Any:
        if frame.f_code.co_filename != "traced program":
            return None
        if event == "line":
            self.lines.add(frame.f_lineno)
        return self._line

    def run(self, ticks: int) -> None:
        for _ in range(ticks):
            self._apis.begin_tick(self._world.perception())
            self._left = 300
            before = sys.gettrace()
            sys.settrace(self._line)
            try:
                next(self._generator)
            except (Exception, TooMuch):
                return
            finally:
                sys.settrace(before)
            self._apis.settle()
            drive_on(self._world, self._apis.setpoints)


def assert_calls_are_foreseen(report: Verification, calls: list[Call], source: str) -> None:
    for call in calls:
        name, line, given = call.name, call.line, call.given
        sites = [
            site for site in report.calls if (site.name, site.line, site.in_library) == (name, line, call.in_library)
        ]
        assert sites, f"{name} in line {line} was not foreseen\n{source}"
        for param, value in given.items():
            held = [found for site in sites if (found := site.argument(param)) is not None]
            assert any(one.holds(value) for one in held), f"line {line}: {name}({param}={value!r}): {held}\n{source}"
            if isinstance(value, str) and value.startswith("lane:") and all(one.offsets is not None for one in held):
                offset = int(value.rpartition(":")[2]) - int(call.lane.rpartition(":")[2])
                assert any(offset in (one.offsets or ()) for one in held), f"line {line}: {value}: {held}\n{source}"


def hashed_features(source: str) -> dict[int, int]:
    """Line of the statement behind each mark."""
    return {int(found[1]): line + 1 for line, text in enumerate(source.split("\n"), 1) if (found := MARK.match(text))}


@RANDOM
@given(source=programs())
def test_calls_and_lines_of_random_programs_are_foreseen(source: str) -> None:
    assert check_source(source).main == "main"
    for name in ("following", "left-lane"):
        world = start_of(name).copy()
        report = verify(source, "", Circumstances.of(world.observe()))
        traced = Traced(source, world)
        traced.run(TICKS)
        assert traced.lines.isdisjoint(report.unreachable), (
            f"{sorted(traced.lines & set(report.unreachable))}\n{source}"
        )
        assert_calls_are_foreseen(report, traced.calls, source)


@RANDOM
@given(source=programs())
def test_the_sandbox_does_what_was_foreseen_of_random_programs(sandbox: Sandbox, source: str) -> None:
    world = start_of("overtake").copy()
    report = verify(source, "", Circumstances.of(world.observe()))
    lines = hashed_features(source)
    texts = source.split("\n")
    overwritten = {note.line for note in report.notes if note.code == "overwritten"}
    opposed = {note.line for note in report.notes if note.code == "both-sides"}
    loops = {loop.line: loop for loop in report.loops}
    after_helper = texts.index("def wait(a):")  # a call behind one of `helper` would seem to be in there
    first_in_loop = {line: _mark_inside(line, lines) for line in loops}
    with ProgramExecutor(sandbox=sandbox, gate=False) as executor:
        executor.start(source, world)
        passes: dict[int, int] = {}
        for _ in range(TICKS):
            result = executor.tick()
            here, wished, in_tick = 0, {}, dict.fromkeys(loops, 0)
            for call in result.made:
                mark = str(call.given[0]) if call.name == "say" and call.given else ""
                if mark.startswith("@"):
                    here = lines[int(mark[1:])]
                    assert here not in report.unreachable, f"line {here}\n{source}"
                    for line, loop in loops.items():
                        if here == line:
                            passes[line] = in_tick[line] = 0
                        elif here == first_in_loop[line]:
                            passes[line] = passes.get(line, 0) + 1
                            in_tick[line] += 1
                            assert loop.passes is None or passes[line] <= loop.passes, f"{loop}\n{source}"
                            if loop.verdict == "yields":
                                assert in_tick[line] <= 1, f"{loop}\n{source}"
                elif call.name in WISHES:
                    certain = here > after_helper and f"{call.name}(" in texts[here - 1]
                    sites = [site for site in report.calls if site.name == call.name]
                    sites = [site for site in sites if site.line == here] if certain else sites
                    for index, value in enumerate(call.given):
                        held = [site.arguments[index].value for site in sites]
                        assert any(one.holds(value) for one in held), f"line {here}: {value}: {held}\n{source}"
                    if call.refused is None:
                        if certain and here in opposed:
                            assert WISHES["set_target_lane"] in wished, f"line {here}\n{source}"
                        wished[WISHES[call.name]] = here if certain else 0
            if result.state == "failed":
                break
            assert overwritten.isdisjoint(wished.values()), f"{overwritten} {wished}\n{source}"
            drive_on(world, result.setpoints)


def _mark_inside(loop: int, lines: dict[int, int]) -> int:
    """Line of the first statement of a loop's body."""
    return min((line for line in lines.values() if line > loop), default=0)


@pytest.mark.parametrize("name", sorted(BENIGN))
def test_benign_programs_are_foreseen(name: str) -> None:
    source, road = BENIGN[name], StraightRoad()
    report = verify(source)
    assert report.complete
    traced = Traced(source, road)
    traced.run(60)
    assert traced.lines.isdisjoint(report.unreachable)
    assert_calls_are_foreseen(report, traced.calls, source)
    assert all(loop.verdict in {"yields", "bounded"} for loop in report.loops)
    assert math.inf > len(traced.calls) > 0


PLANNED = [
    ("overtake", "Overtake the car in front of you."),
    ("following", "Follow the car ahead at 30 m."),
    ("following", "Leave a bit more room to the car ahead."),
    ("cruise", "Slow down to 90 km/h."),
    ("left-lane", "Move over to the right lane."),
    ("emergency-lane", "Pull over on the shoulder, please."),
    ("intersection", "Turn left at the intersection."),
    ("quiet-intersection", "Go straight on at the intersection."),
]


@pytest.mark.parametrize(("scenario", "wish"), PLANNED)
def test_the_planners_programs_are_foreseen(scenario: str, wish: str) -> None:
    world = start_of(scenario).copy()
    observation = world.observe()
    request = PlanRequest(Instruction(wish), describe(observation), SystemMessage(""), limits=LAMPILOT_LIMITS)
    plan = asyncio.run(MeaningPlanner().plan(request))
    assert isinstance(plan.policy, Program)
    source, library = plan.policy.source, plan.policy.library
    report = verify(source, library, Circumstances.of(observation))
    assert report.complete
    traced = Traced(source, world, library)
    traced.run(200)
    assert len(traced.calls) > 40
    assert traced.lines.isdisjoint(report.unreachable)
    assert_calls_are_foreseen(report, traced.calls, source)
