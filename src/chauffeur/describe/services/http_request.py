"""One request to one service: the body of its answer, or a failure in our own words.

Keys travel in the query, as these services want it. They are put there below the HTTP client, so that neither its log
lines nor its exceptions ever hold one.
"""

from __future__ import annotations

import asyncio
import math
import ssl
from collections.abc import Mapping
from email.utils import parsedate_to_datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Final, Literal
from urllib.request import getproxies, proxy_bypass

from chauffeur.concept import ChauffeurError
from chauffeur.foreign.complaints import ForeignBodyError

if TYPE_CHECKING:
    import httpx

FailureKind = Literal["key", "busy", "server", "timeout", "unreachable", "broken", "garbage", "refused"]
"""What went wrong: the key was refused; too many requests; the server failed; no answer in time; nobody there; the
connection broke; the answer cannot be read; the request was refused for another reason."""

_MAX_RETRY_AFTER_S: Final = 3_600.0


class ServiceError(ChauffeurError):
    """A service gave no usable answer.

    Attributes:
        kind: What went wrong.
        retry_after_s: How long the server asked to be left alone; None when it did not.
    """

    def __init__(self, message: str, kind: FailureKind = "broken", *, retry_after_s: float | None = None) -> None:
        super().__init__(message, retryable=kind not in ("key", "refused"))
        self.kind: FailureKind = kind
        self.retry_after_s = retry_after_s


class ServiceCaller:
    """Requests to one service.

    Args:
        base_url: Where it is, checked.
        key: (name in the query, key) or None.
        key_variable: Where the key came from, for people.
        patience_s: After this long a request is given up.
        max_bytes: Longest answer that is read.
    """

    def __init__(
        self, base_url: str, *, key: tuple[str, str] | None, key_variable: str, patience_s: float, max_bytes: int
    ) -> None:
        self._base_url = base_url
        self._key = key
        self._key_variable = key_variable
        self._patience_s = patience_s
        self._max_bytes = max_bytes
        self._client: tuple[asyncio.AbstractEventLoop, httpx.AsyncClient] | None = None
        # Done here and not at the first request: the library and the certificates take a tenth of a second to load.
        self._tls = _tls()

    async def get(self, path: str, query: Mapping[str, str]) -> bytes:
        """The body of a GET. Raises ServiceError."""
        return await self._ask("GET", path, query, None)

    async def post(self, path: str, form: Mapping[str, str]) -> bytes:
        """The body of a POST. Raises ServiceError."""
        return await self._ask("POST", path, None, form)

    async def close(self) -> None:
        """Close the connections."""
        if self._client is not None and self._client[0] is asyncio.get_running_loop():
            await self._client[1].aclose()
        self._client = None

    async def _ask(
        self, method: str, path: str, query: Mapping[str, str] | None, form: Mapping[str, str] | None
    ) -> bytes:
        import httpx

        client = self._connect()
        try:
            async with (
                asyncio.timeout(self._patience_s),
                client.stream(method, f"{self._base_url}{path}", params=query, data=form) as response,
            ):
                if response.status_code != 200:
                    raise self._refused(response.status_code, response.headers)
                return await response.aread()
        except ServiceError:
            raise
        except ForeignBodyError as error:
            failure = ServiceError(error.message.rstrip("."), "garbage")
        except (TimeoutError, httpx.TimeoutException):
            message = f"the service did not answer within {self._patience_s:g} s"
            failure = ServiceError(message, "timeout")
        except httpx.ConnectError:
            failure = ServiceError("the service cannot be reached", "unreachable")
        except (httpx.HTTPError, httpx.StreamError, OSError, ValueError, ssl.SSLError):
            failure = ServiceError("the connection to the service broke", "broken")
        # Raised outside of the handlers: what the client raised is no part of it.
        raise failure

    def _refused(self, status: int, headers: httpx.Headers) -> ServiceError:
        wait_s = retry_after_s(headers)
        if status in (401, 403):
            what = f"key in {self._key_variable}" if self._key_variable else "request"
            return ServiceError(f"the service refused the {what} ({status})", "key", retry_after_s=wait_s)
        if status == 429:
            return ServiceError("the service takes no more requests for now (429)", "busy", retry_after_s=wait_s)
        if status >= 500:
            return ServiceError(f"the service failed ({status})", "server", retry_after_s=wait_s)
        return ServiceError(f"the service refused the request ({status})", "refused", retry_after_s=wait_s)

    def _connect(self) -> httpx.AsyncClient:
        import httpx

        from chauffeur.foreign.bodies import UNPACKED, bounding

        loop = asyncio.get_running_loop()
        if self._client is not None and self._client[0] is loop:
            return self._client[1]
        url = httpx.URL(self._base_url)
        direct = url.host in ("localhost", "127.0.0.1", "::1") or proxy_bypass(url.host)
        proxy = None if direct else getproxies().get(url.scheme)
        key = self._key

        class Keyed(httpx.AsyncHTTPTransport):
            """Adds the key on the way out, to a copy of the request that nobody else sees."""

            async def handle_async_request(self, request: httpx.Request) -> httpx.Response:
                if key is None:
                    return await super().handle_async_request(request)
                keyed = httpx.Request(
                    request.method,
                    request.url.copy_set_param(*key),
                    headers=request.headers,
                    stream=request.stream,
                    extensions=request.extensions,
                )
                return await super().handle_async_request(keyed)

        client = httpx.AsyncClient(
            transport=Keyed(verify=self._tls, proxy=proxy),
            headers={"User-Agent": _user_agent(), "Accept": "application/json", **UNPACKED},
            event_hooks={"response": [bounding(self._max_bytes)]},
            timeout=self._patience_s,
            follow_redirects=False,  # the key must not follow a redirect to somebody else
            trust_env=False,  # proxies are the transport's; netrc files are nobody's
        )
        # Connections belong to the event loop that opened them; a caller with a new loop gets new ones.
        self._client = (loop, client)
        return client


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
    return min(max(0.0, wait_s), _MAX_RETRY_AFTER_S) if math.isfinite(wait_s) else None


@cache
def _tls() -> ssl.SSLContext:
    import httpx

    return httpx.create_ssl_context()


@cache
def _user_agent() -> str:
    # Overpass and Nominatim ask for a name that says whose program it is.
    try:
        return f"chauffeur/{version('chauffeur')}"
    except PackageNotFoundError:
        return "chauffeur"
