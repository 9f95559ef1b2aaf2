"""The window against endpoints of every temper, in virtual time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pytest
from virtual import run_virtually

from chauffeur.bench.kernel.pace import Gate, Signal, Window

LATENCY_S = 1.5


@dataclass
class Endpoint:
    """Takes so many calls at a time and so many a second; refuses the rest at once."""

    cap: Callable[[float], int] = lambda now: 10**9
    per_s: float = 0.0
    asks_s: float | None = None
    spread: float = 0.0
    refused: int = 0
    answered: int = 0
    busiest: int = 0
    _busy: int = 0
    _tokens: float = 0.0
    _filled_s: float = 0.0
    log: list[tuple[float, int]] = field(default_factory=list)
    _rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(1))

    async def call(self) -> tuple[Signal, float | None]:
        loop = asyncio.get_running_loop()
        await asyncio.sleep(0.01)
        now = loop.time()
        if self.per_s:
            self._tokens = min(self.per_s, self._tokens + (now - self._filled_s) * self.per_s)
            self._filled_s = now
            if self._tokens < 1:
                self.refused += 1
                return "refused", self.asks_s
            self._tokens -= 1
        if self._busy >= self.cap(now):
            self.refused += 1
            return "refused", self.asks_s
        self._busy += 1
        self.busiest = max(self.busiest, self._busy)
        await asyncio.sleep(LATENCY_S * (1.0 + self.spread * self._rng.uniform(-1.0, 1.0)) - 0.01)
        self._busy -= 1
        self.answered += 1
        self.log.append((loop.time(), self.answered))
        return "answered", None


async def _ask(endpoint: Endpoint, gate: Gate, calls: int, askers: int) -> float:
    left = [None] * calls

    async def one() -> None:
        while left:
            left.pop()
            signal: Signal = "refused"
            while signal != "answered":
                sent_s = await gate.enter()
                signal, asked_s = await endpoint.call()
                gate.leave(signal, sent_s, asked_s)

    await asyncio.gather(*(one() for _ in range(askers)))
    return asyncio.get_running_loop().time()


def _took_s(endpoint: Endpoint, most: int, calls: int) -> float:
    return run_virtually(_ask(endpoint, Gate(Window(most)), calls, most + 32))


def test_the_full_window_is_used_from_the_first_second() -> None:
    endpoint = Endpoint(cap=lambda now: 64)
    took_s = _took_s(endpoint, 64, 1000)
    assert endpoint.refused == 0, "never more than was allowed"
    assert 1000 / took_s > 0.93 * 64 / LATENCY_S


@pytest.mark.parametrize("asks_s", [None, 0.0, 1.0])
@pytest.mark.parametrize("most", [65, 100, 256, 1024])
def test_an_unknown_cap_is_found_and_kept(most: int, asks_s: float | None) -> None:
    endpoint = Endpoint(cap=lambda now: 64, asks_s=asks_s)
    took_s = _took_s(endpoint, most, 3000)
    assert 3000 / took_s > 0.9 * 64 / LATENCY_S
    assert endpoint.refused < 3000 * 0.05


def test_a_cap_that_falls_and_rises_is_followed() -> None:
    endpoint = Endpoint(cap=lambda now: 8 if 60 <= now < 180 else 64)
    _took_s(endpoint, 256, 9000)

    def rate(start_s: float, end_s: float) -> float:
        return sum(start_s <= when < end_s for when, _ in endpoint.log) / (end_s - start_s)

    assert rate(20, 60) > 0.9 * 64 / LATENCY_S
    assert rate(90, 180) > 0.75 * 8 / LATENCY_S
    assert rate(270, 300) > 0.75 * 64 / LATENCY_S
    assert endpoint.refused < 9000 * 0.1


@pytest.mark.parametrize(("asks_s", "least"), [(None, 7.5), (0.5, 7.5), (2.0, 6.0)])
def test_a_bound_on_the_rate_is_kept_to(asks_s: float | None, least: float) -> None:
    endpoint = Endpoint(per_s=10.0, asks_s=asks_s, spread=0.5)
    took_s = _took_s(endpoint, 256, 1000)
    assert 1000 / took_s > least
    assert endpoint.refused < 200


def test_an_asked_wait_is_kept_by_everybody() -> None:
    window = Window(64)
    window.finished("refused", 0.0, 3, 1.0, asked_s=20.0)
    assert not window.takes(0, 20.9)
    assert window.takes(0, 21.0)
    assert window.wake_s(5.0) == 21.0


def test_nobody_there_is_asked_less_and_less_often() -> None:
    sent: list[float] = []

    async def work() -> None:
        gate = Gate(Window(64))

        async def one() -> None:
            while True:
                sent_s = await gate.enter()
                sent.append(sent_s)
                await asyncio.sleep(0.001)
                gate.leave("unreachable", sent_s)

        tasks = [asyncio.create_task(one()) for _ in range(64)]
        await asyncio.sleep(300.0)
        for task in tasks:
            task.cancel()

    run_virtually(work())
    bursts = [b for a, b in zip([-1.0, *sent], sent, strict=False) if b - a > 0.1]
    assert 5 < len(bursts) < 20, "five minutes of nobody there"
    assert max(b - a for a, b in pairwise(bursts)) == pytest.approx(30.0, abs=0.1)


def test_timeouts_narrow_the_window_once_a_burst() -> None:
    window = Window(64, limit=64.0)
    window.limit = 64.0
    for i in range(20):
        window.finished("slow", 0.0, 63 - i, 60.0 + i * 1e-3)
    assert window.limit == pytest.approx(64 * 0.7)
    window.finished("slow", 61.0, 40, 121.0)
    assert window.limit == pytest.approx(64 * 0.7 * 0.7)


def test_the_window_never_closes() -> None:
    window = Window(4)
    for i in range(50):
        window.finished("refused", float(i), 0, i + 0.5)
        window.finished("slow", float(i), 0, i + 0.6)
    assert window.limit >= 1.0
    assert window.takes(0, 1e6)


def test_who_is_cancelled_gives_the_place_back() -> None:
    async def work() -> None:
        gate = Gate(Window(1))
        first = await gate.enter()
        waiting = [asyncio.create_task(gate.enter()) for _ in range(3)]
        await asyncio.sleep(0)
        waiting[0].cancel()
        gate.leave("answered", first)  # the place goes to the second: the first no longer waits
        waiting[1].cancel()  # in the instant in which it was given the place
        await asyncio.wait(waiting[:2])
        assert await asyncio.wait_for(waiting[2], 1.0) >= 0.0
        assert gate.in_flight == 1

    run_virtually(work())
