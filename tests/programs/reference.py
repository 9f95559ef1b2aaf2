"""The bare-Python reference: what a program means, by definition. Only for the benign programs of these tests."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

from chauffeur.concept import ApiCall, ProgramState, Setpoints
from chauffeur.programs import APIS, DrivingApis, starting_setpoints
from chauffeur.programs.rewrite import main_function, parse
from chauffeur.worlds.base import World


@dataclass(frozen=True)
class Trace:
    """One control period, as both runners report it."""

    state: ProgramState
    setpoints: Setpoints
    said: tuple[str, ...]
    calls: tuple[ApiCall, ...]
    line: int | None
    error: str


class BareRunner:
    """Runs a program as a CPython generator over the same bound APIs."""

    def __init__(self, source: str, world: World) -> None:
        self._world = world
        perception = world.perception()
        self.apis = DrivingApis(perception, world.driver(), starting_setpoints(perception))
        names: dict[str, Any] = {api: self._bound(api) for api in APIS}
        main = main_function(parse(source))
        assert main is not None
        # The reference is CPython itself, and the texts are the tests' own.
        exec(compile(source, "program", "exec"), names)
        self._generator: Generator[Any, None, None] | None = names[main.name]()

    def _bound(self, name: str) -> Any:
        return lambda *args, **kwargs: self.apis.call(name, args, kwargs)

    def tick(self) -> Trace:
        self.apis.begin_tick(self._world.perception())
        state: ProgramState = "running"
        error = ""
        line = None
        if self._generator is None:
            state = "finished"
        else:
            try:
                next(self._generator)
                line = _line(self._generator)
            except StopIteration:
                state = "finished"
            except Exception as raised:
                state, error = "failed", type(raised).__name__
        if state != "running":
            self._generator = None
        self.apis.settle()
        return Trace(state, self.apis.setpoints, self.apis.said, self.apis.calls, line, error)


def _line(generator: Any) -> int:
    while getattr(generator, "gi_yieldfrom", None) is not None:
        generator = generator.gi_yieldfrom
    return generator.gi_frame.f_lineno
