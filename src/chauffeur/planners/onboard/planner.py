"""The planner itself: understand, choose, write down. Same request, same plan; nothing leaves the machine."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from chauffeur.concept import ConfigError, Feedback, Plan, PlanRequest, Program, Thoughts
from chauffeur.planners.onboard.choose import choose
from chauffeur.planners.onboard.exemplars import program_of
from chauffeur.planners.onboard.meaning import NotUnderstood, Reading
from chauffeur.planners.onboard.options import Declined
from chauffeur.planners.onboard.personal import leaning_of
from chauffeur.planners.onboard.thoughts import thoughts_of
from chauffeur.planners.onboard.understand import understand

if TYPE_CHECKING:
    from chauffeur.planners.onboard.language_model import LanguageModelPlanner

VERSION = "meaning-v2"
"""Changes whenever the same request could be planned differently."""


class OnboardPlanner:
    """Plans by structured meaning and exemplar programs, in this process, in a few milliseconds."""

    @classmethod
    def from_spec(cls, argument: str) -> OnboardPlanner | LanguageModelPlanner:
        """The planner named `onboard`; `onboard/FOLDER` is the language model of that folder.

        Raises:
            ConfigError: The argument is no folder.
            DataError: The folder holds no model.
        """
        if not argument:
            return cls()
        folder = Path(argument)
        if not folder.is_dir():
            raise ConfigError(
                f"The onboard planner has no variant {argument!r}.",
                hint="Write just: onboard; or onboard/FOLDER for the language model of a folder.",
            )
        from chauffeur.planners.onboard.language_model import LanguageModelPlanner

        return LanguageModelPlanner(folder)

    @property
    def id(self) -> str:
        """Registry name."""
        return "onboard"

    @property
    def model(self) -> str:
        """Rule set with its version."""
        return VERSION

    async def plan(self, request: PlanRequest) -> Plan:
        """One plan; a wish that is not understood or not possible is declined in words."""
        begun = time.perf_counter()
        reading = understand(request.instruction.text)
        if isinstance(reading, NotUnderstood):
            return self._declined(reading.words, begun, raw=reading.why)
        corrections = _corrections(request)
        leaning = partial(leaning_of, request.history, corrections=corrections)
        choice = choose(reading, request.context.situation, request.limits, leaning)
        if isinstance(choice, Declined):
            intent = "+".join(step.family for step in reading.steps)
            return self._declined(choice.words, begun, intent=intent)
        used = [leaning(step.family) for step in reading.steps]
        settings = {name: value for step in choice.steps for name, value in step.settings}
        settings |= {name: value for one in used for name, value in one.settings}
        source = program_of([step.filled for step in choice.steps])
        return Plan(
            thoughts=thoughts_of(reading, choice, request.context.situation, [one.because for one in used]),
            policy=Program(source),
            intent=choice.intent,
            settings=tuple(settings.items()),
            planner=self.id,
            model=self.model,
            latency_s=time.perf_counter() - begun,
        )

    def _declined(self, words: str, begun: float, *, intent: str = "", raw: str = "") -> Plan:
        return Plan(
            thoughts=Thoughts(words),
            policy=None,
            refusal=words,
            intent=intent,
            planner=self.id,
            model=self.model,
            latency_s=time.perf_counter() - begun,
            raw=raw,
        )


def _corrections(request: PlanRequest) -> tuple[Feedback, ...]:
    """What earlier rounds of the same wish were answered with, as feedback on the numbers."""
    said = (understand(one.feedback) for one in request.rounds)
    readings = [reading for reading in said if isinstance(reading, Reading)]
    out: list[Feedback] = []
    for reading in readings:
        for step in reading.steps:
            if step.manoeuvre == "speed" and step.change:
                out.append(Feedback("", speed=step.change, strength=step.degree))
            elif step.manoeuvre == "gap" and step.change:
                # a wish for more room says that the gap was too small
                out.append(Feedback("", gap=-1 if step.change > 0 else 1, strength=step.degree))
            elif step.manoeuvre == "style" and step.variant in ("comfort", "careful"):
                out.append(Feedback("", comfort=-1, strength=step.degree))
    return tuple(out)
