"""A service on the network, asked over HTTP behind a cache: bounded in time and size, never waited for beyond a budget.

It is asked at most once at a time; what comes after the budget is there for the next description. The last good answers
are kept with their age. A service that fails is left alone for a while, longer each time. Keys travel in the query, as
these services want it, and are put there below the HTTP client, so that neither its log lines nor its exceptions ever
hold one.
"""

from __future__ import annotations

import asyncio
import logging
import math
import ssl
from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from email.utils import parsedate_to_datetime
from functools import cache
from typing import TYPE_CHECKING, Final, Generic, Literal, TypeVar
from urllib.request import getproxies, proxy_bypass

from chauffeur.concept import ChauffeurError, DataError
from chauffeur.describe.services.readings import Position, ServiceReading, Unknown
from chauffeur.describe.services.units import age_words
from chauffeur.foreign.complaints import ForeignBodyError
from chauffeur.version import __version__

if TYPE_CHECKING:
    import httpx
    import numpy as np

_log = logging.getLogger(__name__)

T = TypeVar("T")
U = TypeVar("U")

Failure = Literal["key", "busy", "server", "timeout", "unreachable", "broken", "garbage", "refused"]
"""What went wrong: key refused; too many requests; server failed; no answer in time; nobody there; connection broke;
answer unreadable; request refused for another reason."""

_FIRST_WAIT_S: Final[Mapping[Failure, float]] = {
    "key": 600.0, "busy": 30.0, "server": 5.0, "timeout": 2.0, "unreachable": 2.0, "broken": 2.0, "garbage": 5.0,
}  # fmt: skip
"""Rest after a first failure; doubles with each that follows. A refused request rests only its own place."""
_LONGEST_WAIT_S: Final = 900.0
_LONGEST_ASKED_WAIT_S: Final = 3_600.0
"""Longest rest that a server may ask for."""
_REFUSED_S: Final = 60.0
"""A refused place is not asked for again for so long; TomTom refuses places without a road."""
_REFUSALS: Final = 128
"""Refused places that are remembered."""


class ServiceError(ChauffeurError):
    """A service gave no usable answer; `retry_after_s` is the rest it asked for, if it did."""

    def __init__(self, message: str, kind: Failure, retry_after_s: float | None = None) -> None:
        super().__init__(message, retryable=kind not in ("key", "refused"))
        self.kind: Failure = kind
        self.retry_after_s = retry_after_s


@dataclass(frozen=True, slots=True)
class Told(Generic[T]):
    """An answer, read, and the Unix time for which it holds by the service's own word; None where it does not say."""

    value: T
    as_of_s: float | None = None


@dataclass(frozen=True, slots=True)
class Service(Generic[T]):
    """One kind of service.

    Attributes:
        name: What people are told.
        path: Path of its requests.
        query: Query of a request for a position; the form of a POST where `posts`.
        read: Reads the answer for a position. Raises DataError for one that cannot be read.
        cell: Positions of one cell get one answer.
        near: Whether an answer (value, position asked for) also holds here, so that no new one is needed.
        serves: Whether it is better than none here.
        max_bytes: Longest answer that is read.
        fresh_s: An answer is not asked for again before this age.
        usable_s: An answer is not told beyond this age since it came.
        oldest_s: Nor beyond this age by the service's own word.
        keeps: Answers kept.
        missing: Why there is nothing, where nothing failed.
        key: (name in the query, environment variable) of its key.
        posts: Whether it is asked by POST.
    """

    name: str
    path: str
    query: Callable[[Position], dict[str, str]]
    read: Callable[[bytes, Position], Told[T]]
    cell: Callable[[Position], Hashable]
    near: Callable[[T, Position, Position], bool]
    serves: Callable[[T, Position, Position], bool]
    max_bytes: int
    fresh_s: float
    usable_s: float
    oldest_s: float
    keeps: int
    missing: str = "the service has nothing for this place"
    key: tuple[str, str] | None = None
    posts: bool = False


@dataclass(frozen=True, slots=True)
class _Kept(Generic[T]):
    value: T
    asked: Position
    received_s: float
    as_of_s: float


