"""One request to one OpenAI-compatible chat endpoint: a complete reply, or a typed failure."""

from __future__ import annotations

import asyncio
import json
import logging
import os
import re
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, cast

from chauffeur import __version__
from chauffeur.concept.addresses import Address, read_key
from chauffeur.planners.cache import Completion
from chauffeur.planners.llm_address import PLACEHOLDER_KEY
from chauffeur.planners.llm_context import LEAST_ANSWER_TOKENS, shortage_in, too_small, was_cut
from chauffeur.planners.llm_errors import (
    KEY_VARIABLES,
    EndpointError,
    RefusedError,
    blind,
    failure_of,
    garbage,
    missing_key,
    not_an_api,
    timed_out,
    truncated,
)
from chauffeur.planners.prompts import Message, pictures_in

if TYPE_CHECKING:
    import httpx

_log = logging.getLogger(__name__)

_CONNECT_S = 10.0
_MODEL_CHARS = 200
_MAX_BODY_BYTES = 64_000_000
"""Longest reply read, in one piece or streamed."""
_MAX_REFUSAL_BYTES = 64_000
_DRAIN_S = 0.1
"""For the end of a stream behind its last event: a connection whose answer was read to its end serves again."""
_DISLIKES = frozenset({400, 422})
"""How servers answer a parameter that they do not take; 501 where it is streaming."""


@dataclass(frozen=True, slots=True)
class Sampling:
    """Everything besides the words that can change a reply.

    Attributes:
        temperature: 0 for the most repeatable answers; None leaves it to the server.
        seed: Seed for servers that take one.
        max_tokens: Most tokens the model may write, reasoning included.
    """

    temperature: float | None = 0.0
    seed: int | None = None
    max_tokens: int = 4096

    def parameters(self) -> dict[str, Any]:
        """As request parameters, absent ones left out."""
        given = {"temperature": self.temperature, "seed": self.seed, "max_tokens": self.max_tokens}
        return {name: value for name, value in given.items() if value is not None}


