"""Runs model-written programs: a Rust interpreter (pydantic-monty) in worker processes that can be killed.

This is the security boundary. The program's only way out is a call to the host: its yields, the driving APIs it was
given, and requests (files, imports, unknown names) that are answered with an error. Time is limited per stretch of
computation and per control period, memory, recursion and calls are limited too, and a worker that does not obey is
killed and replaced. Model text never meets CPython's own `exec` or `eval`.
"""

from __future__ import annotations

import contextlib
import datetime
import time
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from typing import Any, Final, Self

import pydantic_monty as monty

from chauffeur.concept import SandboxError
from chauffeur.programs.errors import (
    ProgramCallsError,
    ProgramCrashError,
    ProgramFaultError,
    ProgramRaisedError,
    ProgramTimeError,
)
from chauffeur.programs.faults import MAX_MESSAGE_CHARS, fault_of
from chauffeur.programs.prefetch import AT_FAULT, DRIVE, END, FORESEEABLE, TICK, WISH, hidden
from chauffeur.programs.rewrite import Prepared
from chauffeur.programs.workers import confine, on_core, present_core, processor_time, uninterrupted

_EPOCH: Final = datetime.datetime(2000, 1, 1, tzinfo=datetime.UTC)


@dataclass(frozen=True, slots=True)
class Budget:
    """What a program may use up.

    Attributes:
        turn_s: Wall time between two calls to the host, by the worker's own watch.
        tick_s: Processor time of one control period, the host's answers included: how busy the machine is does not end
            a program. Looked at before and after each stretch of computation.
        grace_s: How long past `turn_s` a worker may take to stop by itself before it is killed.
        start_s: Reading the program and running its top level: processor time, and wall time of each of the two.
        calls: Calls to the host in one control period.
        memory_bytes: Heap of the program.
        recursion: Depth of calls.
    """

    turn_s: float = 0.02
    tick_s: float = 0.05
    grace_s: float = 0.02
    start_s: float = 0.25
    calls: int = 200
    memory_bytes: int = 16 * 1024 * 1024
    recursion: int = 100


UNHURRIED: Final = Budget(turn_s=2.0, tick_s=20.0, grace_s=2.0, start_s=20.0)
"""For simulated time, which waits for the program: how busy the machine is must not change what a program does."""


@dataclass(slots=True)
class HostCall:
    """A program waiting for its host's answer.

    Attributes:
        name: Which host function it calls.
        arguments, keywords: Untrusted values of any type and size.
        slot: Under which number the sandbox remembers the question (prefetch.py), as it says.
    """

    name: str
    arguments: tuple[Any, ...]
    keywords: dict[str, Any]
    slot: object = None


class Sandbox:
    """A warm pool of worker processes. One per process that runs programs; use it as a context manager or close it.

    A program and its host take turns and never run at once, so they are fastest on one core: with `pin`, workers stay
    on the core that opened the pool. Where latency matters, keep the process that runs programs on that core as well
    (`os.sched_setaffinity` before the sandbox is opened): benchmarks/program_tick.py shows what it is worth.
    """

    def __init__(
        self,
        budget: Budget | None = None,
        *,
        workers: int = 2,
        max_workers: int = 8,
        pin: bool = True,
        clock: Callable[[], float] = time.thread_time,
    ) -> None:
        """Start the workers.

        Args:
            budget: Limits of every program; the defaults if None.
            workers: Workers kept warm.
            max_workers: Most programs running at once.
            pin: Keep workers on the present core, where the platform can.
            clock: Processor time of the host, s; the worker's is added for the control period's budget.

        Raises:
            SandboxError: The worker program cannot be started.
        """
        self.budget = Budget() if budget is None else budget
        self._clock = clock
        self._core = present_core() if pin else None
        self._pool = monty.Monty(
            min_processes=workers,
            max_processes=max_workers,
            checkout_timeout=1.0,
            request_timeout=self.budget.start_s,
            turn_duration_limit_grace=self.budget.grace_s,
        )
        try:
            with on_core(self._core), uninterrupted():  # the pool's threads and workers inherit both
                self._pool.__enter__()
        except (OSError, monty.MontyError) as error:
            raise SandboxError(
                f"The sandbox's worker does not start: {error}.", hint="Run: pip install 'pydantic-monty>=1.4,<1.5'"
            ) from error
        self._open = True

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.close()

    def close(self) -> None:
        """End the workers; programs still running end with them. May be called twice."""
        if self._open:
            self._open = False
            self._pool.__exit__(None, None, None)

    def start(self, prepared: Prepared, names: Iterable[str]) -> SandboxRun:
        """Read a program, run its top level and leave it waiting before its main function's first line.

        Args:
            prepared: The rewritten program.
            names: Host functions it may call.

        Raises:
            ProgramFaultError: The program itself is to blame.
            SandboxError: No worker can be had.
        """
        run = self._checkout()
        try:
            run.load(prepared, names)
        except BaseException:
            run.close()
            raise
        return run

    def resume(self, state: bytes) -> SandboxRun:
        """Continue a program from `SandboxRun.dump()`, in any process. Only for bytes from a trusted place.

        Raises:
            SandboxError: The bytes are no snapshot of this version, or no worker can be had.
        """
        run = self._checkout()
        try:
            run.restore(state)
        except BaseException:
            run.close()
            raise
        return run

    def _checkout(self) -> SandboxRun:
        if not self._open:
            raise SandboxError("The sandbox is closed.", hint="Open a new one.")
        budget = self.budget
        session = self._pool.checkout(
            script_name="program.py",
            limits={
                "max_turn_duration_secs": budget.turn_s,
                "max_memory": budget.memory_bytes,
                "max_recursion_depth": budget.recursion,
                "max_total_sleep_secs": 0.0,
                "max_suspensions": 2**31,  # counted per control period instead, by SandboxRun
            },
            assert_message_annotations=False,
            # The same program in the same world must do the same: no clock, no entropy.
            os_policy={"datetime": _EPOCH, "sleep": "system", "process_time": "zero", "random_start": {"seed": 0}},
        )
        try:
            session.__enter__()
        except TimeoutError as error:
            raise SandboxError(
                "All sandbox workers are busy.", hint="Close executors that are done.", retryable=True
            ) from error
        except (OSError, monty.MontyError) as error:
            raise SandboxError(f"No sandbox worker can be had: {error}.", retryable=True) from error
        if session.worker_pid is not None:
            confine(session.worker_pid, self._core)
        return SandboxRun(session, budget, self._clock)


