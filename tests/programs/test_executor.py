"""The executor: one step per control period, faults as values, dumps, and workers that die."""

from __future__ import annotations

import contextlib
import os
import signal
import time
from pathlib import Path

import pytest
from straight_road import LANES, StraightRoad

from chauffeur.concept import LaneId, Program, SandboxError, Setpoints
from chauffeur.programs import (
    UNHURRIED,
    Budget,
    ProgramCallsError,
    ProgramCrashError,
    ProgramExecutor,
    ProgramMemoryError,
    ProgramRaisedError,
    ProgramRecursionError,
    ProgramRefusedError,
    ProgramTimeError,
    Sandbox,
)
from chauffeur.programs.catalogue import APIS, MAX_SAID
from chauffeur.programs.rewrite import prepare

COUNTING = """
def helper(n):
    for i in range(n):
        set_target_speed(20 + i)
        yield autopilot()

def main():
    ego = get_ego_vehicle()
    left = get_left_lane(ego)
    seen = []
    yield from helper(3)
    set_target_lane(left)
    while True:
        seen.append(round(get_speed_of(ego), 3))
        say(f"{len(seen)} {sum(seen):.3f}")
        yield autopilot()
"""


def _run(executor: ProgramExecutor, road: StraightRoad, ticks: int) -> list[object]:
    results: list[object] = []
    for _ in range(ticks):
        result = executor.tick()
        results.append(result)
        road.step(road.command(result.setpoints))
    return results


def test_a_program_waits_for_the_first_tick(executor: ProgramExecutor, road: StraightRoad) -> None:
    assert executor.state == "none"
    assert executor.start("def main():\n    say('hello')\n    yield\n    say('bye')\n", road) == "running"
    first = executor.tick()
    assert (first.state, first.line, first.said) == ("running", 3, ("hello",))
    second = executor.tick()
    assert (second.state, second.line, second.said) == ("finished", None, ("bye",))
    third = executor.tick()
    assert (third.state, third.said, third.calls, third.error) == ("finished", (), (), None)


def test_wishes_stay_when_a_program_has_finished_or_failed(executor: ProgramExecutor, road: StraightRoad) -> None:
    for end, state in (("return", "finished"), ("raise ValueError('no')", "failed")):
        executor.start(f"def main():\n    set_target_speed(29)\n    yield\n    {end}\n", road)
        executor.tick()
        for _ in range(3):
            result = executor.tick()
            assert result.state == state
            assert result.setpoints == Setpoints(29.0, 1.5, LANES[1])


def test_a_program_can_take_over_anothers_wishes(executor: ProgramExecutor, road: StraightRoad) -> None:
    held = Setpoints(28.0, 0.9, LANES[2], "left", frozenset({9}))
    executor.start("def main():\n    say(str(get_desired_time_headway()))\n    yield\n", road, setpoints=held)
    result = executor.tick()
    assert result.setpoints == held
    assert result.said == ("0.9",)


def test_tick_without_a_program_says_so(executor: ProgramExecutor) -> None:
    with pytest.raises(SandboxError, match="Call start"):
        executor.tick()


def test_failure_names_line_and_reason(executor: ProgramExecutor, road: StraightRoad) -> None:
    executor.start("def main():\n    yield\n    x = [1]\n\n    y = x[3]\n    yield\n", road)
    executor.tick()
    result = executor.tick()
    assert isinstance(result.error, ProgramRaisedError)
    assert result.error.exception == "IndexError"
    assert result.line == result.error.line == 5
    assert "line 5" in str(result.error)
    assert executor.tick().error is result.error


def test_failure_in_a_helper_names_the_innermost_program_line(executor: ProgramExecutor, road: StraightRoad) -> None:
    executor.start("def f():\n    return 1 / 0\ndef main():\n    x = max([1], key=lambda v: f())\n    yield\n", road)
    assert executor.tick().line == 2


