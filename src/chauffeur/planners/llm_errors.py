"""Failures of an endpoint by kind, each with its remedy."""

from __future__ import annotations

import math
import re
import socket
from collections.abc import Callable, Mapping
from email.utils import parsedate_to_datetime
from typing import Literal, cast

from chauffeur.concept import PlannerError
from chauffeur.foreign.complaints import ForeignBodyError, server_words
from chauffeur.planners.prompts.blocks import cap, clean

Kind = Literal[
    "no_key", "unauthorized", "forbidden", "not_found", "bad_request", "no_vision", "context", "rate_limit", "quota",
    "server", "timeout", "dns", "unreachable", "broken", "truncated", "garbage", "not_an_api",
]  # fmt: skip
"""Kinds of failure."""

_TELLS = re.compile(r"[\w\"'(]")
"""Opening of a server's own words; a page of a proxy in between is looked through, and shown to no one."""

KEY_VARIABLES = ("CHAUFFEUR_API_KEY", "OPENAI_API_KEY")
TIMEOUT_VARIABLE = "CHAUFFEUR_TIMEOUT_S"

_RETRYABLE_STATUS = frozenset({408, 409, 425, 429})
_MESSAGE_CHARS = 300
_BLIND_STATUS = frozenset({400, 404, 413, 415, 422, 500, 501})


class EndpointError(PlannerError):
    """A model endpoint did not give a usable reply.

    Attributes:
        kind: What went wrong, for programs; the message says it to people.
        retry_after_s: How long the server asked to wait; None when it did not.
    """

    def __init__(
        self, kind: Kind, message: str, *, hint: str = "", retryable: bool = False, retry_after_s: float | None = None
    ) -> None:
        super().__init__(message, hint=hint, retryable=retryable)
        self.kind: Kind = kind
        self.retry_after_s = retry_after_s

    def not_again(self, why: str) -> EndpointError:
        """The same failure, for which nothing more is asked, and why not."""
        return EndpointError(self.kind, f"{self.message} Not asked again: {why}.", hint=self.hint)

    def after(self, attempts: int, next_wait_s: float | None = None) -> EndpointError:
        """The same failure, with how often it was tried and, if that is why we stop, how long the wait would be."""
        tried = f"Tried {attempts} times." if attempts > 1 else ""
        waits = "" if next_wait_s is None else f"The next try would have to wait {next_wait_s:.0f} s."
        message = " ".join(part for part in (self.message, tried, waits) if part)
        return EndpointError(
            self.kind, message, hint=self.hint, retryable=self.retryable, retry_after_s=self.retry_after_s
        )


class RefusedError(Exception):
    """A server's own words instead of a completion: an answer that is no success, or an error inside a reply.

    Attributes:
        status: HTTP status, or the one that an error inside a reply names; None where it names none.
        error: What it says is wrong, as it came.
        headers: Of the answer.
        message, code, param: As the object has them; empty where it has none.
    """

    def __init__(self, status: int | None, error: object, headers: Mapping[str, str] | None = None) -> None:
        found = error
        while isinstance(found, list) and found:
            found = cast("list[object]", found)[0]
        fields = cast("Mapping[str, object]", found) if isinstance(found, Mapping) else {}
        inner = fields.get("error")
        fields = cast("Mapping[str, object]", inner) if isinstance(inner, Mapping) else fields
        code = fields.get("code")
        named = isinstance(code, int) and not isinstance(code, bool) and 400 <= code < 600
        self.status = cast("int", code) if status is None and named else status
        self.error = error
        self.headers: Mapping[str, str] = headers or {}
        words = server_words(error)
        self.message = words if _TELLS.match(words) else ""
        self.code, self.param = str(code or ""), str(fields.get("param") or "")
        super().__init__(self.message or "an error without words")


def missing_key(url: str) -> EndpointError:
    """No key in the environment for an endpoint that is not on this machine or network."""
    return EndpointError(
        "no_key",
        f"No API key for {url}.",
        hint=f"Set {KEY_VARIABLES[0]} or {KEY_VARIABLES[1]}, or give --base-url of a server of your own.",
    )


def timed_out(url: str, timeout_s: float) -> EndpointError:
    """The whole reply was not there in time."""
    return EndpointError(
        "timeout",
        f"{url} gave no complete reply within {timeout_s:g} s.",
        hint=(
            f"Give it longer, e.g. {TIMEOUT_VARIABLE}={4.0 * timeout_s:g}; ask a server of one slot one at a time; "
            "or use a smaller model or a faster machine."
        ),
        retryable=True,
    )


def truncated(url: str) -> EndpointError:
    """The stream ended before the model said it was done."""
    return EndpointError("truncated", f"The reply from {url} broke off before its end.", retryable=True)


def not_an_api(url: str, content_type: str) -> EndpointError:
    """Something answers there, but it does not speak the protocol."""
    return EndpointError(
        "not_an_api",
        f"{url} answered with {content_type or 'an unknown type'} instead of a chat completion.",
        hint="Check --base-url; it usually ends in /v1.",
    )


def garbage(url: str, detail: str) -> EndpointError:
    """A reply in the right envelope whose content is not what the protocol says."""
    return EndpointError("garbage", f"The reply from {url} cannot be read ({detail.rstrip('.')}).", retryable=True)


_ABOUT_PICTURES = re.compile(
    r"image|vision|multi-?modal|mmproj|pictur|content.{0,40}(?:must be|expected|should be|not) .{0,12}(?:str|text)",
    re.I,
)


