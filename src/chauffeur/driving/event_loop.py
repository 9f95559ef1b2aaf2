"""Run a coroutine from code that may itself stand in a running event loop, as every cell of a notebook does.

`asyncio.run` refuses there. The coroutine then gets a loop and a thread of its own.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from concurrent.futures import Future, InvalidStateError, wait
from contextlib import suppress
from threading import Thread
from typing import Any, Generic, TypeVar

_T = TypeVar("_T")
_LOOK_S = 0.5
"""Time between looks at interrupts, s: one that comes just before a thread waits for a lock does not end the wait."""


def run(work: Coroutine[Any, Any, _T]) -> _T:
    """Return what a coroutine returns. An interrupt cancels it and waits until it has cleaned up."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return asyncio.run(work)
    aside = _Aside(work)
    try:  # from here on, an interrupt may find the coroutine running, also while its thread is being started
        aside.start()
        while not wait([aside.outcome], timeout=_LOOK_S).done:
            pass
        return aside.outcome.result()
    finally:
        aside.outcome.cancel()
        if aside.is_alive():
            aside.join()


async def run_aside(work: Coroutine[Any, Any, _T]) -> _T:
    """Return what a coroutine returns, run in another thread: a simulation would hold up the caller's loop."""
    aside = _Aside(work)
    aside.start()
    return await asyncio.wrap_future(aside.outcome)


class _Aside(Thread, Generic[_T]):
    """A coroutine in a thread and an event loop of its own; cancelling `outcome` cancels it."""

    def __init__(self, work: Coroutine[Any, Any, _T]) -> None:
        super().__init__(name="chauffeur-loop", daemon=True)
        self.outcome: Future[_T] = Future()
        self._loop = asyncio.new_event_loop()
        self._task = self._loop.create_task(work)  # here, so that it has the caller's context variables
        self.outcome.add_done_callback(self._cancelled)

    def run(self) -> None:
        async def ended() -> None:
            await asyncio.wait([self._task])

        with asyncio.Runner(loop_factory=lambda: self._loop) as runner, suppress(InvalidStateError):  # cancelled
            try:
                runner.run(ended())
            finally:
                if self._task.cancelled():
                    self.outcome.cancel()
                elif (error := self._task.exception()) is not None:
                    self.outcome.set_exception(error)
                else:
                    self.outcome.set_result(self._task.result())

    def _cancelled(self, outcome: Future[_T]) -> None:
        if outcome.cancelled():
            with suppress(RuntimeError):  # the loop is closed: it has ended
                self._loop.call_soon_threadsafe(self._task.cancel)