class SandboxRun:
    """One program in its worker. `answer` and `refuse` let it run on to its next call to the host."""

    def __init__(self, session: monty.MontySession, budget: Budget, clock: Callable[[], float]) -> None:
        self._session = session
        self._budget = budget
        self._host_clock, self._worker_clock = clock, processor_time(session.worker_pid)
        self._names: frozenset[str] = frozenset()
        self._slotted: frozenset[str] = frozenset()
        self._snapshot: monty.FunctionSnapshot | None = None
        self._program_feed = "<python-input-0>"
        self._calls = 0
        self._deadline = 0.0
        self._open = True
        self.used_at_fault: object = None

    @property
    def worker_pid(self) -> int | None:
        """Process id of the worker, for diagnostics."""
        return self._session.worker_pid

    def _clock(self) -> float:
        """Processor time of both, s."""
        return self._host_clock() + self._worker_clock()

    def begin_tick(self) -> None:
        """A new control period: budgets start afresh."""
        self._calls = 0
        self._deadline = self._clock() + self._budget.tick_s

    def load(self, prepared: Prepared, names: Iterable[str]) -> None:
        """Read helpers and program, and run to the first tick. Raises ProgramFaultError."""
        self._names = frozenset((TICK, DRIVE, END, WISH, *names))
        self._calls = 0
        self._deadline = self._clock() + self._budget.start_s
        stood_in = prepared.stood_in | {TICK, DRIVE}
        self._slotted = prepared.stood_in & FORESEEABLE
        inputs = {hidden(name) if name in stood_in else name: _host_function(name) for name in sorted(self._names)}
        self._program_feed = "<python-input-1>"
        self._advance(lambda: self._session.feed_start(prepared.helpers, inputs=inputs, print_callback=_drop))
        call = self._advance(lambda: self._session.feed_start(prepared.program, print_callback=_drop))
        if call is None or call.name != TICK:
            raise ProgramRaisedError(
                "The program calls a driving API outside its functions.",
                exception="RuntimeError",
                hint="Call driving APIs inside the main function.",
            )

    def restore(self, state: bytes) -> None:
        """Take over a dumped program. Raises SandboxError."""
        try:
            names, slotted, feed, rest = state.split(b"\n", 3)
            self._names, self._slotted = frozenset(names.decode().split()), frozenset(slotted.decode().split())
            self._program_feed = feed.decode()
            snapshot = self._session.load_snapshot(rest, print_callback=_drop)
        except (monty.MontyError, ValueError) as error:
            raise SandboxError(f"The snapshot cannot be loaded: {str(error)[:MAX_MESSAGE_CHARS]}.") from error
        if not isinstance(snapshot, monty.FunctionSnapshot):
            raise SandboxError("The snapshot does not wait for its host.")
        self._snapshot = snapshot

    def dump(self) -> bytes:
        """The waiting program as bytes.

        Raises:
            SandboxError: It does not wait.
            ProgramFaultError: Its worker died of it, e.g. because the state does not fit into the program's memory a
                second time; the run is closed.
        """
        if self._snapshot is None:
            raise SandboxError("Only a waiting program can be dumped.")
        head = f"{' '.join(sorted(self._names))}\n{' '.join(sorted(self._slotted))}\n{self._program_feed}\n"
        with self._faults():
            return head.encode() + self._snapshot.dump()

    def answer(self, value: object) -> HostCall | None:
        """Give the result of the waiting call; returns the next call, or None when the program has ended.

        Raises:
            ProgramFaultError: The program failed; the run is closed.
        """
        snapshot = self._waiting()
        return self._advance(lambda: snapshot.resume({"return_value": value}))

    def refuse(self, error: Exception) -> HostCall | None:
        """Raise an error inside the program at the waiting call; otherwise as `answer`."""
        snapshot = self._waiting()
        return self._advance(lambda: snapshot.resume({"exception": error}))

    def charge(self, calls: int) -> None:
        """Count calls that were answered inside the sandbox, and look at the time.

        Raises:
            ProgramCallsError, ProgramTimeError: The period's budget is used up; the run is closed.
        """
        self._calls += calls
        with self._faults():
            self._look_at_budget(None)

    def close(self) -> None:
        """Give the worker back. May be called twice."""
        if self._open:
            self._open = False
            self._snapshot = None
            # A worker that is already gone has nothing to give back.
            with contextlib.suppress(monty.MontyError, OSError, RuntimeError):
                self._session.__exit__(None, None, None)

    def _waiting(self) -> monty.FunctionSnapshot:
        assert self._snapshot is not None, "the program does not wait for an answer"
        return self._snapshot

    def _advance(self, step: Callable[[], monty.SyncSnapshot]) -> HostCall | None:
        self._snapshot = None
        with self._faults():
            while True:
                state = step()
                if isinstance(state, monty.MontyComplete):
                    return None
                self._calls += 1
                self._look_at_budget(state)
                if isinstance(state, monty.NameLookupSnapshot):
                    step = state.resume  # left undefined: NameError in the program
                elif isinstance(state, monty.FutureSnapshot):
                    step = _never(state)
                elif state.is_os_function:
                    step = state.resume_not_handled  # PermissionError or ModuleNotFoundError in the program
                elif state.function_name in self._names:
                    self._snapshot = state
                    name, arguments = str(state.function_name), state.args
                    if name in self._slotted and arguments:
                        return HostCall(name, arguments[1:], state.kwargs, arguments[0])
                    return HostCall(name, arguments, state.kwargs)
                else:
                    step = _unknown(state)

    @contextlib.contextmanager
    def _faults(self) -> Generator[None]:
        """Whatever goes wrong with the worker meanwhile is the program's fault, in words, and the end of the run."""
        try:
            yield
        except ProgramFaultError:
            self.close()
            raise
        except monty.MontyError as error:
            self._read_used(error)
            self.close()
            raise fault_of(error, self._program_feed) from None
        except (RuntimeError, OSError, ValueError) as error:  # how the pool speaks of a worker that is gone
            self.close()
            raise ProgramCrashError(
                f"The program's sandbox worker is gone: {str(error)[:MAX_MESSAGE_CHARS]}."
            ) from error
        except BaseException:
            self.close()
            raise

    def _read_used(self, error: monty.MontyError) -> None:
        """Ask a program that has just failed, if its worker still answers, which foreseen answers it had used."""
        if isinstance(error, monty.MontyRuntimeError):
            with contextlib.suppress(monty.MontyError, OSError, RuntimeError):  # or it is gone
                self.used_at_fault = self._session.feed_run(AT_FAULT)

    def _look_at_budget(
        self, state: monty.FunctionSnapshot | monty.NameLookupSnapshot | monty.FutureSnapshot | None
    ) -> None:
        """Raise ProgramCallsError or ProgramTimeError where the period's budget is used up."""
        if self._calls > self._budget.calls:
            raise self._too_many_calls(self._line_of(state))
        if self._clock() > self._deadline:
            raise ProgramTimeError(
                f"The program took more than {self._budget.tick_s * 1000:.0f} ms of one control period.",
                line=self._line_of(state),
                hint="Compute less between two yields.",
            )

    def _too_many_calls(self, line: int | None) -> ProgramCallsError:
        return ProgramCallsError(
            f"The program made more than {self._budget.calls} calls in one control period.",
            line=line,
            hint="Yield autopilot() once per pass through every loop.",
        )

    def _line_of(
        self, state: monty.FunctionSnapshot | monty.NameLookupSnapshot | monty.FutureSnapshot | None
    ) -> int | None:
        """Line at which a program waits that will not go on: an error raised there tells; None if it is caught."""
        if isinstance(state, monty.FunctionSnapshot):
            try:
                state.resume({"exception": RuntimeError("stopped")})
            except monty.MontyError as error:
                return fault_of(error, self._program_feed).line
        return None


def _unknown(state: monty.FunctionSnapshot) -> Callable[[], monty.SyncSnapshot]:
    missing = NameError(f"name '{str(state.function_name)[:60]}' is not defined")
    return lambda: state.resume({"exception": missing})


def _never(state: monty.FutureSnapshot) -> Callable[[], monty.SyncSnapshot]:
    refusal = RuntimeError("nothing to await: programs wait with yield autopilot()")
    return lambda: state.resume({call: {"exception": refusal} for call in state.pending_call_ids})


def _host_function(name: str) -> Callable[[], None]:
    """A function that only lends its name: the sandbox hands calls of it to the host instead of making them."""

    def placeholder() -> None:
        raise AssertionError("host functions are answered by SandboxRun")

    placeholder.__name__ = name
    return placeholder


def _drop(_stream: str, _text: str) -> None:
    """What a program prints is for nobody; it speaks to people with say()."""
