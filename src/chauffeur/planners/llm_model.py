"""A model behind any OpenAI-compatible endpoint: a conversation goes in, words come out.

Time, retries, kept replies and prices are looked after here, pictures in messages included; what the words mean is
for whoever asked (`llm.py` reads programs in them, `motion.py` gains).
"""

from __future__ import annotations

import asyncio
import logging
import os
import re
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self, TypeVar

from chauffeur.concept import Usage
from chauffeur.concept.addresses import Address
from chauffeur.foreign.model_text import MAX_REPLY_CHARS, read_model_text
from chauffeur.planners.base import OnText, Prompt, Prose
from chauffeur.planners.cache import Completion, ReplyCache, default_cache_dir, endpoint_key
from chauffeur.planners.llm_endpoint import Endpoint, Sampling
from chauffeur.planners.llm_errors import EndpointError, timed_out
from chauffeur.planners.llm_retry import RetryPolicy, with_retries
from chauffeur.planners.llm_settings import LlmSettings, parse_address
from chauffeur.planners.prompts import Message
from chauffeur.planners.transcript import keep_exchange

if TYPE_CHECKING:
    import numpy as np

_log = logging.getLogger(__name__)

_HOST = "api.openai.com"

# USD per million tokens (prompt, completion): OpenAI's published list of 2026-03, standard tier, without discounts for
# cached prompts or batches.
_PRICES: dict[str, tuple[float, float]] = {
    "gpt-3.5-turbo": (0.50, 1.50),
    "gpt-4": (30.00, 60.00),
    "gpt-4-turbo": (10.00, 30.00),
    "gpt-4o": (2.50, 10.00),
    "gpt-4o-mini": (0.15, 0.60),
    "gpt-4.1": (2.00, 8.00),
    "gpt-4.1-mini": (0.40, 1.60),
    "gpt-4.1-nano": (0.10, 0.40),
    "gpt-5": (1.25, 10.00),
    "gpt-5-mini": (0.25, 2.00),
    "gpt-5-nano": (0.05, 0.40),
    "gpt-5.1": (1.25, 10.00),
    "gpt-5.2": (1.75, 14.00),
    "gpt-5.4": (2.50, 15.00),
    "o3": (2.00, 8.00),
    "o3-mini": (1.10, 4.40),
    "o4-mini": (1.10, 4.40),
}

_DATED = re.compile(r"-\d{4}-\d{2}-\d{2}$")


def cost_usd(host: str, model: str, prompt_tokens: int, completion_tokens: int) -> float | None:
    """Price of a reply in USD, or None where no price is known.

    Args:
        host: Host of the endpoint.
        model: Model id; a dated snapshot has the price of its model.
        prompt_tokens: Tokens in.
        completion_tokens: Tokens out, reasoning tokens included.
    """
    price = _PRICES.get(_DATED.sub("", model)) if host == _HOST else None
    if price is None:
        return None
    return (prompt_tokens * price[0] + completion_tokens * price[1]) / 1e6


_WHOLE: Final = frozenset(
    {"stop", "eos", "eos_token", "end_turn", "stop_sequence", "complete", "tool_calls", "function_call"}
)
_DECLINED: Final = frozenset({"refusal", "content_filter"})


def was_cut(completion: Completion) -> bool:
    """True if a reply ended otherwise than by its model's own will; a word that is not known counts as such."""
    return completion.finish.lower() not in _WHOLE


def declines(completion: Completion) -> bool:
    """True if the endpoint marks a reply as a refusal, or its filter held it back."""
    return completion.finish in _DECLINED


T = TypeVar("T")


@dataclass(slots=True)
class ChatBill:
    """Cost of one plan, or one answer, so far."""

    prompt_tokens: int = 0
    completion_tokens: int = 0
    requests: int = 0
    answers: int = 0
    cached_answers: int = 0
    priced_prompt: int = 0
    priced_completion: int = 0


