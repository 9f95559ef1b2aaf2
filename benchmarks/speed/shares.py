"""Where the time of a run goes: timers put around functions from outside, each counting what is its own."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

from chauffeur.bench.lampilot import rollout
from chauffeur.driving.judge.lampilot import LampilotReferee
from chauffeur.programs import executor
from chauffeur.programs.binding import DrivingApis
from chauffeur.programs.sandbox import Sandbox, SandboxRun
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.core import CoreRoad
from chauffeur.worlds.highway.driver import HighwayDriver

CORE = "core"
SANDBOX = "sandbox"
RESET = "reset"
HARNESS = "harness"

_PLACES: tuple[tuple[str, Any, tuple[str, ...]], ...] = (
    (CORE, CoreRoad, ("advance",)),
    (RESET, HighwayWorld, ("reset",)),
    (SANDBOX, SandboxRun, ("load", "answer", "refuse", "close")),
    (SANDBOX, Sandbox, ("_checkout",)),
    (f"{HARNESS}: answers of the driving APIs", DrivingApis, ("call", "foreseen", "account", "settle", "begin_tick")),
    (f"{HARNESS}: driver", HighwayDriver, ("settle", "command")),
    (f"{HARNESS}: referee and signals", LampilotReferee, ("__init__", "observe", "signals", "metrics")),
    (f"{HARNESS}: checks of the plan", rollout, ("run_checks",)),
    (f"{HARNESS}: program read and rewritten", executor, ("check_source", "prepare")),
    (f"{HARNESS}: loop, executor, world, row", rollout, ("roll_out",)),
)


class Shares:
    """Seconds by label. Time in a timed function that another calls is the inner one's, but a reset is one piece."""

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        self.seconds: Counter[str] = Counter()
        self._open: list[str] = []
        self._mark = 0.0

    def timed(self, label: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function with a timer around it."""

        def call(*args: Any, **options: Any) -> Any:
            now = self._clock()
            if self._open:
                self.seconds[self._open[-1]] += now - self._mark
            self._open.append(RESET if RESET in self._open else label)
            self._mark = now
            try:
                return function(*args, **options)
            finally:
                now = self._clock()
                self.seconds[self._open.pop()] += now - self._mark
                self._mark = now

        return call

    @contextmanager
    def watching(self) -> Generator[None]:
        """Put the timers in place, and take them away afterwards."""
        before = [(place, name, getattr(place, name)) for _, place, names in _PLACES for name in names]
        try:
            for label, place, names in _PLACES:
                for name in names:
                    setattr(place, name, self.timed(label, getattr(place, name)))
            yield
        finally:
            for place, name, function in before:
                setattr(place, name, function)
