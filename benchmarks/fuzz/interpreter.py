"""The sandbox behind the gate: programs that pass are run, and one in eight of those that do not."""

from __future__ import annotations

import time
import zlib
from functools import cache

from chauffeur.programs import (
    Budget,
    ProgramCrashError,
    ProgramExecutor,
    ProgramFaultError,
    ProgramRaisedError,
    ProgramRefusedError,
    ProgramSyntaxError,
    ProgramTimeError,
    Sandbox,
    TickResult,
    check_source,
)
from fuzz.programs import changed, seeds, split
from fuzz.road import drive_on, world_for
from fuzz.target import Target, expect

TICKS = 3
STALL_S = 5.0
"""A control period may take some tens of milliseconds; a machine that has other things to do makes it longer."""
_SMALL = Budget(turn_s=0.02, tick_s=0.05, grace_s=0.02, start_s=0.25, calls=60, memory_bytes=4 << 20, recursion=50)
_NOT_OF_A_PROGRAM = frozenset(
    {"NotImplementedError", "ModuleNotFoundError", "PermissionError", "SyntaxError", "ImportError"}
)
"""What the gate is there to prevent."""


@cache
def _sandbox() -> Sandbox:
    return Sandbox(_SMALL, workers=1)


def examine(data: bytes) -> str:
    """Run a program for a few control periods under a small budget."""
    source, library = split(data)
    passed = check_source(source, library).passed
    number = zlib.crc32(data)
    if not passed and number % 8:
        return "refused"
    results = _driven(source, library, number, gate=passed)
    last = results[-1]
    if passed and last.error is not None:
        _is_an_honest_fault(last.error)
    timed = isinstance(last.error, ProgramTimeError | ProgramCrashError)
    if passed and number % 8 == 1 and not timed:
        again = _driven(source, library, number, gate=True)
        if not isinstance(again[-1].error, ProgramTimeError):
            expect(_story(again) == _story(results), "the same program did not do the same")
    return f"{'' if passed else 'ungated '}{last.state if last.error is None else type(last.error).__name__}"


def _driven(source: str, library: str, number: int, *, gate: bool) -> list[TickResult]:
    world = world_for(number)
    results: list[TickResult] = []
    with ProgramExecutor(sandbox=_sandbox(), library=library, gate=gate) as executor:
        executor.start(source, world)
        for _ in range(TICKS):
            before = time.monotonic()
            result = executor.tick()
            expect(time.monotonic() - before < STALL_S, "a control period stalled")
            expect(result.error is None or isinstance(result.error, ProgramFaultError), "a fault is not typed")
            expect((result.error is not None) == (result.state == "failed"), "a fault is not told")
            results.append(result)
            if result.state != "running":
                break
            drive_on(world, result)
    return results


def _is_an_honest_fault(error: ProgramFaultError | Exception) -> None:
    expect(not isinstance(error, ProgramRefusedError | ProgramSyntaxError), "the gate accepts what cannot be read")
    expect(not isinstance(error, ProgramCrashError), "the worker went down")
    if isinstance(error, ProgramRaisedError):
        expect(error.exception not in _NOT_OF_A_PROGRAM, f"the gate accepts what ends in {error.exception}")
        expect("__" not in str(error) or error.exception != "NameError", "the program's own text misses an inner name")


def _story(results: list[TickResult]) -> list[tuple[object, ...]]:
    return [(one.state, one.line, one.said, repr(one.setpoints), repr(one.calls), str(one.error)) for one in results]


TARGET = Target(
    name="interpreter",
    invariant=(
        "Nothing a program does raises from the executor or stalls it, whether it passed the gate or not; what passed "
        "fails in no way that the gate is there to prevent, brings no worker down, and does the same again."
    ),
    reads=("chauffeur.programs",),
    seeds=seeds,
    changed=changed,
    examine=examine,
)