class ChatModel:
    """Asks one model at one endpoint.

    Args:
        model: Model id as the endpoint knows it.
        address: Where the endpoint is.
        rng: Jitter of the waits between retries.
        sampling: How to sample.
        timeout_s: For one whole reply.
        retry: How often and how patiently to try again.
        budget_s: For a whole plan, or answer, with all of its retries, waits and repairs.
        cache: Where to keep replies; None keeps nothing.
        on_text: Gets the reply as it is written.
        stream: Ask for the reply piece by piece.
        environ: Where the API key is read from.
        sleep: Waits the given seconds.
        clock: Seconds of a clock that never goes back.
    """

    def __init__(
        self,
        model: str,
        address: Address,
        *,
        rng: np.random.Generator,
        sampling: Sampling | None = None,
        timeout_s: float = 60.0,
        retry: RetryPolicy | None = None,
        budget_s: float = 180.0,
        cache: ReplyCache | None = None,
        on_text: OnText | None = None,
        stream: bool = True,
        environ: Mapping[str, str] = os.environ,
        sleep: Callable[[float], Awaitable[None]] = asyncio.sleep,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.model = model
        self.clock = clock
        self._address = address
        self._rng = rng
        self._sampling = sampling or Sampling()
        self._retry = retry or RetryPolicy()
        self._budget_s = budget_s
        self._cache = cache
        self._on_text = on_text
        self._sleep = sleep
        self._endpoint = Endpoint(
            address, model, timeout_s=timeout_s, max_chars=MAX_REPLY_CHARS, stream=stream, environ=environ
        )

    @classmethod
    def of(
        cls,
        model: str,
        how: LlmSettings,
        *,
        base_url: str | None = None,
        seed: int | None = None,
        cache: bool = True,
        cache_dir: str | Path | None = None,
        stream: bool = True,
        on_text: OnText | None = None,
    ) -> Self:
        """The model of that name.

        Args:
            model: Model id.
            how: Temperature, limits and patience.
            base_url: Address of the endpoint; default CHAUFFEUR_BASE_URL, OPENAI_BASE_URL, then OpenAI's own.
            seed: For servers that take one; also seeds the jitter of retries.
            cache: Whether to keep replies on disk and use kept ones.
            cache_dir: Where; default is the user's cache folder.
            stream: Ask for the reply piece by piece.
            on_text: Gets the reply as it is written.

        Raises:
            ConfigError: The address is none.
        """
        import numpy as np

        root = Path(cache_dir) if cache_dir is not None else default_cache_dir()
        return cls(
            model,
            parse_address(base_url, os.environ),
            rng=np.random.default_rng(seed),
            sampling=Sampling(temperature=how.temperature, seed=seed, max_tokens=how.max_tokens),
            timeout_s=how.timeout_s,
            retry=RetryPolicy(attempts=how.attempts),
            budget_s=how.plan_s,
            cache=ReplyCache(root) if cache else None,
            on_text=on_text,
            stream=stream,
        )

    @property
    def id(self) -> str:
        """`openai/<model>`."""
        return f"openai/{self.model}"

    async def write(self, messages: Sequence[Message]) -> Prose:
        """The model's words to a conversation, read as they are.

        Raises:
            EndpointError: The endpoint gave no reply that can be read; a `PlannerError`.
        """
        bill = ChatBill()
        completion = await self.within_budget(self.complete(list(messages), bill))
        said = read_model_text(completion.text, cut=was_cut(completion))
        model, usage = completion.model or self.model, self.usage(bill)
        return Prose(said.answer.strip(), not said.cut, model, usage, declined=declines(completion))

    async def within_budget(self, work: Awaitable[T]) -> T:
        """Await work within the budget of a plan. Raises EndpointError when it takes longer."""
        try:
            async with asyncio.timeout(self._budget_s):
                return await work
        except TimeoutError:
            raise timed_out(self._address.url, self._budget_s) from None

    def prompt(self, messages: list[Message]) -> Prompt:
        """The request that would be sent, without sending it; needs no key."""
        body = self._endpoint.body(messages, self._sampling)
        sent: list[Message] = body.pop("messages")
        return Prompt(f"{self._address.url}/chat/completions", sent, body)

    async def close(self) -> None:
        """Close the connections to the endpoint."""
        await self._endpoint.close()

    async def complete(self, messages: list[Message], bill: ChatBill) -> Completion:
        """One reply, from the cache or the endpoint, and what it costs. Raises EndpointError."""
        bill.answers += 1
        key = endpoint_key(self._address.url, self.model, messages, self._sampling.parameters())
        kept = self._cache.get(key) if self._cache else None
        if kept is not None:
            bill.cached_answers += 1
            bill.prompt_tokens += kept.prompt_tokens
            bill.completion_tokens += kept.completion_tokens
            self._show(kept.text, bill.requests)
            keep_exchange(messages, kept.text)
            return kept

        async def attempt() -> Completion:
            bill.requests += 1
            number = bill.requests
            try:
                return await self._endpoint.complete(messages, self._sampling, lambda text: self._show(text, number))
            except EndpointError as error:
                if error.kind != "timeout" or self._retry.attempts == 1:
                    raise
                if self._sampling.temperature == 0.0:
                    raise error.not_again("the same request at temperature 0 would take as long") from None
                _log.warning("%s The request is sent again.", error.message)
                raise

        completion = await with_retries(attempt, self._retry, self._rng, self._sleep)
        bill.prompt_tokens += completion.prompt_tokens
        bill.completion_tokens += completion.completion_tokens
        bill.priced_prompt += completion.prompt_tokens
        bill.priced_completion += completion.completion_tokens
        if self._cache and completion.text and completion.finish == "stop":
            self._cache.put(key, completion)
        keep_exchange(messages, completion.text)
        return completion

    def usage(self, bill: ChatBill) -> Usage:
        """A bill as it stands on a plan."""
        return Usage(
            prompt_tokens=bill.prompt_tokens,
            completion_tokens=bill.completion_tokens,
            cost_usd=cost_usd(self._address.host, self.model, bill.priced_prompt, bill.priced_completion),
            requests=bill.requests,
            cached=bill.cached_answers == bill.answers,
        )

    def _show(self, text: str, number: int) -> None:
        if self._on_text is None or not text:
            return
        try:
            self._on_text(text, number)
        except Exception:  # noqa: BLE001 - whatever it raised is logged with its traceback
            # A display that fails must not cost the passenger the plan.
            _log.exception("the display of the reply failed and is switched off")
            self._on_text = None
