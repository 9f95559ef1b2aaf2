"""One request to one OpenAI-compatible endpoint through the official SDK: a complete reply, or a typed failure."""

from __future__ import annotations

import asyncio
import json
import logging
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

from chauffeur.concept.addresses import Address, read_key
from chauffeur.planners.cache import Completion
from chauffeur.planners.llm_address import PLACEHOLDER_KEY
from chauffeur.planners.llm_context import LEAST_ANSWER_TOKENS, shortage_in, too_small, was_cut
from chauffeur.planners.llm_errors import (
    KEY_VARIABLES,
    EndpointError,
    from_sdk,
    garbage,
    missing_key,
    not_an_api,
    timed_out,
    truncated,
)

if TYPE_CHECKING:
    from openai import AsyncOpenAI

    from chauffeur.planners.prompts import Message

_log = logging.getLogger(__name__)

_CONNECT_S = 10.0
_MODEL_CHARS = 200
_MAX_BODY_BYTES = 64_000_000
"""Longest reply read in one piece."""
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
        self._client: tuple[asyncio.AbstractEventLoop, AsyncOpenAI] | None = None
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
            EndpointError: No usable reply. It carries neither the key nor the SDK's exception, whose request does.
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
            except Exception as error:  # noqa: BLE001 - the SDK lets through whatever the stack below it raises
                # Before adapting: the words of a context that is too small name `max_tokens`, too.
                shortage = shortage_in(error)
                if shortage is not None:
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
                    failure = from_sdk(error, self._address.url, self._model, self._key_variable(), self._scrub)
            else:
                return completion
            # Raised here, outside the handlers: the SDK's exception holds the request with the key in its headers.
            raise failure

    async def close(self) -> None:
        """Close the connections."""
        if self._client is not None and self._client[0] is asyncio.get_running_loop():
            await self._client[1].close()
        self._client = None

    def _connect(self) -> AsyncOpenAI:
        loop = asyncio.get_running_loop()
        if self._client is not None and self._client[0] is loop:
            return self._client[1]
        found = self._found_key()
        if found is None and not self._address.local:
            raise missing_key(self._address.url)
        import openai

        client = openai.AsyncOpenAI(
            api_key=found[0] if found else PLACEHOLDER_KEY,
            base_url=self._address.url,
            timeout=openai.Timeout(self._timeout_s, connect=min(_CONNECT_S, self._timeout_s)),
            max_retries=0,
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
        status = getattr(error, "status_code", None)
        said = f"{getattr(error, 'param', '')} {getattr(error, 'message', '')}"
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

    async def _exchange(self, client: AsyncOpenAI, body: dict[str, Any], on_text: Callable[[str], None]) -> Completion:
        from openai import AsyncStream
        from openai.types.chat import ChatCompletionChunk

        # The parameters are adapted at run time, so the SDK's overloads cannot be told apart here.
        create: Any = client.chat.completions.with_streaming_response.create
        async with create(**body) as response:
            content_type = str(response.headers.get("content-type", ""))
            if content_type.startswith("text/event-stream"):
                stream = AsyncStream(cast_to=ChatCompletionChunk, response=response.http_response, client=client)
                return await self._read_stream(stream, on_text)
            return await self._read_whole(response, content_type, on_text)

    async def _read_stream(self, stream: Any, on_text: Callable[[str], None]) -> Completion:
        tally = _Tally(self._max_chars)
        async with stream:
            async for chunk in stream:
                on_text(tally.add(chunk))
                if tally.full:
                    break
        if not tally.chunks:
            raise _EmptyStreamError
        if not tally.finish:
            raise truncated(self._address.url)
        return self._finished(tally)

    async def _read_whole(self, response: Any, content_type: str, on_text: Callable[[str], None]) -> Completion:
        from openai.types.chat import ChatCompletion

        data = bytearray()
        async for piece in response.iter_bytes():
            data += piece
            if len(data) > _MAX_BODY_BYTES:
                raise garbage(self._address.url, f"more than {_MAX_BODY_BYTES // 1_000_000} MB")
        if "json" not in content_type and not data.lstrip().startswith(b"{"):
            raise not_an_api(self._address.url, content_type)
        answer = json.loads(data)
        if not isinstance(answer, dict):
            raise garbage(self._address.url, "no object")
        tally = _Tally(self._max_chars)
        on_text(tally.add(ChatCompletion.construct(**cast("dict[str, Any]", answer))))
        if not tally.chunks:
            raise garbage(self._address.url, "no choices in it")
        return self._finished(tally)

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


class _Tally:
    """What has arrived of a reply. Trusts no field: the SDK builds its objects without validation."""

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
        """Take a piece of a stream, or a whole completion; returns the text that is new and within the cap."""
        model = getattr(chunk, "model", None)
        self.model = model if isinstance(model, str) else self.model
        usage = getattr(chunk, "usage", None)
        # The last count stands: servers send it once, or a running total with every piece.
        self.prompt_tokens = _count(usage, "prompt_tokens") or self.prompt_tokens
        self.completion_tokens = _count(usage, "completion_tokens") or self.completion_tokens
        choices: Any = getattr(chunk, "choices", None)
        if not isinstance(choices, list):
            return ""
        self.chunks += 1
        if not choices:
            return ""
        choice: Any = choices[0]
        finish = getattr(choice, "finish_reason", None)
        self.finish = finish if isinstance(finish, str) else self.finish
        said = getattr(choice, "delta", None) or getattr(choice, "message", None)
        text = getattr(said, "content", None)
        if not isinstance(text, str) or not text:
            return ""
        kept = text[: self._room]
        self._room -= len(kept)
        if self.full:
            self.finish = "capped"
        self.parts.append(kept)
        return kept


def _count(usage: object, name: str) -> int:
    value = getattr(usage, name, None)
    return value if isinstance(value, int) and value >= 0 else 0