def blind(error: RefusedError, url: str, model: str, scrub: Callable[[str], str]) -> EndpointError | None:
    """The failure where a server refuses a request for its pictures; None where it says something else.

    Servers answer 400, 404 (OpenRouter), 415 or 422; llama.cpp answers 500 and names mmproj.
    """
    if error.status not in _BLIND_STATUS or not _ABOUT_PICTURES.search(error.message):
        return None
    said = f": {cap(clean(scrub(error.message)), _MESSAGE_CHARS).rstrip('.')}"
    return EndpointError(
        "no_vision",
        f"{url} takes no pictures with model {model!r} ({error.status}){said}.",
        hint="Choose a model that reads images (a vision-language model), or plan without the camera.",
    )


def failure_of(
    error: Exception, url: str, model: str, key_variable: str | None, scrub: Callable[[str], str]
) -> EndpointError:
    """The typed failure behind a refusal, or an exception of the HTTP client or of what is below it.

    Args:
        error: What was raised.
        url: The endpoint, for people.
        model: Model asked for.
        key_variable: Environment variable the key came from; None when none was used.
        scrub: Takes the key out of text the server sent.
    """
    if isinstance(error, RefusedError):
        if error.status is not None:
            return _from_status(error.status, error, url, model, key_variable, scrub)
        said = cap(clean(scrub(str(error))), _MESSAGE_CHARS).rstrip(".")
        return EndpointError("server", f"{url} broke off its reply: {said}.", hint="Try later.", retryable=True)
    if isinstance(error, ForeignBodyError):
        return garbage(url, error.message)
    if isinstance(error, ValueError | TypeError | RecursionError):
        return garbage(url, type(error).__name__)
    return _from_transport(error, url, scrub)


def _from_status(
    status: int, error: RefusedError, url: str, model: str, key_variable: str | None, scrub: Callable[[str], str]
) -> EndpointError:
    said = f": {cap(clean(scrub(error.message)), _MESSAGE_CHARS).rstrip('.')}" if error.message else ""
    if status == 401:
        hint = (
            f"Check the key in {key_variable}."
            if key_variable
            else f"This endpoint wants a key: set {KEY_VARIABLES[0]} or {KEY_VARIABLES[1]}."
        )
        return EndpointError("unauthorized", f"{url} refused the API key (401).", hint=hint)
    if status == 403:
        return EndpointError(
            "forbidden", f"{url} does not allow this request (403){said}.", hint="The key may lack access to the model."
        )
    if status == 404:
        return EndpointError(
            "not_found",
            f"{url} has no model {model!r}, or is not the right address (404){said}.",
            hint=f"See what it serves: curl {url}/models",
        )
    if status == 429 and error.code == "insufficient_quota":
        return EndpointError("quota", f"The account at {url} has no quota left (429){said}.", hint="Check its billing.")
    if status == 429:
        return EndpointError(
            "rate_limit",
            f"{url} limits the rate of requests (429){said}.",
            hint="Try later, or with fewer requests at a time.",
            retryable=True,
            retry_after_s=retry_after_s(error.headers),
        )
    retryable = status in _RETRYABLE_STATUS or (status >= 500 and status != 501)
    if retryable:
        return EndpointError(
            "server",
            f"{url} failed ({status}){said}.",
            hint="Try later.",
            retryable=True,
            retry_after_s=retry_after_s(error.headers),
        )
    return EndpointError("bad_request", f"{url} does not accept the request ({status}){said}.")


def _from_transport(error: Exception, url: str, scrub: Callable[[str], str]) -> EndpointError:
    chain = _chain(error)
    if any(type(cause).__name__ in ("ConnectTimeout", "PoolTimeout") for cause in chain):
        return EndpointError("unreachable", f"{url} takes no connection.", hint="Try later.", retryable=True)
    if any(isinstance(cause, TimeoutError) or "Timeout" in type(cause).__name__ for cause in chain):
        return EndpointError("timeout", f"{url} did not answer in time.", hint="Try later.", retryable=True)
    if any(isinstance(cause, socket.gaierror) for cause in chain):
        return EndpointError(
            "dns",
            f"The name of {url} cannot be resolved.",
            hint="Check --base-url and the network connection.",
            retryable=True,
        )
    if any(isinstance(cause, ConnectionRefusedError) or type(cause).__name__ == "ConnectError" for cause in chain):
        return EndpointError(
            "unreachable",
            f"Nothing answers at {url}.",
            hint="Start the server, or check --base-url and the network connection.",
            retryable=True,
        )
    detail = cap(clean(scrub(str(error))), _MESSAGE_CHARS)
    return EndpointError("broken", f"The connection to {url} failed: {detail}.", hint="Try again.", retryable=True)


def _chain(error: BaseException) -> list[BaseException]:
    chain: list[BaseException] = []
    current: BaseException | None = error
    while current is not None and len(chain) < 12:
        chain.append(current)
        current = current.__cause__ or current.__context__
    return chain


def retry_after_s(headers: Mapping[str, str]) -> float | None:
    """Seconds a server asks to wait, from `retry-after-ms` or `Retry-After` (seconds, or a date against its own Date).

    The server's `Date` is the clock of a dated answer, so a wrong clock on this side does no harm.
    """
    for name, scale in (("retry-after-ms", 1e-3), ("retry-after", 1.0)):
        value = headers.get(name, "")
        try:
            seconds = float(value) * scale
        except ValueError:
            continue
        if math.isfinite(seconds) and seconds >= 0.0:
            return seconds
    try:
        until = parsedate_to_datetime(headers.get("retry-after", ""))
        now = parsedate_to_datetime(headers.get("date", ""))
        return max(0.0, (until - now).total_seconds())
    except (ValueError, TypeError):
        return None
