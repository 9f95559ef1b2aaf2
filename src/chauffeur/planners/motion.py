"""Planners that give action matrices: a language model asked for gains, and the fixed gains it is compared with."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from chauffeur.concept import (
    ActionMatrix,
    CameraImage,
    ConfigError,
    InstructionError,
    Plan,
    PlanRequest,
    Thoughts,
)
from chauffeur.foreign.model_text import read_model_text
from chauffeur.foreign.numbers import numbers_in, plain_signs
from chauffeur.language.weather import (
    FOG,
    RAIN,
    SNOW,
    UNKNOWN,
    SaidWeather,
    said_weather,
    weather_of,
    without_said_weather,
    without_told_weather,
)
from chauffeur.planners.base import Answerer, Prose, no_argument, planned, total_usage
from chauffeur.planners.camera_faults import camera_fault
from chauffeur.planners.llm import INTENT_DECLINED, INTENT_UNUSABLE
from chauffeur.planners.llm_errors import EndpointError
from chauffeur.planners.llm_model import ChatModel
from chauffeur.planners.llm_repair import asked_and_repaired
from chauffeur.planners.llm_reply import Reply, refusal_in, tidy
from chauffeur.planners.llm_settings import settings_from
from chauffeur.planners.prompts.motion import ASK, MODERATE, matrix_words, motion_messages
from chauffeur.planners.prompts.turns import Message, words_of
from chauffeur.safety.envelope import policy_findings
from chauffeur.safety.gain_box import GAIN_NAMES, care, most_careful

_MATRIX: Final = re.compile(r"\[\s{0,40}\[([^\[\]]{1,200})\]\s{0,40}[,;]?\s{0,40}\[([^\[\]]{1,200})\],?\s{0,40}\]")
_NAMED: Final = re.compile(r"\bP[\s*_`]{0,8}[=:][\s*_`]{0,8}\Z")
_NAMED_CHARS: Final = 24
_ROW: Final = 3
_INTENT: Final = "motion.gains"
_UNREAD: Final = "I drive with my usual gains; I do not read the wish."
_IN_PROCESS: Final = "transformers/"
_TOLD_AS: Final[Mapping[SaidWeather, int]] = {"rain": RAIN, "fog": FOG, "snow": SNOW, "slippery": RAIN | SNOW}
_DOUBT: Final = "What is said and told of the weather leaves a doubt; I take the most careful of its readings."
MAX_TOKENS: Final = 256
"""Of an answer of a model in this process: thoughts and a matrix."""


def settings_of(policy: ActionMatrix) -> tuple[tuple[str, float], ...]:
    """Its gains by name, as memory keeps them."""
    return tuple(zip((name.lower() for name in GAIN_NAMES), (*policy.pid, *policy.mpc), strict=True))


def read_matrix(text: str, *, whole: bool = True) -> tuple[ActionMatrix | None, Reply]:
    """(the action matrix of a reply, its thoughts or refusal or what is wrong). Never raises.

    What is named P counts before what thoughts compare it with; two different ones are none. A reply that was cut
    counts where its matrix is named P.

    Args:
        text: The reply.
        whole: Whether the model came to its end by itself.
    """
    said = read_model_text(text, cut=not whole)
    answer = plain_signs(said.answer)
    found = [(_is_named(answer, one.start()), one) for one in _MATRIX.finditer(answer)]
    named = [one for is_named, one in found if is_named]
    words = _MATRIX.sub("", answer)
    reason = refusal_in(words, beside=bool(found))
    thoughts = tidy(re.sub(r"\bP[\s*`]{0,8}=[\s*`]{0,8}\Z", "", words.rstrip(" \n\t*`").removesuffix("```")))
    if reason is not None:
        return None, Reply(thoughts, refusal=reason or "The model declined without giving a reason.")
    if said.cut and not named:
        return None, Reply(thoughts, problem="the answer was cut off before its action matrix; answer more briefly")
    meant = {tuple(tuple(numbers_in(row)) for row in one.groups()) for one in named or [one for _, one in found]}
    if not meant:
        return None, Reply(thoughts, problem="the answer holds no action matrix; give P = [[Kp, Ki, Kd], [Wl, Wh, Ws]]")
    if len(meant) > 1:
        return None, Reply(
            thoughts, problem="the answer holds different action matrices; give one, as P = [[...], [...]]"
        )
    pid, mpc = meant.pop()
    if len(pid) != len(mpc) or len(pid) != _ROW:
        return None, Reply(thoughts, problem="the action matrix is no two rows of three numbers")
    return ActionMatrix((pid[0], pid[1], pid[2]), (mpc[0], mpc[1], mpc[2])), Reply(thoughts)


def _is_named(text: str, at: int) -> bool:
    return _NAMED.search(text[max(0, at - _NAMED_CHARS) : at]) is not None


class MotionPlanner:
    """Asks a language model for gains; what the checks find is said once, for it to repair."""

    def __init__(self, model: Answerer, *, sees: bool = False) -> None:
        """Args: who writes; whether pictures are taken for it, until it turns out to take none."""
        self._writer, self.sees = model, sees
        self._earlier: CameraImage | None = None

    @classmethod
    def from_spec(
        cls, argument: str, *, base_url: str | None = None, temperature: float | None = None, cache: bool = True
    ) -> MotionPlanner:
        """Planner for `motion/<model>`, at the endpoint that `openai/<model>` would ask, or
        `motion/transformers/<folder>`: a vision-language model in this process, which is shown pictures.

        Args:
            argument: Model id.
            base_url, temperature, cache: As of `openai/<model>`.

        Raises:
            ConfigError: A setting is missing or out of range.
        """
        if not argument.strip():
            raise ConfigError("The motion planner needs a model.", hint="Write for example motion/gpt-4o.")
        if argument.startswith(_IN_PROCESS):
            from chauffeur.planners.transformers_vlm import TransformersAnswerer

            folder = argument.removeprefix(_IN_PROCESS)
            return cls(TransformersAnswerer.from_spec(folder, max_tokens=MAX_TOKENS), sees=True)
        how = settings_from(os.environ, {"temperature": temperature})
        return cls(ChatModel.of(argument.strip(), how, base_url=base_url, cache=cache), sees=True)

    @property
    def id(self) -> str:
        """`motion/<model>`."""
        return f"motion/{self._writer.model}"

    @property
    def model(self) -> str:
        """Model id as asked for."""
        return self._writer.model

    async def plan(self, request: PlanRequest) -> Plan:
        """One plan. Where what is said and told of the weather contradicts, the model is asked about each reading, and
        the most careful gains are driven; a camera that fails is answered without it, by the most careful gains.

        Raises:
            InstructionError: The wish is empty.
            EndpointError: The endpoint gave no reply that can be read; a `PlannerError`.
        """
        if not request.instruction.text.strip():
            raise InstructionError("The instruction is empty.", hint="Say how you want to be driven.")
        begun = time.perf_counter()
        fault = camera_fault(request.images, self._earlier) if request.images else ""
        self._earlier = request.images[-1] if request.images else None
        if fault:
            return self._blind(fault, begun)
        plans = [await self._asked(one) for one in readings_of(request)]
        usable = [one for one in plans if one.policy is not None]
        if plans[0].policy is None or not usable:
            return plans[0]
        chosen = max(usable, key=_care)
        if len(plans) > 1:
            thoughts = Thoughts(f"{_DOUBT} {chosen.thoughts.text}")
            chosen = replace(chosen, thoughts=thoughts, usage=total_usage(one.usage for one in plans))
        return replace(chosen, latency_s=time.perf_counter() - begun)

    def _blind(self, fault: str, begun: float) -> Plan:
        """The most careful gains, for a camera that shows nothing."""
        policy, scene = most_careful(), f"{fault}: I cannot see road or weather."
        return planned(
            self,
            f"{scene} I take my most careful gains until it shows something again.",
            policy,
            begun,
            intent=_INTENT,
            settings=settings_of(policy),
            raw=matrix_words(policy),
            scene=scene,
        )

    async def _write(self, messages: Sequence[Message]) -> Prose:
        """The model's words; of a model without eyes, to the words alone."""
        if self.sees:
            try:
                return await self._writer.write(messages)
            except EndpointError as error:
                if error.kind != "no_vision":
                    raise
                self.sees = False
        return await self._writer.write([{"role": one["role"], "content": words_of(one)} for one in messages])

    async def _asked(self, request: PlanRequest) -> Plan:
        """Ask the model about one reading of the situation, and once more with the findings of the checks."""
        begun = time.perf_counter()

        def findings(answer: tuple[ActionMatrix | None, Reply]) -> list[str]:
            policy, reply = answer
            if policy is not None:
                return policy_findings(policy, request.context.situation, request.limits)
            return [reply.problem] if reply.problem else []

        (policy, reply), prose, usage = await asked_and_repaired(
            self._write, motion_messages(request), _read, findings, repairs=1, ask=ASK
        )
        unusable = f"The model gave no usable gains: {reply.problem}." if reply.problem else ""
        return planned(
            self,
            reply.thoughts,
            policy,
            begun,
            refusal=reply.refusal or unusable,
            intent=INTENT_DECLINED if reply.refusal else INTENT_UNUSABLE if unusable else _INTENT,
            settings=() if policy is None else settings_of(policy),
            model=prose.model,
            usage=usage,
            raw=prose.text,
        )

    async def close(self) -> None:
        """Close the model's connections, if it has any."""
        close: Any = getattr(self._writer, "close", None)
        if close is not None:
            await close()


