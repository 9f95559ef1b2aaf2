"""Limit on calls in flight at once: as many as the endpoint takes, found while working.

Nobody publishes that number, and it changes with the load of others, so it is found as TCP finds a line's capacity:
start modestly, double while nothing is refused, fall back when the endpoint pushes back, then creep up again. A refusal
(429) comes at once and costs little, and what is still in flight after it is what the endpoint took: that is where the
window falls to, so a hard cap is found in one burst and not sawed at. `Window` is the arithmetic, on times it is
given; `Gate` makes callers wait.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from dataclasses import dataclass, field
from typing import Literal

Signal = Literal["answered", "refused", "overloaded", "slow", "unreachable", "neither"]
"""Signal of a finished call about the endpoint: it answered; it refused for now (429); it broke under way (5xx); no
answer came in time; nobody was there; or nothing either way (bad request, cancelled)."""

START = 8
RAMP_S = 0.2
"""The window doubles this often at first. Refusals come sooner than that; answers take far longer."""

_KEEP = {"refused": 0.95, "overloaded": 0.9, "slow": 0.7}
"""Share of the window kept; for refusals, of what is still in flight."""
_BURST_FLOOR = 0.5
"""A burst of refusals never leaves less than this share."""
_PROBE_S = 5.0
_PROBE_MAX_S = 30.0
_CREEP = 0.25
"""Growth per answer of a window whose ceiling is not known: a quarter more for each window of answers."""
_BACK_OFF_S = 0.5
_BACK_OFF_MAX_S = 30.0


@dataclass(slots=True)
class Window:
    """Bound of the calls in flight. Every time is in seconds of one clock that never goes back.

    Attributes:
        most: Never more than this.
        limit: Present bound; fractions add up.
        held_until_s: Nothing is sent before this.
        ceiling: How many were in flight when the endpoint last pushed back; None when that is not known.
    """

    most: int
    limit: float = 0.0
    held_until_s: float = -math.inf
    ceiling: int | None = None
    _ramping: bool = True
    _widened_s: float = math.inf
    _cut_s: float = -math.inf
    _floor: float = 1.0
    _failed_in_row: int = 0
    _probe_s: float = math.inf
    _probing_s: float = math.inf
    _probe_wait_s: float = _PROBE_S

    def __post_init__(self) -> None:
        self.limit = float(min(self.most, START))

    def takes(self, in_flight: int, now_s: float) -> bool:
        """True if one more call may be sent beside those in flight."""
        return now_s >= self.held_until_s and in_flight < int(self.limit)

    def sent(self, now_s: float) -> None:
        """A call was sent."""
        self._widened_s = min(self._widened_s, now_s)

    def wake_s(self, now_s: float) -> float:
        """Time at which to ask `takes` again although no call came back; infinite when there is none."""
        if self.held_until_s > now_s:
            return self.held_until_s
        return self._widened_s + RAMP_S if self._ramping and self.limit < self.most else math.inf

    def widen(self, in_flight: int, now_s: float) -> None:
        """Double while nothing was refused and the window is full."""
        if self._ramping and in_flight >= int(self.limit) and now_s >= self._widened_s + RAMP_S:
            self.limit = min(self.most, 2.0 * self.limit)
            self._widened_s = now_s

    def finished(
        self, signal: Signal, sent_s: float, in_flight: int, now_s: float, asked_s: float | None = None
    ) -> None:
        """A call came back.

        Args:
            signal: What it says.
            sent_s: When it was sent.
            in_flight: How many others still are.
            now_s: The present.
            asked_s: How long the endpoint asked to wait; None when it did not.
        """
        if signal == "answered":
            self._failed_in_row = 0
            self._grow(sent_s, now_s)
        elif signal == "refused" and self._same_ceiling(in_flight, now_s):
            self._hold(signal, False, in_flight, now_s, asked_s)
        elif signal != "neither":
            self._fall(signal, sent_s, in_flight, now_s, asked_s)

    def _grow(self, sent_s: float, now_s: float) -> None:
        if self._ramping or self.limit >= self.most:
            return
        if self.ceiling is None:
            self.limit += _CREEP
        elif sent_s >= self._probing_s:  # sent when one more than ever was allowed, and not refused: the cap has gone
            self.ceiling = None
            self._probe_wait_s = _PROBE_S
        elif self.limit + 1.0 <= self.ceiling:
            self.limit += 1.0 / self.limit  # one more for each window of answers
        elif now_s >= self._probe_s and self._probing_s == math.inf:
            self._probing_s = now_s
            self.limit = self.ceiling + 1.0
        self.limit = min(self.limit, float(self.most))

    def _same_ceiling(self, in_flight: int, now_s: float) -> bool:
        """True if a refusal only says that one more than known is still too much: nothing is lost but that call."""
        if self.ceiling is None or self._probing_s == math.inf or in_flight < self.ceiling:
            return False
        self.limit = float(self.ceiling)
        self._probe_wait_s = min(2.0 * self._probe_wait_s, _PROBE_MAX_S)
        self._probe_s = now_s + self._probe_wait_s
        self._probing_s = math.inf
        return True

    def _fall(self, signal: Signal, sent_s: float, in_flight: int, now_s: float, asked_s: float | None) -> None:
        fresh = sent_s >= self._cut_s
        if fresh:  # sent after the last cut: new evidence, not the rest of a burst
            # While ramping, refusals may be late and the window far too wide: what is in flight tells all.
            self._floor = max(1.0, min(START, self.limit / 2.0) if self._ramping else _BURST_FLOOR * self.limit)
            self._failed_in_row += 1
            self._ramping = False
            self._cut_s = now_s
        self._probing_s = math.inf
        if signal == "refused":
            self.ceiling = max(1, in_flight)
            self.limit = max(self._floor, min(self.limit, _KEEP["refused"] * in_flight))
            self._probe_s = now_s + self._probe_wait_s
        elif fresh:
            self.ceiling = max(1, int(self.limit))
            self.limit = max(1.0, self.limit * _KEEP.get(signal, 1.0))
            self._probe_s = now_s + self._probe_wait_s
        self._hold(signal, fresh, in_flight, now_s, asked_s)

    def _hold(self, signal: Signal, fresh: bool, in_flight: int, now_s: float, asked_s: float | None) -> None:
        hold_s = asked_s or 0.0
        # Without a wish of the endpoint's, wait longer each time when nothing else can tell us that it works again.
        if fresh and asked_s is None and (signal == "unreachable" or in_flight == 0 or self._failed_in_row > 2):
            hold_s = min(_BACK_OFF_MAX_S, _BACK_OFF_S * 2.0 ** (self._failed_in_row - 1))
        self.held_until_s = max(self.held_until_s, now_s + hold_s)


@dataclass(slots=True)
class Gate:
    """Lets callers through as its window allows, in the order they came. Belongs to one event loop."""

    window: Window
    in_flight: int = 0
    _open: bool = False
    _waiting: deque[asyncio.Future[None]] = field(default_factory=deque["asyncio.Future[None]"])
    _timer: asyncio.TimerHandle | None = None

    @property
    def held_s(self) -> float:
        """Seconds until something may be sent again; 0 when nothing is held back."""
        return max(0.0, self.window.held_until_s - asyncio.get_running_loop().time())

    async def enter(self) -> float:
        """Wait for a place; returns when it was given (the loop's clock). Every `enter` needs its `leave`."""
        loop = asyncio.get_running_loop()
        turn: asyncio.Future[None] = loop.create_future()
        self._waiting.append(turn)
        self._admit()
        try:
            await turn
        except asyncio.CancelledError:
            if turn.done() and not turn.cancelled():  # given a place in the instant of being cancelled
                self.leave("neither", loop.time())
            raise
        return loop.time()

    def leave(self, signal: Signal, sent_s: float, asked_s: float | None = None) -> None:
        """Give the place back, with what the call says of the endpoint."""
        self.in_flight -= 1
        self.window.finished(signal, sent_s, self.in_flight, asyncio.get_running_loop().time(), asked_s)
        self._admit()

    def open(self) -> None:
        """Let everybody through from now on: nothing is sent any more, and nobody is to wait for that."""
        self._open = True
        self._admit()

    def _admit(self) -> None:
        loop = asyncio.get_running_loop()
        now_s = loop.time()
        self.window.widen(self.in_flight, now_s)
        while self._waiting and (self._open or self.window.takes(self.in_flight, now_s)):
            turn = self._waiting.popleft()
            if not turn.done():
                self.in_flight += 1
                self.window.sent(now_s)
                turn.set_result(None)
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        wake_s = self.window.wake_s(now_s)
        if self._waiting and now_s < wake_s < math.inf:
            self._timer = loop.call_at(wake_s, self._admit)
