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

from chauffeur.concept.addresses import Address, read_key
from chauffeur.foreign.complaints import server_words
from chauffeur.planners.cache import Completion
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
from chauffeur.planners.prompts.turns import TextPart, words_of
from chauffeur.version import __version__

if TYPE_CHECKING:
    import httpx

_log = logging.getLogger(__name__)

_CONNECT_S = 10.0
_PLACEHOLDER_KEY = "none"
"""Sent to a local server when there is no key: some servers want a non-empty one."""
_SAID_CHARS = 2_000
_MODEL_CHARS = 200
_MAX_BODY_BYTES = 64_000_000
"""Longest reply read, in one piece or streamed."""
_DISLIKES = frozenset({400, 422})
"""Status codes with which servers answer a parameter that they do not take; 501 where it is streaming."""
_NO_SYSTEM: Final = re.compile(
    r"(?=.{0,200}\b(?:system|developer)\b)(?=.{0,200}\b(?:roles?|messages?|prompts?|instructions?)\b)"
    r".{0,200}\b(?:not|only|unsupported|unknown|unexpected|unrecogni[sz]ed|invalid|must)\b"
    r"|roles? must alternate|\brole\b.{0,120}\buser\b.{0,20}\bassistant\b|only user and assistant roles",
    re.IGNORECASE | re.DOTALL,
)
"""Error texts for templates that know no system turn: Gemma's and Mistral's, behind vLLM, llama.cpp and TGI."""
_NO_SYSTEM_STATUS: Final = frozenset({400, 404, 422, 500, 501})
_DRAIN_S = 0.1
"""For the end of a stream behind its last event: a connection whose answer was read to its end serves again."""
_FILTERED: Final = "The endpoint's content filter held the reply back (content_filter)."


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
        self._folded = False
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

        from chauffeur.foreign.bodies import UNPACKED, bounding

        client = httpx.AsyncClient(
            headers={
                "Authorization": f"Bearer {found[0] if found else _PLACEHOLDER_KEY}",
                "Content-Type": "application/json",
                "User-Agent": f"chauffeur/{__version__}",
                **UNPACKED,
            },
            timeout=httpx.Timeout(self._timeout_s, connect=min(_CONNECT_S, self._timeout_s)),
            limits=httpx.Limits(max_connections=1000, max_keepalive_connections=100),
            follow_redirects=True,  # httpx takes the key out where one leads to another host
            event_hooks={"response": [bounding(_MAX_BODY_BYTES)]},
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
        return re.sub(rf"(?<!\w){re.escape(found[0])}(?!\w)", "***", text) if found else text

    def body(self, messages: list[Message], sampling: Sampling) -> dict[str, Any]:
        """Request body of a conversation."""
        turns = _without_system(messages) if self._folded else messages
        body: dict[str, Any] = {"model": self._model, "messages": turns, **sampling.parameters()}
        if self._stream:
            body |= {"stream": True, "stream_options": {"include_usage": True}}
        for name, other in self._renamed.items():
            if name in body:
                value = body.pop(name)
                if other is not None:
                    body[other] = value
        return body

    def _adapt(self, body: dict[str, Any], error: Exception) -> bool:
        """True if the server only disliked an optional parameter, which is renamed or left out from now on.

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
        if status in _NO_SYSTEM_STATUS and not self._folded and _NO_SYSTEM.search(error.message[:_SAID_CHARS]):
            self._folded = True
            self._tell_once(f"{self._address.url} takes no system turn; its text goes in front of the first user turn")
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
        """Ask, and read what comes by what it is, whatever it is called: an object, or events."""
        # Escaped to ASCII: a lone surrogate in a passenger's words must not keep them from being sent.
        content = json.dumps(body).encode("ascii")
        tally = _Tally(self._max_chars)
        async with client.stream("POST", f"{self._address.url}/chat/completions", content=content) as response:
            if not response.is_success:
                raise RefusedError(response.status_code, _parsed(await response.aread()), response.headers)
            pieces, said = response.aiter_bytes(), response.headers.get("content-type", "")
            head = await _head(pieces)
            if head[:1] in (b"{", b"["):
                on_text(tally.add(json.loads(head + b"".join([piece async for piece in pieces]))))
            elif _EVENT.match(head) or (not head and self._stream) or said.lower().startswith("text/event-stream"):
                await self._read_stream(head, pieces, tally, on_text)
            elif head and "json" not in said.lower():
                raise not_an_api(self._address.url, said)
        if not tally.seen:
            raise (
                RefusedError(None, tally.complaint)
                if tally.complaint
                else garbage(self._address.url, "no choices in it")
            )
        # JSON can carry lone surrogates, which no file or terminal takes.
        text = "".join(tally.parts).encode("utf-8", "replace").decode("utf-8")
        return Completion(
            text=text,
            finish="refusal" if tally.declined else tally.finish or "stop",
            prompt_tokens=tally.prompt_tokens,
            completion_tokens=tally.completion_tokens,
            model=tally.model[:_MODEL_CHARS],
        )

    async def _read_stream(
        self, head: bytes, pieces: AsyncIterator[bytes], tally: _Tally, on_text: Callable[[str], None]
    ) -> None:
        events = _Events()
        done = self._take(events.feed(head), tally, on_text)
        while not done and not tally.full and (piece := await anext(pieces, None)) is not None:
            done = self._take(events.feed(piece), tally, on_text)
        if done:
            await self._drain(pieces)
        if not tally.seen:
            if not tally.complaint:
                raise _EmptyStreamError
        elif not tally.finish and done and tally.parts:
            self._tell_once(f"{self._address.url} says [DONE] without a finish_reason; its replies count as whole")
        elif not tally.finish:
            raise truncated(self._address.url)

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


class _EmptyStreamError(Exception):
    """A stream that ended before its first piece."""


_BOM: Final = b"\xef\xbb\xbf"
_EVENT: Final = re.compile(rb"(?:data|event|id|retry)?:")
"""Opening of a stream of events."""


async def _head(pieces: AsyncIterator[bytes]) -> bytes:
    """The beginning of a body, without blanks and a byte order mark; empty where there is nothing else."""
    head = b""
    async for piece in pieces:
        head = (head + piece).removeprefix(_BOM).lstrip()
        if head and not _BOM.startswith(head):
            break
    return head


def _parsed(content: bytes) -> object:
    """Body of an answer that is no success: JSON, or text."""
    try:
        return json.loads(content)
    except (ValueError, RecursionError):
        return content.decode("utf-8", "replace")


def _without_system(messages: list[Message]) -> list[Message]:
    """A conversation whose system turns stand in front of the first user turn."""
    system = "\n\n".join(words_of(message) for message in messages if message["role"] == "system")
    turns: list[Message] = []
    for message in messages:
        if message["role"] == "system":
            continue
        content = message["content"]
        if message["role"] == "user" and system:
            mine: TextPart = {"type": "text", "text": system}
            content = f"{system}\n\n{content}" if isinstance(content, str) else [mine, *content]
            system = ""
        turns.append({"role": message["role"], "content": content})
    return turns


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
        elif not line:
            if data := b"\n".join(self._data):  # an event without data is none
                yield data
            self._data.clear()


class _Tally:
    """The part of a reply that has arrived; trusts no field."""

    def __init__(self, max_chars: int) -> None:
        self.parts: list[str] = []
        self.seen = False
        """True if anything came that is of the protocol."""
        self.complaint: object = None
        """What came that is not of the protocol and has words."""
        self.declined = False
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
        if isinstance(chunk, list) and chunk:
            chunk = cast("list[object]", chunk)[0]
        choices, error = _field(chunk, "choices"), _field(chunk, "error")
        if error or _field(chunk, "object") == "error":
            raise RefusedError(None, chunk)
        model = _field(chunk, "model")
        self.model = model if isinstance(model, str) else self.model
        usage = _field(chunk, "usage")
        # The last count stands: servers send it once, or a running total with every piece.
        self.prompt_tokens = _count(usage, "prompt_tokens") or self.prompt_tokens
        self.completion_tokens = _count(usage, "completion_tokens") or self.completion_tokens
        if not isinstance(choices, list):
            self.complaint = chunk if isinstance(chunk, dict) and server_words(chunk) else self.complaint
            return ""
        self.seen = True
        return self._choice(cast("list[object]", choices)[0]) if choices else ""

    def _choice(self, choice: object) -> str:
        if error := _field(choice, "error"):
            raise RefusedError(None, error)
        message = _field(choice, "delta") or _field(choice, "message")
        refusal = _field(message, "refusal")
        if isinstance(refusal, str) and refusal and not self.declined:
            self.declined = True
            self.parts.clear()
        text = _words(refusal if self.declined else _field(message, "content"))
        kept = text[: self._room]
        self._room -= len(kept)
        if kept:
            self.parts.append(kept)
        finish = _field(choice, "finish_reason")
        self.finish = finish if isinstance(finish, str) else self.finish
        if self.finish == "content_filter":
            self.parts = [_FILTERED]
        elif self.full:
            self.finish = "capped"
        return kept


def _words(content: object) -> str:
    """The words of a content: text, or parts of which those that are text count, and none that are reasoning."""
    if isinstance(content, str):
        return content
    parts = cast("list[object]", content) if isinstance(content, list) else []
    return "".join(part if isinstance(part, str) else _text_of(part) for part in parts)


def _text_of(part: object) -> str:
    text = _field(part, "text") if _field(part, "type") in ("text", "output_text", None) else None
    return text if isinstance(text, str) else ""


def _field(value: object, name: str) -> object:
    return cast("dict[str, object]", value).get(name) if isinstance(value, dict) else None


def _count(usage: object, name: str) -> int:
    value = _field(usage, name)
    return value if isinstance(value, int) and value >= 0 else 0