def test_refusal_names_line_and_remedy(executor: ProgramExecutor, road: StraightRoad) -> None:
    assert executor.start("def main():\n    get_sped_of(1)\n    yield\n", road) == "failed"
    result = executor.tick()
    assert isinstance(result.error, ProgramRefusedError)
    assert result.line == 2
    assert "did you mean get_speed_of?" in str(result.error)
    assert result.setpoints.target_speed_mps == 25.0


def test_time_without_a_line_falls_back_to_where_it_waited(road: StraightRoad) -> None:
    with ProgramExecutor(gate=False) as executor:
        executor.start("def main():\n    yield\n    while True:\n        pass\n", road)
        assert executor.tick().line == 2
        result = executor.tick()
    assert isinstance(result.error, ProgramTimeError)
    assert result.line == 2


def test_budgets_are_arguments(road: StraightRoad) -> None:
    source = "def main():\n    for _ in range(10):\n        get_target_speed()\n    yield\n"
    with ProgramExecutor(budget=Budget(calls=5, turn_s=1.0, tick_s=1.0)) as executor:
        executor.start(source, road)
        result = executor.tick()
    assert isinstance(result.error, ProgramCallsError)
    assert result.line == 3
    deep = "def f(n):\n    return 0 if n == 0 else f(n - 1)\ndef main():\n    f(40)\n    yield\n"
    for depth, failed in ((30, True), (60, False)):
        with ProgramExecutor(budget=Budget(recursion=depth, turn_s=1.0, tick_s=1.0)) as executor:
            executor.start(deep, road)
            assert isinstance(executor.tick().error, ProgramRecursionError) == failed


def computed(for_s: float) -> None:
    until_s = time.thread_time() + for_s
    while time.thread_time() < until_s:
        pass


def test_the_tick_budget_counts_slow_answers(road: StraightRoad) -> None:
    class SlowRoad(StraightRoad):
        def lane_of(self, vehicle_id: int) -> LaneId:
            computed(0.02)
            return super().lane_of(vehicle_id)

    source = "def main():\n    for _ in range(20):\n        get_lane_of(get_ego_vehicle())\n    yield\n"
    with ProgramExecutor() as executor:
        executor.start(source, SlowRoad())
        before_s = time.thread_time()
        result = executor.tick()
    assert isinstance(result.error, ProgramTimeError)
    assert time.thread_time() - before_s < 0.2


def test_a_dumped_program_goes_on_exactly_as_if_nothing_had_happened(sandbox: Sandbox) -> None:
    straight, stopped = StraightRoad(), StraightRoad()
    with ProgramExecutor(sandbox=sandbox) as executor:
        executor.start(COUNTING, straight)
        expected = _run(executor, straight, 20)
    with ProgramExecutor(sandbox=sandbox) as executor:
        executor.start(COUNTING, stopped)
        got = _run(executor, stopped, 2)
        state = executor.dump()
    assert len(state) < 64_000
    with Sandbox() as fresh, ProgramExecutor(sandbox=fresh) as executor:
        executor.load(state, stopped)
        assert executor.state == "running"
        got += _run(executor, stopped, 7)
        state = executor.dump()
        got += _run(executor, stopped, 11)
    assert got == expected
    assert b"veh:" not in state.split(b"\n", 1)[0]


def test_a_resumed_program_has_the_same_limits(sandbox: Sandbox, road: StraightRoad) -> None:
    source = "def main():\n    yield\n    while True:\n        pass\n    yield\n"
    with Sandbox() as strict:
        with ProgramExecutor(sandbox=strict, gate=False) as executor:
            executor.start(source, road)
            executor.tick()
            state = executor.dump()
        with ProgramExecutor(sandbox=strict, gate=False) as executor:
            executor.load(state, road)
            before = time.perf_counter()
            result = executor.tick()
            assert time.perf_counter() - before < 0.25
    assert isinstance(result.error, ProgramTimeError)


