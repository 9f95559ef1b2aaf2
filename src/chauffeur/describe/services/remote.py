"""A service behind a cache: asked at most once at a time, never waited for longer than one may, last good answers kept.

What a request brings after the budget is spent is there for the next description. A service that fails is left alone
for a while, longer each time.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Generic, Protocol, TypeVar

from chauffeur.concept import DataError
from chauffeur.describe.services.http_request import FailureKind, ServiceError
from chauffeur.describe.services.readings import Position, ServiceReading, Unknown
from chauffeur.describe.services.units import age_words

if TYPE_CHECKING:
    import numpy as np

_log = logging.getLogger(__name__)

T = TypeVar("T")
U = TypeVar("U")
_REFUSALS: Final = 128
"""Refused places that are remembered."""

_FIRST_WAIT_S: Final[dict[FailureKind, float]] = {
    "key": 600.0, "busy": 30.0, "server": 5.0, "timeout": 2.0, "unreachable": 2.0, "broken": 2.0,
    "garbage": 5.0,
}  # fmt: skip
"""How long a service is left alone after its first failure; doubles with each one that follows. A refused request is no
failure of the service: only that place is left alone."""
_REFUSED_S: Final = 60.0
"""For so long a place that the service refused is not asked for again; TomTom refuses places without a road."""
_LONGEST_WAIT_S: Final = 900.0


@dataclass(frozen=True, slots=True)
class Told(Generic[T]):
    """What a service answered.

    Attributes:
        value: The answer, read.
        as_of_s: Unix time for which it holds, by the service's own word; None where it does not say.
    """

    value: T
    as_of_s: float | None = None


class Source(Protocol[T]):
    """One kind of service."""

    @property
    def name(self) -> str:
        """Who it is, for people."""
        ...

    @property
    def fresh_s(self) -> float:
        """An answer younger than this is not asked for again."""
        ...

    @property
    def usable_s(self) -> float:
        """An answer older than this is not told any more."""
        ...

    @property
    def oldest_s(self) -> float:
        """What the service itself says is older than this is not told."""
        ...

    @property
    def keeps(self) -> int:
        """Answers that are kept; the oldest go first."""
        ...

    @property
    def missing(self) -> str:
        """What to say where it answered, and not about this place."""
        ...

    def cell(self, here: Position) -> Hashable:
        """Positions of one cell get one answer."""
        ...

    def near(self, value: T, asked: Position, here: Position) -> bool:
        """Whether an answer for another position also tells about this one, so that no new one is needed."""
        ...

    def serves(self, value: T, asked: Position, here: Position) -> bool:
        """Whether an answer for another position is better than none for this one."""
        ...

    async def ask(self, here: Position) -> Told[T]:
        """Ask the service. Raises ServiceError, or DataError for an answer that cannot be read."""
        ...


@dataclass(frozen=True, slots=True)
class _Kept(Generic[T]):
    value: T
    asked: Position
    received_s: float
    as_of_s: float


class Remote(Generic[T]):
    """A service, its answers so far, and its failures.

    Args:
        source: The service.
        clock: Unix time in seconds.
        rng: Spreads the waits after failures, so that a fleet does not come back in the same instant.
    """

    def __init__(self, source: Source[T], clock: Callable[[], float], rng: np.random.Generator) -> None:
        self._source = source
        self._clock = clock
        self._rng = rng
        self._kept: OrderedDict[Hashable, _Kept[T]] = OrderedDict()
        self._refused: OrderedDict[Hashable, tuple[str, float]] = OrderedDict()
        self._running: asyncio.Task[None] | None = None
        self._failure: ServiceError | None = None
        self._failures = 0
        self._failed_s = 0.0
        self._wait_s = 0.0

    def start(self, here: Position) -> asyncio.Task[None] | None:
        """The request that is under way, begun now if one is needed; None if none is needed or allowed."""
        if self._running is not None and not self._running.done():
            if self._running.get_loop() is asyncio.get_running_loop():
                return None if self._answered(here) else self._running
            self._running = None  # its loop is gone, and it with it
        if self._answered(here) or self._refusal(here) or self._resting_s() > 0.0:
            return None
        self._running = asyncio.get_running_loop().create_task(self._ask(here))
        return self._running

    def read(self, here: Position, waited_s: float) -> ServiceReading[T] | Unknown:
        """The best answer there is for a position, with its age; or why there is none.

        Args:
            here: The position.
            waited_s: How long was waited for the request under way.
        """
        now_s = self._clock()
        usable = [
            kept
            for kept in self._kept.values()
            if 0.0 <= _age(now_s, kept.received_s) <= self._source.usable_s
            and self._source.serves(kept.value, kept.asked, here)
        ]
        if not usable:
            return Unknown(self._why(here, waited_s))
        best = max(usable, key=lambda kept: (self._source.near(kept.value, kept.asked, here), kept.as_of_s))
        age_s = _age(now_s, best.as_of_s)
        if age_s > self._source.oldest_s:
            return Unknown(f"what the service has is {age_words(age_s)} old")
        # Sure when new, half as sure when it is about to be dropped.
        confidence = 1.0 - 0.5 * min(1.0, age_s / self._source.usable_s)
        note = "" if self._answered(here) else self._why(here, waited_s)
        return ServiceReading(best.value, "", self._source.name, age_s, confidence, note)

    async def close(self) -> None:
        """End the request under way."""
        running, self._running = self._running, None
        if running is not None and not running.done() and running.get_loop() is asyncio.get_running_loop():
            running.cancel()
            await asyncio.gather(running, return_exceptions=True)

    def _answered(self, here: Position) -> bool:
        """Whether there is an answer for a position that is young enough."""
        now_s = self._clock()
        known = self._kept.get(self._source.cell(here))
        if known is not None and 0.0 <= _age(now_s, known.received_s) < self._source.fresh_s:
            return True
        return any(
            0.0 <= _age(now_s, kept.received_s) < self._source.fresh_s
            and self._source.near(kept.value, kept.asked, here)
            for kept in self._kept.values()
        )

    def _refusal(self, here: Position) -> str:
        """How the service refused this very place, if it did not long ago; empty where it did not."""
        refused = self._refused.get(self._source.cell(here))
        if refused is None or not 0.0 <= self._clock() - refused[1] < max(_REFUSED_S, self._source.fresh_s):
            return ""
        return refused[0]

    def _resting_s(self) -> float:
        """How long the service is still to be left alone."""
        if self._failure is None:
            return 0.0
        since_s = self._clock() - self._failed_s
        # A clock that was set back must not keep a service away for hours.
        return self._wait_s - since_s if 0.0 <= since_s < self._wait_s else 0.0

    async def _ask(self, here: Position) -> None:
        try:
            told = await self._source.ask(here)
        except ServiceError as failure:
            if failure.kind == "refused":
                self._keep(self._refused, here, (failure.message, self._clock()), _REFUSALS)
            else:
                self._failed(failure)
        except DataError as error:
            self._failed(ServiceError(error.message, "garbage"))
        except Exception as error:  # noqa: BLE001 - whatever a service makes our own code do, the drive goes on
            # The type only: texts of exceptions may quote what the service sent.
            self._failed(ServiceError(f"the answer cannot be read ({type(error).__name__})", "garbage"))
        else:
            self._failure, self._failures = None, 0
            now_s = self._clock()
            as_of_s = now_s if told.as_of_s is None else min(told.as_of_s, now_s)
            self._keep(self._kept, here, _Kept(told.value, here, now_s, as_of_s), self._source.keeps)

    def _keep(self, shelf: OrderedDict[Hashable, U], here: Position, thing: U, most: int) -> None:
        cell = self._source.cell(here)
        shelf[cell] = thing
        shelf.move_to_end(cell)
        while len(shelf) > most:
            shelf.popitem(last=False)

    def _failed(self, failure: ServiceError) -> None:
        doubled_s = _FIRST_WAIT_S[failure.kind] * 2.0 ** min(self._failures, 10)
        own_s = min(_LONGEST_WAIT_S, doubled_s) * float(self._rng.uniform(1.0, 1.25))
        self._failure, self._failures = failure, self._failures + 1
        self._failed_s = self._clock()
        self._wait_s = max(own_s, failure.retry_after_s or 0.0)
        _log.info("%s: %s; left alone for %.0f s", self._source.name, failure.message, self._wait_s)

    def _why(self, here: Position, waited_s: float) -> str:
        """Why there is no answer, or no newer one."""
        if self._running is not None and not self._running.done():
            return f"the service did not answer within {waited_s:g} s"
        if self._failure is None:
            return self._refusal(here) or self._source.missing
        resting_s = self._resting_s()
        again = f"; it is asked again in {math.ceil(resting_s)} s" if resting_s > 0.0 else ""
        return f"{self._failure.message}{again}"


def _age(now_s: float, then_s: float) -> float:
    """Age of something. Clocks jump by a second; what claims to be from later than that has no age: below zero."""
    age_s = now_s - then_s
    return age_s if age_s >= 0.0 or age_s < -1.0 else 0.0