class Endpoint:
    """A model behind an address.

    Args:
        address: Where it is.
        model: Model to ask for.
        timeout_s: For one whole reply, from request to last word.
        max_chars: Longest reply read; the rest is not fetched.
        stream: Ask for the reply piece by piece. How the server answers decides how it is read: one that sends whole
            replies only, or streams only, is understood either way.
        environ: Where the key is read from.
    """

    def __init__(
        self,
        address: Address,
        model: str,
        *,
        timeout_s: float,
        max_chars: int,
        stream: bool = True,
        environ: Mapping[str, str] = os.environ,
    ) -> None:
        self._address = address
        self._model = model
        self._timeout_s = timeout_s
        self._max_chars = max_chars
        self._stream = stream
        self._environ = environ
        self._client: tuple[asyncio.AbstractEventLoop, httpx.AsyncClient] | None = None
        self._renamed: dict[str, str | None] = {}
        self._turned = False
        self._told: set[str] = set()

    async def complete(self, messages: list[Message], sampling: Sampling, on_text: Callable[[str], None]) -> Completion:
        """One reply.

        Args:
            messages: The conversation.
            sampling: How to sample.
            on_text: Gets each piece of the reply as it arrives.

        Raises:
            EndpointError: No usable reply. It carries neither the key nor the client's exception, whose request does.
        """
        client = self._connect()
        while True:
            body = self.body(messages, sampling)
            try:
                async with asyncio.timeout(self._timeout_s):
                    completion = await self._exchange(client, body, on_text)
                self._check_read(messages, completion)
            except _EmptyStreamError:
                if (
                    not self._turned
                ):  # llama-cpp-python ends a stream without a word where a whole reply says what is wrong
                    self._turned, self._stream = True, False
                    continue
                failure = garbage(self._address.url, "an empty stream")
            except EndpointError as error:
                failure = error
            except TimeoutError:
                failure = timed_out(self._address.url, self._timeout_s)
            except Exception as error:  # noqa: BLE001 - the client lets through whatever the stack below it raises
                # Before adapting: the words of a context that is too small name `max_tokens`, too.
                shortage = shortage_in(error)
                unseeing = self._blind(messages, error)
                if unseeing is not None:
                    failure = unseeing
                elif shortage is not None:
                    room = shortage.room()
                    if LEAST_ANSWER_TOKENS <= room < sampling.max_tokens:
                        sampling = replace(sampling, max_tokens=room)
                        self._tell_once(
                            f"the context of {self._address.url} leaves the answer {room:,} tokens, fewer than allowed"
                        )
                        continue
                    failure = too_small(self._address.url, shortage, messages, sampling.max_tokens)
                elif self._adapt(body, error):
                    continue
                else:
                    failure = failure_of(error, self._address.url, self._model, self._key_variable(), self._scrub)
            else:
                return completion
            # Raised here, outside the handlers: the client's exception holds the request with the key in its headers.
            raise failure

    def _blind(self, messages: list[Message], error: Exception) -> EndpointError | None:
        if not pictures_in(messages) or not isinstance(error, RefusedError):
            return None
        return blind(error, self._address.url, self._model, self._scrub)

    async def close(self) -> None:
        """Close the connections."""
        if self._client is not None and self._client[0] is asyncio.get_running_loop():
            await self._client[1].aclose()
        self._client = None

    def _connect(self) -> httpx.AsyncClient:
        loop = asyncio.get_running_loop()
        if self._client is not None and self._client[0] is loop:
            return self._client[1]
        found = self._found_key()
        if found is None and not self._address.local:
            raise missing_key(self._address.url)
        import httpx

        client = httpx.AsyncClient(
            headers={
                "Authorization": f"Bearer {found[0] if found else PLACEHOLDER_KEY}",
                "Content-Type": "application/json",
                "User-Agent": f"chauffeur/{__version__}",
            },
            timeout=httpx.Timeout(self._timeout_s, connect=min(_CONNECT_S, self._timeout_s)),
            limits=httpx.Limits(max_connections=1000, max_keepalive_connections=100),
            follow_redirects=True,  # httpx takes the key out where one leads to another host
        )
        # Connections belong to the event loop that opened them; a caller with a new loop gets new ones.
        self._client = (loop, client)
        return client

    def _found_key(self) -> tuple[str, str] | None:
        return read_key(self._address, KEY_VARIABLES, self._environ)

    def _key_variable(self) -> str | None:
        found = self._found_key()
        return found[1] if found else None

    def _scrub(self, text: str) -> str:
        found = self._found_key()
        return text.replace(found[0], "***") if found else text

    def body(self, messages: list[Message], sampling: Sampling) -> dict[str, Any]:
        """What is sent for a conversation, key and headers aside."""
        body: dict[str, Any] = {"model": self._model, "messages": messages, **sampling.parameters()}
        if self._stream:
            body |= {"stream": True, "stream_options": {"include_usage": True}}
        for name, other in self._renamed.items():
            if name in body:
                value = body.pop(name)
                if other is not None:
                    body[other] = value
        return body

    def _adapt(self, body: dict[str, Any], error: Exception) -> bool:
        """Whether the server only disliked an optional parameter, which is renamed or left out from now on.

        Reasoning models take `max_completion_tokens` and no temperature; older servers know no stream options; some
        stream only, some never do.
        """
        if not isinstance(error, RefusedError):
            return False
        status = error.status
        said = f"{error.param} {error.message}"
        for name, other in (
            ("max_tokens", "max_completion_tokens"),
            ("temperature", None),
            ("seed", None),
            ("stream_options", None),
        ):
            if status in _DISLIKES and name in said and name in body:
                self._renamed[name] = other
                instead = f"using {other}" if other else "left out"
                self._tell_once(f"{self._address.url} does not take {name!r}; {instead}")
                return True
        if (status in _DISLIKES or status == 501) and "stream" in said.lower() and not self._turned:
            self._turned = True
            self._stream = not self._stream
            self._tell_once(f"{self._address.url} {'streams only' if self._stream else 'does not stream'}")
            return True
        return False

    def _check_read(self, messages: list[Message], completion: Completion) -> None:
        """Say so where the server cannot have read the whole prompt."""
        if was_cut(messages, completion.prompt_tokens):
            self._tell_once(
                f"{self._address.url} counted {completion.prompt_tokens:,} tokens of a prompt that has more: its "
                "context may be too small, and the prompt cut without a word (Ollama: OLLAMA_CONTEXT_LENGTH=8192)"
            )

    def _tell_once(self, what: str) -> None:
        if what not in self._told:
            self._told.add(what)
            _log.warning("%s", what)

    async def _exchange(
        self, client: httpx.AsyncClient, body: dict[str, Any], on_text: Callable[[str], None]
    ) -> Completion:
        # Escaped to ASCII: a lone surrogate in somebody's words must not keep them from being sent.
        content = json.dumps(body).encode("ascii")
        async with client.stream("POST", f"{self._address.url}/chat/completions", content=content) as response:
            if not response.is_success:
                raise RefusedError.of(response.status_code, response.headers, await self._refusal(response))
            if response.headers.get("content-type", "").startswith("text/event-stream"):
                return await self._read_stream(response, on_text)
            return await self._read_whole(response, on_text)

    async def _refusal(self, response: httpx.Response) -> bytes:
        data = bytearray()
        async for piece in response.aiter_bytes():
            data += piece
            if len(data) > _MAX_REFUSAL_BYTES:
                break
        return bytes(data[:_MAX_REFUSAL_BYTES])

    async def _read_stream(self, response: httpx.Response, on_text: Callable[[str], None]) -> Completion:
        tally, events = _Tally(self._max_chars), _Events()
        room = _MAX_BODY_BYTES
        pieces = response.aiter_bytes()
        async for piece in pieces:
            room -= len(piece)
            if room < 0:
                raise self._too_long()
            if self._take(events.feed(piece), tally, on_text):
                await self._drain(pieces)
                break
            if tally.full:
                break
        if not tally.chunks:
            raise _EmptyStreamError
        if not tally.finish:
            raise truncated(self._address.url)
        return self._finished(tally)

    @staticmethod
    def _take(events: Iterator[bytes], tally: _Tally, on_text: Callable[[str], None]) -> bool:
        """Take what has arrived; whether it was the last of the stream."""
        for data in events:
            if data.startswith(b"[DONE]"):
                return True
            on_text(tally.add(json.loads(data)))
            if tally.full:
                break
        return False

    @staticmethod
    async def _drain(pieces: AsyncIterator[bytes]) -> None:
        import httpx

        with suppress(TimeoutError, httpx.HTTPError, httpx.StreamError):
            async with asyncio.timeout(_DRAIN_S):
                async for _ in pieces:
                    pass

    async def _read_whole(self, response: httpx.Response, on_text: Callable[[str], None]) -> Completion:
        data = bytearray()
        async for piece in response.aiter_bytes():
            data += piece
            if len(data) > _MAX_BODY_BYTES:
                raise self._too_long()
        content_type = response.headers.get("content-type", "")
        if "json" not in content_type and not data.lstrip().startswith(b"{"):
            raise not_an_api(self._address.url, content_type)
        answer = json.loads(data)
        if not isinstance(answer, dict):
            raise garbage(self._address.url, "no object")
        tally = _Tally(self._max_chars)
        on_text(tally.add(answer))
        if not tally.chunks:
            raise garbage(self._address.url, "no choices in it")
        return self._finished(tally)

    def _too_long(self) -> EndpointError:
        return garbage(self._address.url, f"more than {_MAX_BODY_BYTES // 1_000_000} MB")

    def _finished(self, tally: _Tally) -> Completion:
        # JSON can carry lone surrogates, which no file or terminal takes.
        text = "".join(tally.parts).encode("utf-8", "replace").decode("utf-8")
        return Completion(
            text=self._scrub(text),
            finish=tally.finish or "stop",
            prompt_tokens=tally.prompt_tokens,
            completion_tokens=tally.completion_tokens,
            model=self._scrub(tally.model)[:_MODEL_CHARS],
        )