@pytest.mark.parametrize("junk", [b"", b"\n", b"{}\n", b"junk", b'{"chauffeur-program-1": 3}\nx', b"\xff\xfe\n"])
def test_junk_is_no_dump(junk: bytes, executor: ProgramExecutor, road: StraightRoad) -> None:
    with pytest.raises(SandboxError):
        executor.load(junk, road)


def test_a_damaged_dump_is_refused(executor: ProgramExecutor, road: StraightRoad) -> None:
    executor.start(COUNTING, road)
    executor.tick()
    state = executor.dump()
    with pytest.raises(SandboxError):
        executor.load(state[:-40], road)
    assert executor.start(COUNTING, road) == "running"


def test_only_a_running_program_is_dumped(executor: ProgramExecutor, road: StraightRoad) -> None:
    executor.start("def main():\n    yield\n", road)
    executor.tick()
    executor.tick()
    with pytest.raises(SandboxError):
        executor.dump()


def test_a_killed_worker_is_a_typed_error_and_the_next_program_starts_at_once(road: StraightRoad) -> None:
    with Sandbox() as sandbox, ProgramExecutor(sandbox=sandbox) as executor:
        for _ in range(5):
            executor.start(COUNTING, road)
            assert executor.tick().state == "running"
            pid = executor.worker_pid
            assert pid is not None
            os.kill(pid, signal.SIGKILL)
            before = time.perf_counter()
            result = executor.tick()
            assert isinstance(result.error, ProgramCrashError)
            executor.start(COUNTING, road)
            assert executor.tick().state == "running"
            assert time.perf_counter() - before < 0.5


def test_a_stopped_worker_does_not_stop_the_host(road: StraightRoad) -> None:
    with ProgramExecutor() as executor:
        executor.start(COUNTING, road)
        executor.tick()
        pid = executor.worker_pid
        assert pid is not None
        os.kill(pid, signal.SIGSTOP)
        while Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "T":
            time.sleep(0.001)  # it is sent, but not stopped yet: an answer may still come
        before = time.perf_counter()
        result = executor.tick()
        assert time.perf_counter() - before < 0.5
        assert isinstance(result.error, ProgramTimeError)


def test_closing_leaves_no_workers(road: StraightRoad) -> None:
    executor = ProgramExecutor()
    executor.start(COUNTING, road)
    pid = executor.worker_pid
    assert pid is not None
    executor.close()
    executor.close()
    for _ in range(100):
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            break
        time.sleep(0.01)
    else:
        pytest.fail("the worker outlived its executor")
    with pytest.raises(SandboxError, match="closed"):
        executor.start(COUNTING, road)


def test_more_programs_than_workers_is_said(road: StraightRoad) -> None:
    with Sandbox(workers=1, max_workers=1) as sandbox:
        first, second = ProgramExecutor(sandbox=sandbox), ProgramExecutor(sandbox=sandbox)
        first.start(COUNTING, road)
        with pytest.raises(SandboxError, match="busy") as caught:
            second.start(COUNTING, road)
        assert caught.value.retryable
        first.close()
        assert second.start(COUNTING, road) == "running"
        second.close()


def test_two_programs_side_by_side_share_nothing(sandbox: Sandbox) -> None:
    source = (
        "total = [0]\ndef main():\n    while True:\n        total[0] += 1\n        say(str(total[0]))\n        yield\n"
    )
    with ProgramExecutor(sandbox=sandbox) as one, ProgramExecutor(sandbox=sandbox) as other:
        one.start(source, StraightRoad())
        other.start(source, StraightRoad())
        said = [(one.tick().said, other.tick().said) for _ in range(3)]
        one.start(source, StraightRoad())
        assert said == [(("1",), ("1",)), (("2",), ("2",)), (("3",), ("3",))]
        assert one.tick().said == ("1",)


