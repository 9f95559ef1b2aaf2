"""No hostile or broken program escapes, stops the host, or delays a control period; each gives its own typed error."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from hostile import CANARY, HOSTILE, Hostile
from straight_road import StraightRoad, start_cars

from chauffeur.concept import SandboxError
from chauffeur.programs import (
    ProgramCallsError,
    ProgramCrashError,
    ProgramExecutor,
    ProgramFaultError,
    ProgramMemoryError,
    ProgramRaisedError,
    ProgramRecursionError,
    ProgramRefusedError,
    ProgramSyntaxError,
    ProgramTimeError,
    Sandbox,
    TickResult,
    check_source,
)

OUTCOMES: dict[type[ProgramFaultError], str] = {
    ProgramCallsError: "calls",
    ProgramCrashError: "crash",
    ProgramMemoryError: "memory",
    ProgramRaisedError: "raised",
    ProgramRecursionError: "recursion",
    ProgramRefusedError: "refused",
    ProgramSyntaxError: "syntax",
    ProgramTimeError: "time",
}
SECRET = "tell-no-one-7f3a"
TICK_BOUND_S = 0.25
"""On a quiet machine no tick takes 0.1 s (benchmarks/program_tick.py measures it); this bound holds on a busy one."""

BENIGN = "def drive():\n    set_target_speed(27)\n    yield autopilot()\n"


@dataclass(frozen=True)
class Attack:
    outcome: str
    result: TickResult
    said: tuple[str, ...]
    slowest_s: float


@pytest.fixture(scope="module")
def strict() -> Iterator[Sandbox]:
    """A sandbox with the budgets of a real drive."""
    with Sandbox() as sandbox:
        yield sandbox


@pytest.fixture(autouse=True)
def _traps(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("CHAUFFEUR_SECRET", SECRET)
    Path(CANARY).unlink(missing_ok=True)
    yield
    assert not Path(CANARY).exists()


def _attack(hostile: Hostile, sandbox: Sandbox, *, gate: bool) -> Attack:
    road = StraightRoad()
    said: list[str] = []
    slowest = 0.0
    with ProgramExecutor(sandbox=sandbox, gate=gate) as executor:
        executor.start(hostile.source, road)
        for _ in range(4):
            before = time.perf_counter()
            result = executor.tick()
            slowest = max(slowest, time.perf_counter() - before)
            said += result.said
            if result.state != "running":
                break
            with contextlib.suppress(SandboxError):  # put down after each period, as in real time; it may fail of it
                executor.dump()
    assert road.cars == start_cars()
    error = result.error
    assert error is None or isinstance(error, ProgramFaultError)
    outcome = "harmless" if error is None else OUTCOMES[type(error)]
    return Attack(outcome, result, tuple(said), slowest)


def _assert_contained(attack: Attack) -> None:
    assert attack.slowest_s < TICK_BOUND_S
    words = " ".join(attack.said) + str(attack.result.error)
    assert SECRET not in words
    assert "root:" not in words
    assert str(Path.cwd()) not in words
    assert attack.result.setpoints.target_speed_mps is not None
    assert attack.result.setpoints.target_speed_mps < 100
    assert len(str(attack.result.error)) < 700
    if attack.outcome != "harmless":
        assert attack.result.state == "failed"


def test_there_are_enough_and_they_differ() -> None:
    assert len(HOSTILE) >= 200
    assert len({hostile.name for hostile in HOSTILE}) == len(HOSTILE)
    assert len({hostile.source for hostile in HOSTILE}) == len(HOSTILE)


@pytest.mark.parametrize("hostile", HOSTILE, ids=lambda h: h.name)
def test_sandbox_alone_contains_it(hostile: Hostile, strict: Sandbox) -> None:
    attack = _attack(hostile, strict, gate=False)
    # A busy machine can make any program late; that must be contained too.
    assert attack.outcome in hostile.outcomes | {"time"}
    _assert_contained(attack)


@pytest.mark.parametrize("hostile", HOSTILE, ids=lambda h: h.name)
def test_gate_and_sandbox_contain_it(hostile: Hostile, strict: Sandbox) -> None:
    attack = _attack(hostile, strict, gate=True)
    assert attack.outcome in hostile.outcomes | {"time", "refused"}
    _assert_contained(attack)
    if attack.outcome == "refused":
        assert check_source(hostile.source).findings


def test_gate_refuses_most_before_anything_runs() -> None:
    refused = [hostile for hostile in HOSTILE if not check_source(hostile.source).passed]
    assert len(refused) >= 0.7 * len(HOSTILE)
    reach = [h for h in HOSTILE if h.name.startswith(("os/", "graph/")) and check_source(h.source).passed]
    assert {h.name for h in reach} <= {"graph/format_globals", "graph/format_class"}


def test_a_benign_program_runs_right_after_every_kind_of_attack(strict: Sandbox) -> None:
    road = StraightRoad()
    for hostile in HOSTILE[::8]:
        _attack(hostile, strict, gate=False)
        for tries_left in reversed(range(10)):  # a busy machine may take a program's time away; an attack, for good
            with ProgramExecutor(sandbox=strict) as executor:
                before = time.perf_counter()
                executor.start(BENIGN, road)
                ready_s = time.perf_counter() - before
                result = executor.tick()
            if (result.state == "running" and ready_s < TICK_BOUND_S) or not tries_left:
                break
        assert result.state == "running", result.error
        assert result.setpoints.target_speed_mps == 27.0
        assert ready_s < TICK_BOUND_S


def test_worker_has_no_secret_in_reach(strict: Sandbox) -> None:
    assert os.environ["CHAUFFEUR_SECRET"] == SECRET
    source = "import os\ndef attack():\n    say(os.environ.get('CHAUFFEUR_SECRET', 'none'))\n    yield\n"
    with ProgramExecutor(sandbox=strict, gate=False) as executor:
        executor.start(source, StraightRoad())
        result = executor.tick()
    assert SECRET not in " ".join(result.said) + str(result.error)
