"""What a benign program does in the sandbox is what it does in bare Python: calls, words, wishes, lines, end."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from benign import BENIGN
from reference import BareRunner, Trace
from straight_road import StraightRoad

from chauffeur.programs import ProgramExecutor, ProgramRaisedError, Sandbox, TickResult, check_source
from chauffeur.worlds.base import World
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.scenarios import BUILT_IN

TICKS = 40


def _highway(name: str) -> Callable[[], World]:
    scenario = next(s for s in BUILT_IN if s.id == name)

    def build() -> World:
        world = HighwayWorld()
        world.reset(scenario)
        return world

    return build


WORLDS: dict[str, Callable[[], World]] = {
    "straight-road": StraightRoad,
    "overtake": _highway("overtake"),
    "stop-sign": _highway(next(s.id for s in BUILT_IN if "intersection" in s.config["type"])),
}


def _trace(result: TickResult) -> Trace:
    error = result.error.exception if isinstance(result.error, ProgramRaisedError) else str(result.error or "")
    line = result.line if result.state == "running" else None
    return Trace(result.state, result.setpoints, result.said, result.calls, line, error)


def _drive(tick: Callable[[], Trace], world: World, ticks: int) -> list[Trace]:
    driver = world.driver()
    traces: list[Trace] = []
    for _ in range(ticks):
        trace = tick()
        traces.append(trace)
        if trace.state != "running":
            break
        world.step(driver.command(driver.settle(trace.setpoints)))
    return traces


def test_there_are_enough_programs() -> None:
    assert len(BENIGN) >= 40


@pytest.mark.parametrize("name", BENIGN)
def test_gate_passes_it(name: str) -> None:
    report = check_source(BENIGN[name])
    assert report.findings == (), report.findings


@pytest.mark.parametrize("road", WORLDS)
@pytest.mark.parametrize("name", BENIGN)
def test_same_as_bare_python(name: str, road: str, sandbox: Sandbox) -> None:
    source = BENIGN[name]
    bare_world, world = WORLDS[road](), WORLDS[road]()
    expected = _drive(BareRunner(source, bare_world).tick, bare_world, TICKS)
    with ProgramExecutor(sandbox=sandbox) as executor:
        executor.start(source, world)
        got = _drive(lambda: _trace(executor.tick()), world, TICKS)
    assert got == expected
