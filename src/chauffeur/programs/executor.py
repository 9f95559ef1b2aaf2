"""Drives a language-model program: one `next()` per control period, whatever the program does."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Final, Self

from chauffeur.concept import STOP_ZONE_M, ApiCall, ProgramError, ProgramState, SandboxError, Setpoints
from chauffeur.programs.binding import DrivingApis, MadeCall, starting_setpoints
from chauffeur.programs.catalogue import Vocabulary, apis_of
from chauffeur.programs.errors import (
    BadArgumentTypeError,
    BadArgumentValueError,
    ProgramFaultError,
    ProgramRefusedError,
)
from chauffeur.programs.gate import check_source
from chauffeur.programs.prefetch import DRIVE, END, TICK, WISH
from chauffeur.programs.rewrite import prepare
from chauffeur.programs.sandbox import Budget, Sandbox, SandboxRun
from chauffeur.programs.street import TownApis
from chauffeur.worlds.base import StreetPerception, World

_FORMAT: Final = "chauffeur-program-3"
_PERIOD_ENDS: Final = frozenset({TICK, DRIVE, END})


@dataclass(frozen=True, slots=True)
class TickResult:
    """What one control period of a program came to.

    Attributes:
        setpoints: What the car should do; the last set-points stay when a program has finished or failed.
        state: State of the program after this period.
        line: Line (1-based) it waits at, or failed at; None when it has finished.
        said: Texts for the passenger.
        made: Driving-API calls made; `calls` puts them into words.
        error: Why it failed; on the failing period and all later ones.
    """

    setpoints: Setpoints
    state: ProgramState
    line: int | None = None
    said: tuple[str, ...] = ()
    made: tuple[MadeCall, ...] = ()
    error: ProgramError | None = None

    @property
    def calls(self) -> tuple[ApiCall, ...]:
        """Driving-API calls made, in words."""
        return tuple(call.in_words() for call in self.made)


class ProgramExecutor:
    """Runs one program at a time in a sandbox. Use it as a context manager or close it.

    Nothing a program does raises from here: its faults are `TickResult.error`. What may raise is `SandboxError`, when
    no worker can be had at all, and whatever the world itself raises.
    """

    def __init__(
        self,
        *,
        sandbox: Sandbox | None = None,
        budget: Budget | None = None,
        library: str = "",
        gate: bool = True,
        stop_zone_m: float = STOP_ZONE_M,
    ) -> None:
        """Open a sandbox, or share one.

        Args:
            sandbox: Sandbox to share (it stays open); None opens one for this executor alone.
            budget: Limits, when a sandbox is opened here.
            library: Helper functions every program may call with `yield from`; checked like a program.
            gate: Whether programs pass the static gate first. Turned off only to show that the sandbox holds alone.
            stop_zone_m: As `DrivingApis` takes it.
        """
        self._owned = Sandbox(budget) if sandbox is None else None
        self._sandbox = self._owned if self._owned is not None else sandbox
        self._library = library
        self._gate = gate
        self._stop_zone_m = stop_zone_m
        self._world: World | None = None
        self._apis: DrivingApis | None = None
        self._run: SandboxRun | None = None
        self._state: ProgramState = "none"
        self._line: int | None = None
        self._error: ProgramError | None = None
        self._vocabulary: Vocabulary = "road"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.close()

    def close(self) -> None:
        """End the program, and the sandbox if it was opened here. May be called twice."""
        self._end_run()
        if self._owned is not None:
            self._owned.close()

    @property
    def state(self) -> ProgramState:
        """State of the program."""
        return self._state

    @property
    def worker_pid(self) -> int | None:
        """Process id of the program's worker, for diagnostics; None when no program runs."""
        return None if self._run is None else self._run.worker_pid

    def start(
        self, source: str, world: World, *, setpoints: Setpoints | None = None, library: str | None = None
    ) -> ProgramState:
        """Read a program; its main function starts with the first tick.

        Args:
            source: Program text.
            world: World it drives in.
            setpoints: What holds already, e.g. a previous program's set-points; None is present speed, lane and 1.5 s.
            library: Its helper functions, in place of the executor's own; None for those.

        Returns:
            `running`, or `failed`; the next tick then says why.
        """
        self._end_run()
        self._bind(world, setpoints)
        helpers = self._library if library is None else library
        try:
            if self._gate:
                report = check_source(source, helpers, self._vocabulary)
                if not report.passed:
                    first = report.errors[0]
                    raise ProgramRefusedError(first.reason, line=first.line, hint=first.remedy)
            prepared = prepare(source, helpers)
            self._run = self._open().start(prepared, apis_of(self._vocabulary))
            self._state, self._line = "running", prepared.main_line
        except ProgramFaultError as error:
            self._fail(error)
        return self._state

    def tick(self) -> TickResult:
        """Let the program run for one control period, until its next yield.

        Raises:
            SandboxError: Nothing was started.
        """
        apis, world = self._apis, self._world
        if apis is None or world is None:
            raise SandboxError("No program was started.", hint="Call start(source, world) first.")
        apis.begin_tick(world.perception())
        if self._run is not None:
            try:
                self._advance(self._run, apis)
            except ProgramFaultError as error:
                apis.account(self._run.used_at_fault)
                self._fail(error)
            except BaseException:  # the world's own fault: give the worker back, then let it be known
                self._end_run()
                raise
        apis.settle()
        return TickResult(apis.setpoints, self._state, self._line, apis.said, apis.made, self._error)

    def _advance(self, run: SandboxRun, apis: DrivingApis) -> None:
        run.begin_tick()
        call = run.answer(apis.foreseen())
        while call is not None and call.name not in _PERIOD_ENDS:
            try:
                if call.name == WISH:
                    pending = call.arguments[0] if call.arguments else None
                    run.charge(len(pending) if isinstance(pending, list) else 0)
                    value: Any = apis.wish_later(pending)
                else:
                    value = apis.call(call.name, call.arguments, call.keywords, call.slot)
            except BadArgumentTypeError as error:
                call = run.refuse(TypeError(str(error)))
            except BadArgumentValueError as error:
                call = run.refuse(ValueError(str(error)))
            else:
                call = run.answer(value)
        if call is not None:
            run.charge(apis.account(call.arguments[-2:]))
            if call.name == END:
                call = run.answer(None)
        if call is None:
            self._end_run()
            self._state, self._line = "finished", None
            return
        if call.name == DRIVE:
            apis.call("autopilot", (), {})
        line = call.arguments[0] if call.arguments else None
        self._line = line if isinstance(line, int) and line > 0 else None

    def dump(self) -> bytes:
        """The waiting program with its set-points, to be continued by `load`; keep the bytes in a trusted place.

        Raises:
            SandboxError: No program is running, or this one failed of it; the next tick then says why.
        """
        if self._run is None or self._apis is None:
            raise SandboxError("Only a running program can be dumped.")
        try:
            body = self._run.dump()
        except ProgramFaultError as error:
            self._fail(error)
            raise SandboxError(f"The program failed while it was put down: {error}") from error
        vehicles, lanes = self._apis.handles.issued()
        setpoints = self._apis.setpoints
        head = {
            "line": self._line,
            "vehicles": vehicles,
            "lanes": lanes,
            _FORMAT: {
                "target_speed_mps": setpoints.target_speed_mps,
                "time_headway_s": setpoints.time_headway_s,
                "target_lane": setpoints.target_lane,
                "turn": setpoints.turn,
                "served_stops": sorted(setpoints.served_stops),
            },
        }
        return json.dumps(head).encode() + b"\n" + body

    def load(self, state: bytes, world: World) -> None:
        """Continue a dumped program in a world at the same instant. Only for bytes from a trusted place.

        Raises:
            SandboxError: The bytes are not from `dump` of this version.
        """
        self._end_run()
        head_text, _, rest = state.partition(b"\n")
        try:
            head: dict[str, Any] = json.loads(head_text)
            kept = head[_FORMAT]
            setpoints = Setpoints(
                target_speed_mps=kept["target_speed_mps"],
                time_headway_s=kept["time_headway_s"],
                target_lane=None if kept["target_lane"] is None else str(kept["target_lane"]),
                turn=kept["turn"],
                served_stops=frozenset(kept["served_stops"]),
            )
            vehicles, lanes, line = head["vehicles"], [str(lane) for lane in head["lanes"]], head["line"]
        except (ValueError, KeyError, TypeError) as error:
            raise SandboxError("The bytes are no dumped program of this version.") from error
        apis = self._bind(world, setpoints)
        for vehicle in vehicles:
            apis.handles.give_vehicle(vehicle)
        for lane in lanes:
            apis.handles.give_lane(lane)
        self._run = self._open().resume(rest)
        self._state, self._line = "running", line

    def _open(self) -> Sandbox:
        assert self._sandbox is not None
        return self._sandbox

    def _bind(self, world: World, setpoints: Setpoints | None) -> DrivingApis:
        perception = world.perception()
        begun = starting_setpoints(perception) if setpoints is None else setpoints
        apis: DrivingApis
        if isinstance(perception, StreetPerception):
            self._vocabulary = "town"
            apis = TownApis(perception, world.driver(), begun, stop_zone_m=self._stop_zone_m)
        else:
            self._vocabulary = "road"
            apis = DrivingApis(perception, world.driver(), begun, stop_zone_m=self._stop_zone_m)
        self._world, self._apis = world, apis
        self._state, self._line, self._error = "none", None, None
        return apis

    def _fail(self, error: ProgramFaultError) -> None:
        self._end_run()
        self._state, self._error = "failed", error
        self._line = error.line if error.line is not None else self._line

    def _end_run(self) -> None:
        if self._run is not None:
            self._run.close()
            self._run = None
