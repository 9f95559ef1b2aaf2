"""The planner of driving programs behind any OpenAI-compatible endpoint: cloud, vLLM, SGLang, llama.cpp, Ollama."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

from chauffeur.concept import ConfigError, InstructionError, Plan, PlanRequest, Program, Thoughts
from chauffeur.planners.base import OnText, Prompt, Prose
from chauffeur.planners.cache import Completion
from chauffeur.planners.llm_model import ChatBill, ChatModel, declines, was_cut
from chauffeur.planners.llm_reply import Reply, read_reply
from chauffeur.planners.llm_settings import settings_from
from chauffeur.planners.prompts import Message, build_messages, repair_turns
from chauffeur.planners.wish_goal import NO_GOAL, goal_of
from chauffeur.safety.envelope import policy_findings

_log = logging.getLogger(__name__)

Gate = Callable[[str], list[str]]
"""Findings of the static gate in a program, one message (line, reason, remedy) each; empty when it may drive."""

INTENT_DECLINED = "declined"
"""`Plan.intent` when the model declined."""

INTENT_UNUSABLE = "unusable"
"""`Plan.intent` when the model answered, twice, with nothing that is a program; the model failed, not the wish."""


class LlmPlanner:
    """Asks a model for a program, checks it, and asks once more if the gate refuses it.

    Args:
        model: Who is asked.
        repairs: How often the model may correct an answer the gate refused.
        gate: Checks a program's text; default is the gate of `chauffeur.programs`.
    """

    def __init__(self, model: ChatModel, *, repairs: int = 1, gate: Gate | None = None) -> None:
        self._chat, self._repairs, self._gate = model, repairs, gate

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
        chat = ChatModel.of(
            model,
            how,
            base_url=base_url,
            seed=seed,
            cache=cache,
            cache_dir=cache_dir,
            stream=stream,
            on_text=on_text,
        )
        return cls(chat, repairs=how.repairs, gate=gate)

    @property
    def id(self) -> str:
        """`openai/<model>`."""
        return self._chat.id

    @property
    def model(self) -> str:
        """Model id as asked for."""
        return self._chat.model

    async def plan(self, request: PlanRequest) -> Plan:
        """One plan.

        Raises:
            InstructionError: The wish is empty.
            EndpointError: The endpoint gave no reply that can be read; a `PlannerError`.
        """
        if not request.instruction.text.strip():
            raise InstructionError("The instruction is empty.", hint="Say what you want the car to do.")
        started_s = self._chat.clock()
        bill = ChatBill()
        completion, reply = await self._chat.within_budget(self._converse(request, bill))
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
            model=completion.model or self.model,
            usage=self._chat.usage(bill),
            latency_s=self._chat.clock() - started_s,
            raw=completion.text,
        )

    async def write(self, messages: Sequence[Message]) -> Prose:
        """As `ChatModel.write`."""
        return await self._chat.write(messages)

    def prompt(self, request: PlanRequest) -> Prompt:
        """The first prompt for a request, without sending it; needs no key."""
        return self._chat.prompt(build_messages(request))

    async def close(self) -> None:
        """Close the connections to the endpoint."""
        await self._chat.close()

    async def _converse(self, request: PlanRequest, bill: ChatBill) -> tuple[Completion, Reply]:
        messages = build_messages(request)
        completion, reply, findings = await self._answer(messages, request, bill)
        for _ in range(self._repairs):
            if not findings:
                break
            _log.info("%s: asking for a repair: %s", self.id, "; ".join(findings))
            refused = completion.text
            messages = [*messages, *repair_turns(refused, findings)]
            completion, reply, findings = await self._answer(messages, request, bill)
            if completion.text == refused:  # it would say the same again
                break
        return completion, reply

    async def _answer(
        self, messages: list[Message], request: PlanRequest, bill: ChatBill
    ) -> tuple[Completion, Reply, list[str]]:
        completion = await self._chat.complete(messages, bill)
        if declines(completion):
            return completion, Reply("", refusal=completion.text), []
        reply = read_reply(completion.text, cut=was_cut(completion))
        if reply.problem:
            return completion, reply, [reply.problem]
        return completion, reply, self._findings(reply.source, request) if reply.source is not None else []

    def _findings(self, source: str, request: PlanRequest) -> list[str]:
        """Findings in a program: those of the language, else numbers and moves that road or limits forbid."""
        library = request.system.library
        kind = request.context.situation.world
        found = program_findings(source, library, kind) if self._gate is None else self._gate(source)
        return found or policy_findings(_program(source, library), request.context.situation, request.limits)


def _program(source: str, library: str) -> Program:
    """P with the part of the offered library that it can come to use."""
    if not library:
        return Program(source)
    from chauffeur.programs.library import needed

    return Program(source, library=needed(source, library))


def program_findings(source: str, library: str = "", kind: str = "") -> list[str]:
    """Findings of the gate of `chauffeur.programs` in a program that may call a library, in words."""
    from chauffeur.programs.catalogue import vocabulary_of
    from chauffeur.programs.gate import check_source

    report = check_source(source, library, vocabulary_of(kind))
    return [] if report.passed else [str(finding) for finding in report.findings]
