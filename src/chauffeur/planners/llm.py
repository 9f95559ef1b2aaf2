"""The planner behind any OpenAI-compatible endpoint: cloud, vLLM, SGLang, LMDeploy, llama.cpp, Ollama."""

from __future__ import annotations

import asyncio
import logging
import os
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from chauffeur.concept import ConfigError, InstructionError, Plan, PlanRequest, Program, Thoughts, Usage
from chauffeur.concept.addresses import Address
from chauffeur.planners.base import OnText, Prompt, Prose
from chauffeur.planners.cache import Completion, ReplyCache, default_cache_dir, endpoint_key
from chauffeur.planners.llm_address import parse_address
from chauffeur.planners.llm_endpoint import Endpoint, Sampling
from chauffeur.planners.llm_errors import EndpointError, timed_out
from chauffeur.planners.llm_reply import MAX_REPLY_CHARS, Reply, read_reply, without_thinking
from chauffeur.planners.llm_retry import RetryPolicy, with_retries
from chauffeur.planners.llm_settings import settings_from
from chauffeur.planners.pricing import cost_usd
from chauffeur.planners.prompts import Message, build_messages, repair_turns
from chauffeur.planners.wish_goal import NO_GOAL, goal_of
from chauffeur.safety.envelope import policy_findings

if TYPE_CHECKING:
    import numpy as np

_log = logging.getLogger(__name__)

Gate = Callable[[str], list[str]]
"""What the static gate finds in a program, one message (line, reason, remedy) each; empty when it may drive."""

_CUT = frozenset({"length", "capped"})
"""How a reply ends that its model did not end."""

INTENT_DECLINED = "declined"
"""`Plan.intent` when the model declined."""

INTENT_UNUSABLE = "unusable"
"""`Plan.intent` when the model answered, twice, with nothing that is a program; the model failed, not the wish."""


@dataclass(slots=True)
class _Bill:
    """What one plan has cost so far."""

    prompt_tokens: int = 0
    completion_tokens: int = 0
    requests: int = 0
    answers: int = 0
    cached_answers: int = 0
    priced_prompt: int = 0
    priced_completion: int = 0