class HttpSource(Generic[T]):
    """A service at an address, its answers so far, and its failures.

    Args:
        service: The kind of service.
        base_url: Where it is, checked.
        key: Its key, if it has one.
        patience_s: After this long a request is given up.
        clock: Unix time in seconds.
        rng: Spreads the waits after failures, so that a fleet does not come back in the same instant.
        transport: Answers in the place of the network: recorded replies.
    """

    def __init__(
        self,
        service: Service[T],
        base_url: str,
        key: str | None,
        *,
        patience_s: float,
        clock: Callable[[], float],
        rng: np.random.Generator,
        transport: httpx.AsyncBaseTransport | None = None,
    ) -> None:
        self._service, self._url, self._key, self._patience_s = service, base_url, key, patience_s
        self._clock, self._rng, self._transport = clock, rng, transport
        self._client: tuple[asyncio.AbstractEventLoop, httpx.AsyncClient] | None = None
        self._kept: OrderedDict[Hashable, _Kept[T]] = OrderedDict()
        self._refused: OrderedDict[Hashable, tuple[str, float]] = OrderedDict()
        self._running: asyncio.Task[None] | None = None
        self._failure: ServiceError | None = None
        self._failures = 0
        self._failed_s = self._wait_s = 0.0
        if transport is None:
            _tls()  # here and not at the first request: certificates take a tenth of a second to load

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
        """The best answer for a position, with its age; or why there is none after having waited for so long."""
        now_s, service = self._clock(), self._service
        usable = [
            kept
            for kept in self._kept.values()
            if 0.0 <= _age(now_s, kept.received_s) <= service.usable_s and service.serves(kept.value, kept.asked, here)
        ]
        if not usable:
            return Unknown(self._why(here, waited_s))
        best = max(usable, key=lambda kept: (service.near(kept.value, kept.asked, here), kept.as_of_s))
        age_s = _age(now_s, best.as_of_s)
        if age_s > service.oldest_s:
            return Unknown(f"what the service has is {age_words(age_s)} old")
        # Sure when new, half as sure when it is about to be dropped.
        confidence = 1.0 - 0.5 * min(1.0, age_s / service.usable_s)
        note = "" if self._answered(here) else self._why(here, waited_s)
        return ServiceReading(best.value, "", service.name, age_s, confidence, note)

    async def close(self) -> None:
        """End the request under way, and close the connections."""
        running, self._running = self._running, None
        loop = asyncio.get_running_loop()
        if running is not None and not running.done() and running.get_loop() is loop:
            running.cancel()
            await asyncio.gather(running, return_exceptions=True)
        if self._client is not None and self._client[0] is loop:
            await self._client[1].aclose()
        self._client = None

    def _answered(self, here: Position) -> bool:
        """Whether there is an answer for a position that is young enough."""
        now_s, service = self._clock(), self._service
        young = (
            (cell, kept) for cell, kept in self._kept.items() if 0.0 <= _age(now_s, kept.received_s) < service.fresh_s
        )
        return any(cell == service.cell(here) or service.near(kept.value, kept.asked, here) for cell, kept in young)

    def _refusal(self, here: Position) -> str:
        """How the service refused this very place, if it did not long ago; empty where it did not."""
        said, at_s = self._refused.get(self._service.cell(here), ("", -math.inf))
        return said if 0.0 <= self._clock() - at_s < max(_REFUSED_S, self._service.fresh_s) else ""

    def _resting_s(self) -> float:
        """How long the service is still to be left alone."""
        since_s = self._clock() - self._failed_s
        # A clock that was set back must not keep a service away for hours.
        return self._wait_s - since_s if self._failure is not None and 0.0 <= since_s < self._wait_s else 0.0

    async def _ask(self, here: Position) -> None:
        try:
            body = await self._fetch(self._service.query(here))
            # Beside the event loop: a town's roads take some milliseconds to sort.
            told = await asyncio.to_thread(self._service.read, body, here)
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
            self._keep(self._kept, here, _Kept(told.value, here, now_s, as_of_s), self._service.keeps)

    async def _fetch(self, query: dict[str, str]) -> bytes:
        import httpx

        try:
            async with (
                asyncio.timeout(self._patience_s),
                self._connect().stream(
                    "POST" if self._service.posts else "GET",
                    f"{self._url}{self._service.path}",
                    params=None if self._service.posts else query,
                    data=query if self._service.posts else None,
                ) as response,
            ):
                if response.status_code == 200:
                    return await response.aread()
                failure = self._refusing(response.status_code, response.headers)
        except ForeignBodyError as error:
            failure = ServiceError(error.message.rstrip("."), "garbage")
        except (TimeoutError, httpx.TimeoutException):
            failure = ServiceError(f"the service did not answer within {self._patience_s:g} s", "timeout")
        except httpx.ConnectError:
            failure = ServiceError("the service cannot be reached", "unreachable")
        except (httpx.HTTPError, httpx.StreamError, OSError, ValueError, ssl.SSLError):
            failure = ServiceError("the connection to the service broke", "broken")
        # Raised outside of the handlers: what the client raised is no part of it.
        raise failure

    def _refusing(self, status: int, headers: Mapping[str, str]) -> ServiceError:
        wait_s = retry_after_s(headers)
        if status in (401, 403):
            what = f"key in {self._service.key[1]}" if self._service.key else "request"
            return ServiceError(f"the service refused the {what} ({status})", "key", wait_s)
        if status == 429:
            return ServiceError("the service takes no more requests for now (429)", "busy", wait_s)
        if status >= 500:
            return ServiceError(f"the service failed ({status})", "server", wait_s)
        return ServiceError(f"the service refused the request ({status})", "refused", wait_s)

    def _connect(self) -> httpx.AsyncClient:
        import httpx

        from chauffeur.foreign.bodies import UNPACKED, bounding

        loop = asyncio.get_running_loop()
        if self._client is not None and self._client[0] is loop:
            return self._client[1]
        url = httpx.URL(self._url)
        direct = url.host in ("localhost", "127.0.0.1", "::1") or proxy_bypass(url.host)
        proxy = None if direct else getproxies().get(url.scheme)
        inner = self._transport or httpx.AsyncHTTPTransport(verify=_tls(), proxy=proxy)
        added = (self._service.key[0], self._key) if self._service.key and self._key else None

        class Keyed(httpx.AsyncBaseTransport):
            """Adds the key on the way out, to a copy of the request that nobody else sees."""

            async def handle_async_request(self, request: httpx.Request) -> httpx.Response:
                if added is not None:
                    request = httpx.Request(
                        request.method,
                        request.url.copy_set_param(*added),
                        headers=request.headers,
                        stream=request.stream,
                        extensions=request.extensions,
                    )
                return await inner.handle_async_request(request)

            async def aclose(self) -> None:
                await inner.aclose()

        client = httpx.AsyncClient(
            transport=Keyed(),
            # Overpass asks for a name that says whose program it is.
            headers={"User-Agent": f"chauffeur/{__version__}", "Accept": "application/json", **UNPACKED},
            event_hooks={"response": [bounding(self._service.max_bytes)]},
            timeout=self._patience_s,
            follow_redirects=False,  # the key must not follow a redirect to somebody else
            trust_env=False,  # proxies are the transport's; netrc files are nobody's
        )
        # Connections belong to the event loop that opened them; a caller with a new loop gets new ones.
        self._client = (loop, client)
        return client

    def _keep(self, shelf: OrderedDict[Hashable, U], here: Position, thing: U, most: int) -> None:
        cell = self._service.cell(here)
        shelf[cell] = thing
        shelf.move_to_end(cell)
        while len(shelf) > most:
            shelf.popitem(last=False)

    def _failed(self, failure: ServiceError) -> None:
        doubled_s = _FIRST_WAIT_S[failure.kind] * 2.0 ** min(self._failures, 10)
        own_s = min(_LONGEST_WAIT_S, doubled_s) * float(self._rng.uniform(1.0, 1.25))
        self._failure, self._failures, self._failed_s = failure, self._failures + 1, self._clock()
        self._wait_s = max(own_s, failure.retry_after_s or 0.0)
        _log.info("%s: %s; left alone for %.0f s", self._service.name, failure.message, self._wait_s)

    def _why(self, here: Position, waited_s: float) -> str:
        """Why there is no answer, or no newer one."""
        if self._running is not None and not self._running.done():
            return f"the service did not answer within {waited_s:g} s"
        if self._failure is None:
            return self._refusal(here) or self._service.missing
        resting_s = self._resting_s()
        return self._failure.message + (f"; it is asked again in {math.ceil(resting_s)} s" if resting_s > 0.0 else "")


def retry_after_s(headers: Mapping[str, str]) -> float | None:
    """Seconds a server asks to wait, an hour at most: a number, or a date against its own `Date`; None if not."""
    said = headers.get("retry-after", "")
    try:
        wait_s = float(said)
    except ValueError:
        try:
            now = parsedate_to_datetime(headers.get("date", ""))
            wait_s = (parsedate_to_datetime(said) - now).total_seconds()
        except (ValueError, TypeError):
            return None
    return min(max(0.0, wait_s), _LONGEST_ASKED_WAIT_S) if math.isfinite(wait_s) else None


def _age(now_s: float, then_s: float) -> float:
    """Age of something. Clocks jump by a second; what claims to be from later than that has no age: below zero."""
    age_s = now_s - then_s
    return age_s if age_s >= 0.0 or age_s < -1.0 else 0.0


@cache
def _tls() -> ssl.SSLContext:
    import httpx

    return httpx.create_ssl_context()