class _EmptyStreamError(Exception):
    """A stream that ended before its first piece."""


class _Events:
    """Server-sent events out of the pieces in which they arrive (WHATWG HTML, 9.2.6); only their data is kept."""

    _LINE_END: Final = re.compile(rb"\r\n|\n|\r")

    def __init__(self) -> None:
        self._line = bytearray()
        self._data: list[bytes] = []
        self._after_return = False

    def feed(self, piece: bytes) -> Iterator[bytes]:
        """The data of the events that a piece completes."""
        if self._after_return:  # the second half of a line end that came in two pieces
            piece = piece.removeprefix(b"\n")
        self._after_return = piece.endswith(b"\r")
        first, *others = self._LINE_END.split(piece)
        self._line += first
        for other in others:
            yield from self._end_line()
            self._line += other

    def _end_line(self) -> Iterator[bytes]:
        line = bytes(self._line)
        self._line.clear()
        name, _, value = line.partition(b":")
        if name == b"data":
            self._data.append(value.removeprefix(b" "))
        elif not line and self._data:
            yield b"\n".join(self._data)
            self._data.clear()


class _Tally:
    """What has arrived of a reply. Trusts no field."""

    def __init__(self, max_chars: int) -> None:
        self.parts: list[str] = []
        self.chunks = 0
        self.finish = ""
        self.model = ""
        self.prompt_tokens = 0
        self.completion_tokens = 0
        self._room = max_chars

    @property
    def full(self) -> bool:
        return self._room <= 0

    def add(self, chunk: object) -> str:
        """Take a piece of a stream, or a whole completion; returns the text that is new and within the cap.

        Raises:
            RefusedError: It says what went wrong instead.
        """
        if error := _field(chunk, "error"):
            raise RefusedError(None, error)
        model = _field(chunk, "model")
        self.model = model if isinstance(model, str) else self.model
        usage = _field(chunk, "usage")
        # The last count stands: servers send it once, or a running total with every piece.
        self.prompt_tokens = _count(usage, "prompt_tokens") or self.prompt_tokens
        self.completion_tokens = _count(usage, "completion_tokens") or self.completion_tokens
        choices = _field(chunk, "choices")
        if not isinstance(choices, list):
            return ""
        self.chunks += 1
        if not choices:
            return ""
        choice = cast("list[object]", choices)[0]
        finish = _field(choice, "finish_reason")
        self.finish = finish if isinstance(finish, str) else self.finish
        text = _field(_field(choice, "delta") or _field(choice, "message"), "content")
        if not isinstance(text, str) or not text:
            return ""
        kept = text[: self._room]
        self._room -= len(kept)
        if self.full:
            self.finish = "capped"
        self.parts.append(kept)
        return kept


def _field(value: object, name: str) -> object:
    return cast("dict[str, object]", value).get(name) if isinstance(value, dict) else None


def _count(usage: object, name: str) -> int:
    value = _field(usage, name)
    return value if isinstance(value, int) and value >= 0 else 0