class LlmPlanner:
    """Asks a model for a program, checks it, and asks once more if the gate refuses it.

    Args:
        model: Model id as the endpoint knows it.
        address: Where the endpoint is.
        rng: Jitter of the waits between retries.
        sampling: How to sample.
        timeout_s: For one whole reply.
        retry: How often and how patiently to try again.
        repairs: How often the model may correct an answer the gate refused.
        budget_s: For a whole plan, retries, waits and repairs included.
        cache: Where to keep replies; None keeps nothing.
        gate: Checks a program's text; default is the gate of `chauffeur.programs`.
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
        repairs: int = 1,
        budget_s: float = 180.0,
        cache: ReplyCache | None = None,
        gate: Gate | None = None,
        on_text: OnText | None = None,
        stream: bool = True,
        environ: Mapping[str, str] = os.environ,
        sleep: Callable[[float], Awaitable[None]] = asyncio.sleep,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._model = model
        self._address = address
        self._rng = rng
        self._sampling = sampling or Sampling()
        self._retry = retry or RetryPolicy()
        self._repairs = repairs
        self._budget_s = budget_s
        self._cache = cache
        self._gate = gate
        self._on_text = on_text
        self._sleep = sleep
        self._clock = clock
        self._endpoint = Endpoint(
            address, model, timeout_s=timeout_s, max_chars=MAX_REPLY_CHARS, stream=stream, environ=environ
        )

    @classmethod
    def from_spec(
        cls,
        argument: str,
        *,
        base_url: str | None = None,
        temperature: float | Literal["server"] | None = None,
        seed: int | None = None,
        max_tokens: int | None = None,
        timeout_s: float | None = None,
        attempts: int | None = None,
        repairs: int | None = None,
        budget_s: float | None = None,
        cache: bool = True,
        cache_dir: str | Path | None = None,
        stream: bool = True,
        gate: Gate | None = None,
        on_text: OnText | None = None,
    ) -> LlmPlanner:
        """Planner for `openai/<model>`.

        Args:
            argument: Model id.
            base_url: Address of the endpoint; default CHAUFFEUR_BASE_URL, OPENAI_BASE_URL, then OpenAI's own.
            temperature: As `LlmSettings` has it, as the five after it; None takes it from the environment, else as it
                stands. `server` leaves it to the server.
            seed: For servers that take one; also seeds the jitter of retries.
            max_tokens: See `LlmSettings`.
            timeout_s: See `LlmSettings`.
            attempts: See `LlmSettings`.
            repairs: See `LlmSettings`.
            budget_s: See `LlmSettings`.
            cache: Whether to keep replies on disk and use kept ones.
            cache_dir: Where; default is the user's cache folder.
            stream: Ask for the reply piece by piece.
            gate: Checks a program's text.
            on_text: Gets the reply as it is written.

        Raises:
            ConfigError: A setting is missing or out of range.
        """
        model = argument.strip()
        if not model:
            raise ConfigError("The openai planner needs a model.", hint="Write for example openai/gpt-4o.")
        how = settings_from(
            os.environ,
            {
                "temperature": temperature,
                "max_tokens": max_tokens,
                "timeout_s": timeout_s,
                "attempts": attempts,
                "repairs": repairs,
                "budget_s": budget_s,
            },
        )
        import numpy as np

        root = Path(cache_dir) if cache_dir is not None else default_cache_dir()
        return cls(
            model,
            parse_address(base_url, os.environ),
            rng=np.random.default_rng(seed),
            sampling=Sampling(temperature=how.temperature, seed=seed, max_tokens=how.max_tokens),
            timeout_s=how.timeout_s,
            retry=RetryPolicy(attempts=how.attempts),
            repairs=how.repairs,
            budget_s=how.plan_s,
            cache=ReplyCache(root) if cache else None,
            gate=gate,
            on_text=on_text,
            stream=stream,
        )

    @property
    def id(self) -> str:
        """`openai/<model>`."""
        return f"openai/{self._model}"

    @property
    def model(self) -> str:
        """Model id as asked for."""
        return self._model

    async def plan(self, request: PlanRequest) -> Plan:
        """One plan.

        Raises:
            InstructionError: The wish is empty.
            EndpointError: The endpoint gave no reply that can be read; a `PlannerError`.
        """
        if not request.instruction.text.strip():
            raise InstructionError("The instruction is empty.", hint="Say what you want the car to do.")
        started_s = self._clock()
        bill = _Bill()
        try:
            async with asyncio.timeout(self._budget_s):
                completion, reply = await self._converse(request, bill)
        except TimeoutError:
            raise timed_out(self._address.url, self._budget_s) from None
        policy = _program(reply.source, request.system.library) if reply.source is not None else None
        goal = NO_GOAL if policy is None else goal_of(request)
        return Plan(
            thoughts=Thoughts(reply.thoughts),
            # A program that the gate still refuses is handed on: the checks of the loop refuse it on the record.
            policy=policy,
            refusal=reply.refusal or (f"The model gave no usable program: {reply.problem}." if reply.problem else ""),
            intent=INTENT_DECLINED if reply.refusal else INTENT_UNUSABLE if reply.problem else goal.intent,
            settings=goal.settings,
            planner=self.id,
            model=completion.model or self._model,
            usage=self._usage(bill),
            latency_s=self._clock() - started_s,
            raw=completion.text,
        )

    async def write(self, messages: Sequence[Message]) -> Prose:
        """The model's words to a conversation, read as they are.

        Raises:
            EndpointError: The endpoint gave no reply that can be read; a `PlannerError`.
        """
        bill = _Bill()
        try:
            async with asyncio.timeout(self._budget_s):
                completion = await self._complete(list(messages), bill)
        except TimeoutError:
            raise timed_out(self._address.url, self._budget_s) from None
        text = without_thinking(completion.text[:MAX_REPLY_CHARS]).strip()
        whole = completion.finish not in _CUT
        return Prose(text, whole, completion.model or self._model, self._usage(bill))

    def prompt(self, request: PlanRequest) -> Prompt:
        """What would be sent first for a request. Asks nobody, needs no key."""
        body = self._endpoint.body(build_messages(request), self._sampling)
        messages: list[Message] = body.pop("messages")
        return Prompt(f"{self._address.url}/chat/completions", messages, body)

    async def close(self) -> None:
        """Close the connections to the endpoint."""
        await self._endpoint.close()

    async def _converse(self, request: PlanRequest, bill: _Bill) -> tuple[Completion, Reply]:
        messages = build_messages(request)
        completion, reply, findings = await self._answer(messages, request, bill)
        for _ in range(self._repairs):
            if not findings:
                break
            _log.info("%s: asking for a repair: %s", self.id, "; ".join(findings))
            messages = [*messages, *repair_turns(completion.text, findings)]
            completion, reply, findings = await self._answer(messages, request, bill)
        return completion, reply

    async def _answer(
        self, messages: list[Message], request: PlanRequest, bill: _Bill
    ) -> tuple[Completion, Reply, list[str]]:
        completion = await self._complete(messages, bill)
        reply = read_reply(completion.text, cut=completion.finish in _CUT)
        if reply.problem:
            return completion, reply, [reply.problem]
        return completion, reply, self._findings(reply.source, request) if reply.source is not None else []

    def _findings(self, source: str, request: PlanRequest) -> list[str]:
        """What the checks find in a program: not of the language; else numbers and moves that road or limits forbid."""
        library = request.system.library
        found = program_findings(source, library) if self._gate is None else self._gate(source)
        return found or policy_findings(_program(source, library), request.context.situation, request.limits)

    async def _complete(self, messages: list[Message], bill: _Bill) -> Completion:
        bill.answers += 1
        key = endpoint_key(self._address.url, self._model, messages, self._sampling.parameters())
        kept = self._cache.get(key) if self._cache else None
        if kept is not None:
            bill.cached_answers += 1
            bill.prompt_tokens += kept.prompt_tokens
            bill.completion_tokens += kept.completion_tokens
            self._show(kept.text, bill.requests)
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
        return completion

    def _show(self, text: str, number: int) -> None:
        if self._on_text is None or not text:
            return
        try:
            self._on_text(text, number)
        except Exception:  # noqa: BLE001 - whatever it raised is logged with its traceback
            # A display that fails must not cost the passenger the plan.
            _log.exception("the display of the reply failed and is switched off")
            self._on_text = None

    def _usage(self, bill: _Bill) -> Usage:
        return Usage(
            prompt_tokens=bill.prompt_tokens,
            completion_tokens=bill.completion_tokens,
            cost_usd=cost_usd(self._address.host, self._model, bill.priced_prompt, bill.priced_completion),
            requests=bill.requests,
            cached=bill.cached_answers == bill.answers,
        )


def _program(source: str, library: str) -> Program:
    """P with the part of the offered library that it can come to use."""
    if not library:
        return Program(source)
    from chauffeur.programs.library import needed

    return Program(source, library=needed(source, library))


def program_findings(source: str, library: str = "") -> list[str]:
    """What the gate of `chauffeur.programs` finds in a program that may call a library, in words."""
    from chauffeur.programs.gate import check_source

    report = check_source(source, library)
    return [] if report.passed else [str(finding) for finding in report.findings]