def readings_of(request: PlanRequest) -> list[PlanRequest]:
    """The request, and as others would have it who doubt what is said of the weather: without those words, and where
    the weather service says otherwise, without what it says. Whatever is left out of a request, the readings of the
    rest are among its own: the most careful of them is never made less careful by a contradiction."""
    text, found = request.instruction.text, [request]
    heard, told = said_weather(text), weather_of(request.context.situation)
    if heard == "none":
        return found
    if rest := without_said_weather(text):
        found.append(replace(request, instruction=replace(request.instruction, text=rest)))
    if told != UNKNOWN and heard in _TOLD_AS and not told & _TOLD_AS[heard]:
        found += [replace(one, context=without_told_weather(one.context)) for one in found]
    return found


def _care(plan: Plan) -> float:
    return care(plan.policy) if isinstance(plan.policy, ActionMatrix) else 0.0


class FixedGainsPlanner:
    """The same moderate gains whatever is said: the baseline of the paper's Tab. XI."""

    id = "gains"
    model = "gains-v1"

    @classmethod
    def from_spec(cls, argument: str) -> FixedGainsPlanner:
        """Planner for `gains`. Raises ConfigError: it takes no argument."""
        no_argument("gains", argument)
        return cls()

    async def plan(self, request: PlanRequest) -> Plan:
        """The fixed gains. Raises InstructionError: the wish is empty."""
        if not request.instruction.text.strip():
            raise InstructionError("The instruction is empty.", hint="Say how you want to be driven.")
        words, settings, raw = _UNREAD, settings_of(MODERATE), matrix_words(MODERATE)
        return planned(self, words, MODERATE, time.perf_counter(), intent=_INTENT, settings=settings, raw=raw)


def _read(prose: Prose) -> tuple[ActionMatrix | None, Reply]:
    return (None, Reply("", refusal=prose.text)) if prose.declined else read_matrix(prose.text, whole=prose.whole)