def test_library_functions_are_called_with_yield_from(sandbox: Sandbox, road: StraightRoad) -> None:
    library = (
        "import math\n\ndef inner(n):\n    for _ in range(n):\n        yield autopilot()\n"
        "def wait(seconds):\n    yield from inner(math.ceil(seconds * 10))\n    return 'waited'\n"
        "def main():\n    say('not me')\n    yield\n"
    )
    source = "def drive():\n    x = yield from wait(0.2)\n    say(x)\n    yield\n    yield from wait(0.1)\n"
    with ProgramExecutor(sandbox=sandbox, library=library) as executor:
        executor.start(source, road)
        results = [executor.tick() for _ in range(5)]
    text = Program(source, library=library).text.splitlines()
    stood = [None if r.line is None else text[r.line - 1].strip() for r in results]
    tick = "yield autopilot()"
    assert stood == [tick, tick, "yield", tick, None], "in a helper, the helper's own line"
    assert [r.said for r in results] == [(), (), ("waited",), (), ()]
    assert results[-1].state == "finished"


def test_an_error_in_the_library_names_the_programs_line(sandbox: Sandbox, road: StraightRoad) -> None:
    with ProgramExecutor(sandbox=sandbox, library="def bad():\n    yield\n    1 / 0\n") as executor:
        executor.start("def drive():\n\n\n    yield from bad()\n", road)
        executor.tick()
        result = executor.tick()
    assert isinstance(result.error, ProgramRaisedError)
    assert result.line == 4


def test_prints_go_nowhere(executor: ProgramExecutor, road: StraightRoad, capfd: pytest.CaptureFixture[str]) -> None:
    executor.start("def main():\n    print('debug', 3)\n    yield\n", road)
    assert executor.tick().said == ()
    assert capfd.readouterr().out == ""


def test_no_clock_and_no_chance(sandbox: Sandbox, road: StraightRoad) -> None:
    source = (
        "import random\nimport time\ndef main():\n"
        "    say(f'{random.random()} {time.time()} {hash(\"a\")}')\n    yield\n"
    )
    said: set[tuple[str, ...]] = set()
    for _ in range(2):
        with ProgramExecutor(sandbox=sandbox, gate=False) as executor:
            executor.start(source, road)
            said.add(executor.tick().said)
    assert len(said) == 1


def test_a_failing_world_is_not_hidden(sandbox: Sandbox) -> None:
    class Broken(StraightRoad):
        broken = False

        def lane_of(self, vehicle_id: int) -> LaneId:
            if self.broken:
                raise ZeroDivisionError("the world's own fault")
            return super().lane_of(vehicle_id)

    world = Broken()
    with ProgramExecutor(sandbox=sandbox) as executor:
        executor.start("def main():\n    yield\n    get_lane_of(get_ego_vehicle())\n    yield\n", world)
        executor.tick()
        world.broken = True
        with pytest.raises(ZeroDivisionError):
            executor.tick()
        world.broken = False
        assert executor.start("def main():\n    yield\n", world) == "running"


def test_what_the_sandbox_makes_of_values_in_a_deep_recursion_reaches_no_api(
    executor: ProgramExecutor, road: StraightRoad
) -> None:
    source = "def f(n):\n    say('never')\n    return f(n + 1)\n\ndef main():\n    f(0)\n    yield autopilot()\n"
    executor.start(source, road)
    result = executor.tick()
    assert result.state == "failed"
    assert result.said[0] == "never"


GROWS = """
def drive():
    kept = []
    while True:
        kept.append("x" * 400000 + str(len(kept)))
        yield autopilot()
"""


