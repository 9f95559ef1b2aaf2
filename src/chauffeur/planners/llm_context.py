"""A prompt that does not fit a model's context: read out of how servers say so, and said in words with a remedy.

llama.cpp, vLLM, SGLang, Ollama, LM Studio, text-generation-inference and OpenAI each word it differently; what they
share is a phrase for the context and up to two numbers. Every pattern is linear: servers' words are foreign text.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, cast

from chauffeur.planners.llm_errors import EndpointError, RefusedError

LEAST_ANSWER_TOKENS: Final = 512
"""Room that a program with its thoughts needs; with less, nothing is asked."""

_ABOUT_OTHERS: Final = frozenset({401, 403, 404, 429})
_READ_CHARS: Final = 2_000
_CHARS_PER_TOKEN: Final = 3.5
"""Of S under SmolLM2's tokenizer (3.45 few-shot, 3.55 zero-shot); for counts that no server gave."""
_CUT_CHARS_PER_TOKEN: Final = 6.0
"""More characters a token than this no tokenizer of today gets out of S: the rest of the prompt was not read."""

_CONTEXT = re.compile(
    r"context[ _](?:length|size|window)|exceed_context|maximum context|(?:maximum|max) model length"
    r"|prompt (?:is )?too long|n_ctx|greater than the context",
    re.IGNORECASE,
)
_SIZE = re.compile(
    r"(?:context[ _](?:length|size|window)|model length|n_ctx)(?: is| of| only|\W){0,6}(\d{3,8})"
    r"|tokens > (\d{3,8}) maximum",
    re.IGNORECASE,
)
_PROMPT = re.compile(
    r"(\d{1,8}) (?:in (?:the|your) (?:messages|prompt)|(?:input|prompt) tokens|tokens from the input|`inputs`)"
    r"|(?:messages resulted in|request \(|input \(|tokens \(|prompt \(length|too long:) ?(\d{1,8})"
    r"|n_prompt_tokens\W{1,4}(\d{1,8})",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True)
class Shortage:
    """Sizes that a server reported for a prompt that is too long.

    Attributes:
        size: Tokens of its context; None when it did not say.
        prompt: Tokens of the prompt as it counts them; None when it did not say.
    """

    size: int | None
    prompt: int | None

    def room(self) -> int:
        """Tokens that the prompt leaves for the answer; 0 where that is not known."""
        return 0 if self.size is None or self.prompt is None else max(0, self.size - self.prompt - 1)


def shortage_in(error: Exception) -> Shortage | None:
    """The shortage behind a failed request; None when it is about something else."""
    if not isinstance(error, RefusedError) or error.status in _ABOUT_OTHERS:
        return None
    said = f"{error.message} {error.error}"[:_READ_CHARS]
    if not _CONTEXT.search(said):
        return None
    return Shortage(_number(_SIZE.search(said)), _number(_PROMPT.search(said)))


def tokens_about(messages: Sequence[Mapping[str, Any]]) -> int:
    """Tokens of a conversation, estimated from its characters; within some 10 % for S."""
    return round(_characters(messages) / _CHARS_PER_TOKEN)


def was_cut(messages: Sequence[Mapping[str, Any]], counted: int) -> bool:
    """True if a server cannot have read all of a prompt of which it counted so many tokens. 0: it did not say."""
    return 0 < counted < _characters(messages) / _CUT_CHARS_PER_TOKEN


def too_small(url: str, shortage: Shortage, messages: Sequence[Mapping[str, Any]], answer_tokens: int) -> EndpointError:
    """The failure, with the numbers and what to do.

    Args:
        url: The endpoint, for people.
        shortage: What it said.
        messages: What did not fit; the first of them is S.
        answer_tokens: Most tokens the answer may have.
    """
    prompt = f"{shortage.prompt:,}" if shortage.prompt is not None else f"about {tokens_about(messages):,}"
    system = tokens_about(messages[:1])
    size = "is smaller" if shortage.size is None else f"is {shortage.size:,}"
    wanted = (shortage.prompt or tokens_about(messages)) + max(LEAST_ANSWER_TOKENS, min(answer_tokens, 1_024))
    enough = -(-wanted // 1_024) * 1_024
    return EndpointError(
        "context",
        f"The prompt does not fit the model's context at {url}: it needs {prompt} tokens, of which the system message "
        f"S is about {system:,}, and at least {LEAST_ANSWER_TOKENS} for the answer; the context {size}.",
        hint=(
            f"Start the server with a context of {enough:,} tokens or more (llama.cpp: -c {enough}; vLLM: "
            f"--max-model-len {enough}; Ollama: OLLAMA_CONTEXT_LENGTH={enough}), or use --setting zero-shot, whose S "
            "is the shortest."
        ),
    )


def _characters(messages: Sequence[Mapping[str, Any]]) -> int:
    return sum(_length(message.get("content", "")) for message in messages)


def _length(content: object) -> int:
    """Of the words of a turn: what servers count for a picture is their own affair."""
    if not isinstance(content, list):
        return len(str(content))
    return sum(len(str(part.get("text", ""))) for part in cast("list[dict[str, object]]", content))


def _number(found: re.Match[str] | None) -> int | None:
    return None if found is None else int(next(group for group in found.groups() if group))
