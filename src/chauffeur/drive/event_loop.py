"""Run a coroutine from code that may itself stand in a running event loop, as every cell of a notebook does.

`asyncio.run` refuses there. The coroutine then gets a loop and a thread of its own.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from concurrent.futures import Future
from threading import Thread
from typing import Any, TypeVar

_T = TypeVar("_T")


def run(work: Coroutine[Any, Any, _T]) -> _T:
    """Return what a coroutine returns. An interrupt cancels it and waits until it has cleaned up."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return asyncio.run(work)
    future, thread = _begin(work)
    try:
        return future.result()
    finally:
        future.cancel()
        thread.join()


async def run_aside(work: Coroutine[Any, Any, _T]) -> _T:
    """Return what a coroutine returns, run in another thread: a simulation would hold up the caller's loop."""
    return await asyncio.wrap_future(_begin(work)[0])


def _begin(work: Coroutine[Any, Any, _T]) -> tuple[Future[_T], Thread]:
    """Start a coroutine in a thread of its own; the thread ends with it."""
    started: Future[asyncio.AbstractEventLoop] = Future()

    def serve() -> None:
        with asyncio.Runner() as runner:
            loop = runner.get_loop()
            started.set_result(loop)
            loop.run_forever()

    thread = Thread(target=serve, name="chauffeur-loop", daemon=True)
    thread.start()
    loop = started.result()

    async def whole() -> _T:
        try:
            return await work
        finally:
            loop.call_soon(loop.stop)

    return asyncio.run_coroutine_threadsafe(whole(), loop), thread
