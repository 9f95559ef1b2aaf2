"""Asks a language model for controller parameters: S, C, I and H as in the paper's Eq. 11 to 17.

`talk2drive` reads with the on-board model; `talk2drive/openai/<model>` asks any OpenAI-compatible endpoint. What comes
back is parameters and the thought behind them, and nothing else: no text of a model is run, and engaging the vehicle
is not among the parameters.
"""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from typing import Final

from chauffeur.concept import (
    ConfigError,
    History,
    HistoryItem,
    InstructionError,
    Limits,
    Plan,
    PlanRequest,
    Usage,
)
from chauffeur.concept.units import kmh
from chauffeur.memory.conflicts import conflicts_in
from chauffeur.planners.base import OnText, Planner, Prompt, Prompting, Prose, Writer, declined, planned
from chauffeur.planners.llm_repair import asked_and_repaired
from chauffeur.planners.prompts import Message, data_block, wish_turn
from chauffeur.planners.prompts.system import fill, template
from chauffeur.planners.talk2drive.answer import ParametersAnswer, read_answer
from chauffeur.planners.talk2drive.style import DISTANCE_M, RATIO_S
from chauffeur.planners.weather_doubts import never_faster
from chauffeur.planners.wish_goal import goal_of
from chauffeur.safety.envelope import policy_findings

PROMPT_VERSION: Final = "talk2drive-prompt-v2"

_ASK: Final = "Answer with the JSON object for the instruction above."
_ASK_AGAIN: Final = "Answer again with one JSON object that takes this into account."
_ITEM_CHARS: Final = 1_500
_ITEMS: Final = 6


class Talk2DrivePlanner:
    """Plans parameters by way of a model that writes prose."""

    def __init__(self, writer: Writer, name: str, *, repairs: int = 1) -> None:
        """Set up.

        Args:
            writer: The model.
            name: Its specification, e.g. `openai/gpt-4o`.
            repairs: How often it may correct an answer that cannot be read.
        """
        self._writer, self._name, self._repairs = writer, name, repairs

    @classmethod
    def from_spec(cls, argument: str, *, base_url: str | None = None, on_text: OnText | None = None) -> Planner:
        """The planner named `talk2drive`, or `talk2drive/openai/<model>`.

        Raises:
            ConfigError: There is no such model, or it writes no prose.
        """
        from chauffeur.planners.registry import make_planner, takes_option

        if not argument:
            from chauffeur.planners.onboard.language_model import SHIPPED, LanguageModelPlanner
            from chauffeur.planners.talk2drive.embedded import EmbeddedParameters

            return EmbeddedParameters(LanguageModelPlanner(SHIPPED, on_text=on_text))
        options: dict[str, object] = {}
        if base_url is not None:
            options["base_url"] = base_url
        if on_text is not None and takes_option(argument, "on_text"):
            options["on_text"] = on_text
        writer = make_planner(argument, **options)
        if not isinstance(writer, Writer):
            raise ConfigError(
                f"The planner {argument!r} cannot be asked for parameters.",
                hint="Write: talk2drive, or talk2drive/openai/<model>.",
            )
        return cls(writer, argument)

    @property
    def id(self) -> str:
        """Registry name with the model."""
        return f"talk2drive/{self._name}"

    @property
    def model(self) -> str:
        """Model as asked for."""
        return self._name.partition("/")[2]

    @never_faster
    async def plan(self, request: PlanRequest) -> Plan:
        """One plan.

        Raises:
            InstructionError: The wish is empty.
            PlannerError: The endpoint gave no reply that can be read.
        """
        if not request.instruction.text.strip():
            raise InstructionError("The instruction is empty.", hint="Say what you want the car to do.")
        begun = time.perf_counter()
        findings = partial(_findings, request=request)
        answer, prose, usage = await asked_and_repaired(
            self._writer.write, messages_for(request), _read, findings, repairs=self._repairs, ask=_ASK_AGAIN
        )
        return self._plan(request, answer, prose, usage, begun)

    def prompt(self, request: PlanRequest) -> Prompt:
        """The first prompt for a request, without sending it.

        Raises:
            ConfigError: The model behind it does not say.
        """
        if not isinstance(self._writer, Prompting):
            raise ConfigError(f"{self._name} does not say what it would send.")
        return replace(self._writer.prompt(request), messages=messages_for(request))

    def _plan(self, request: PlanRequest, answer: ParametersAnswer, prose: Prose, usage: Usage, begun: float) -> Plan:
        if answer.parameters is None:
            words = answer.refusal or f"The model gave no usable parameters: {answer.problem}."
            intent = "declined" if answer.refusal else "unusable"
            return declined(self, words, begun, intent=intent, usage=usage, raw=prose.text)
        goal = goal_of(request)
        speed = {"target_speed_mps": round(answer.parameters.target_speed_mps, 3)}
        return planned(
            self,
            answer.thoughts,
            answer.parameters,
            begun,
            intent=goal.intent,
            model=prose.model,
            settings=tuple((speed | dict(goal.settings)).items()),
            usage=usage,
            raw=prose.text,
        )