def test_a_program_that_grows_too_large_to_be_dumped_has_failed_and_nothing_raises(road: StraightRoad) -> None:
    with Sandbox(UNHURRIED) as sandbox, ProgramExecutor(sandbox=sandbox) as executor:
        executor.start(GROWS, road)
        for _ in range(60):
            result = executor.tick()
            if result.state != "running":
                break
            with contextlib.suppress(SandboxError):
                executor.dump()
        assert result.state == "failed"
        assert isinstance(result.error, ProgramMemoryError | ProgramCrashError)
        assert executor.tick().state == "failed"
        with pytest.raises(SandboxError):
            executor.dump()
        assert executor.start(COUNTING, road) == "running"  # the worker was replaced
        assert executor.tick().state == "running"


def test_a_pool_that_has_given_its_worker_up_is_a_typed_error() -> None:
    with Sandbox(UNHURRIED) as sandbox:
        run = sandbox.start(prepare("def drive():\n    while True:\n        yield\n"), APIS)
        run._session.__exit__(None, None, None)  # as the pool does by itself when a worker dies
        run.begin_tick()
        with pytest.raises(ProgramCrashError, match="finished"):
            run.answer(None)


def test_wishes_that_wait_count_as_they_come_and_not_at_the_end_of_the_period(road: StraightRoad) -> None:
    source = """
def drive():
    while True:
        for _ in range(1000):
            for i in range(50):
                set_target_speed(20.0 + 0.01 * i)
            get_target_speed()
        yield autopilot()
"""
    with Sandbox(UNHURRIED) as sandbox, ProgramExecutor(sandbox=sandbox) as executor:
        executor.start(source, road)
        result = executor.tick()
    assert isinstance(result.error, ProgramCallsError)
    assert len(result.made) <= UNHURRIED.calls + 50


def test_the_time_the_host_takes_counts_when_the_period_ends() -> None:
    now_s = 0.0
    with Sandbox(UNHURRIED, clock=lambda: now_s) as sandbox:
        run = sandbox.start(prepare("def drive():\n    while True:\n        yield\n"), APIS)
        run.begin_tick()
        assert run.answer(None) is not None
        run.charge(0)
        now_s = 1.1 * UNHURRIED.tick_s
        with pytest.raises(ProgramTimeError):
            run.charge(0)


def test_what_is_said_is_capped_in_a_period_and_in_all_and_that_is_said(sandbox: Sandbox, road: StraightRoad) -> None:
    source = """
def drive():
    n = 0
    while True:
        for _ in range(150):
            n = n + 1
            say(str(n))
        yield autopilot()
"""
    with ProgramExecutor(sandbox=sandbox) as executor:
        executor.start(source, road)
        first = executor.tick()
        assert first.said == ("1", "2", "3", "4", "(146 more remarks were left out.)")
        assert first.state == "running"
        said = [text for _ in range(60) for text in executor.tick().said]
    assert len(first.said) + len(said) == MAX_SAID
    assert said[-1].startswith("(The program says too much")


def test_a_period_is_measured_in_processor_time_so_a_busy_machine_ends_no_program() -> None:
    source = "def drive():\n    while True:\n        yield\n"
    with Sandbox(Budget(turn_s=5.0, tick_s=0.2, start_s=5.0)) as sandbox:
        run = sandbox.start(prepare(source), APIS)
        for _ in range(3):
            run.begin_tick()
            time.sleep(0.25)  # another process has the core
            assert run.answer(None) is not None
        run.begin_tick()
        computed(0.25)
        with pytest.raises(ProgramTimeError, match="200 ms"):
            run.answer(None)


def test_the_programs_own_processor_time_counts(road: StraightRoad) -> None:
    source = """
def drive():
    n = 0
    while True:
        for _ in range(60):
            for i in range(10000):
                n = n + i
            set_target_speed(get_target_speed())
        yield autopilot()
"""
    budget = Budget(turn_s=5.0, tick_s=0.02, start_s=5.0)
    with Sandbox(budget, clock=lambda: 0.0) as sandbox, ProgramExecutor(sandbox=sandbox) as executor:
        executor.start(source, road)
        result = executor.tick()
    assert isinstance(result.error, ProgramTimeError) and "20 ms" in str(result.error)
