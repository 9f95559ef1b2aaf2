"""Coroutines are run wherever the caller stands, and nothing of them stays behind."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Iterator
from contextvars import ContextVar

import pytest

from chauffeur.driving import event_loop

_said: ContextVar[str] = ContextVar("_said", default="nothing")


async def _work() -> tuple[str, str]:
    await asyncio.sleep(0)
    return threading.current_thread().name, _said.get()


async def _broken() -> None:
    raise ValueError("it broke")


def _left() -> list[str]:
    return [thread.name for thread in threading.enumerate() if thread.name == "chauffeur-loop"]


def test_without_a_loop_it_runs_here() -> None:
    assert event_loop.run(_work())[0] == threading.current_thread().name


def test_inside_a_loop_it_runs_aside_in_the_context_of_the_caller() -> None:
    async def cell() -> tuple[str, str]:
        _said.set("left")
        return event_loop.run(_work())

    assert asyncio.run(cell()) == ("chauffeur-loop", "left")
    assert not _left()


def test_its_error_is_the_callers() -> None:
    async def cell() -> None:
        event_loop.run(_broken())

    async def awaited() -> None:
        await event_loop.run_aside(_broken())

    for one in (cell, awaited):
        with pytest.raises(ValueError, match="it broke"):
            asyncio.run(one())


def test_the_loop_goes_on_while_it_waits() -> None:
    async def cell() -> None:
        other = asyncio.Event()
        loop = asyncio.get_running_loop()

        async def until_told() -> None:
            told = asyncio.run_coroutine_threadsafe(_set(other), loop)
            await asyncio.wrap_future(told)

        await event_loop.run_aside(until_told())
        assert other.is_set()

    asyncio.run(asyncio.wait_for(cell(), 30))


async def _set(event: asyncio.Event) -> None:
    event.set()


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Python's own interrupt, also where the tests were started in the background of a shell, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_cancels_it_and_waits_for_it_to_clean_up() -> None:
    ended: list[str] = []
    caller = threading.get_ident()

    async def endless() -> None:
        try:
            signal.pthread_kill(caller, signal.SIGINT)
            await asyncio.sleep(600)
        finally:
            await asyncio.sleep(0)
            ended.append("cleaned up")

    async def cell() -> None:
        event_loop.run(endless())

    loop = asyncio.new_event_loop()  # as Jupyter's: nothing of its own is put in place of Python's interrupt
    try:
        with pytest.raises(KeyboardInterrupt):
            loop.run_until_complete(cell())
    finally:
        loop.close()
    assert ended == ["cleaned up"] and not _left()


def test_cancelling_the_awaiting_task_cancels_it() -> None:
    ended = threading.Event()

    async def cell() -> None:
        begun = asyncio.Event()
        loop = asyncio.get_running_loop()

        async def endless() -> None:
            loop.call_soon_threadsafe(begun.set)
            try:
                await asyncio.sleep(600)
            finally:
                ended.set()

        task = asyncio.create_task(event_loop.run_aside(endless()))
        await begun.wait()
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    asyncio.run(cell())
    assert ended.wait(30)