def _read(prose: Prose) -> ParametersAnswer:
    return ParametersAnswer("", refusal=prose.text) if prose.declined else read_answer(prose.text, whole=prose.whole)


def _findings(answer: ParametersAnswer, request: PlanRequest) -> list[str]:
    """Findings for the model to repair: an unreadable answer, or parameters that road or limits forbid."""
    if answer.parameters is None:
        return [answer.problem] if answer.problem else []
    return policy_findings(answer.parameters, request.context.situation, request.limits)


def messages_for(request: PlanRequest) -> list[Message]:
    """The conversation: S, then C, H and I as quoted data."""
    return [
        {"role": "system", "content": system_text(request.limits)},
        {"role": "user", "content": wish_turn(request, history=_history(request), ask=_ASK)},
    ]


def system_text(limits: Limits) -> str:
    """S (Eq. 14) with the limits the model is told of."""
    cap = limits.max_speed_mps
    values = {
        "distance_low": f"{DISTANCE_M[0]:g}",
        "distance_high": f"{DISTANCE_M[1]:g}",
        "ratio_low": f"{RATIO_S[0]:g}",
        "ratio_high": f"{RATIO_S[1]:g}",
        "over_kmh": f"{kmh(limits.max_over_limit_mps):.0f}",
        "cap": "" if cap is None else f"\n- Never faster than {kmh(cap):.0f} km/h, whatever the sign says.",
    }
    return fill(template("talk2drive.md"), values)


def _history(request: PlanRequest) -> str:
    """H (Eq. 17): command, action and evaluation of earlier trips, newest first, each with its date; then what in them
    does not go together, both sides with their dates."""
    items = sorted(request.history.items, key=lambda item: item.when, reverse=True)[:_ITEMS]
    if not items:
        return ""
    blocks = (data_block(f"trip-{index}", _item(item), _ITEM_CHARS) for index, item in enumerate(items, start=1))
    told = "The history commands, actions, and the passenger's feedback, newest first:\n" + "\n".join(blocks)
    conflicts = "\n".join(conflict.to_model() for conflict in conflicts_in(History(tuple(items))))
    if not conflicts:
        return told
    return f"{told}\nWhat of it contradicts itself:\n{data_block('conflicts', conflicts, _ITEM_CHARS)}"


def _item(item: HistoryItem) -> str:
    said = " / ".join(feedback.text for feedback in item.feedback)
    rows = (("Date", item.when[:10]), ("Command", item.instruction), ("Action", item.policy), ("Evaluation", said))
    # One line a row, so that words from outside cannot pass for a row of their own.
    return "\n".join(f"{label}: {' '.join(text.split())}" for label, text in rows if text)
