"""The rule-based planner: understand, choose an exemplar, write it down. Same request, same plan."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial

from chauffeur.concept import ConfigError, Plan, PlanRequest, Program
from chauffeur.planners.arbitration import Wish, alarm_in, asked, slow_words, unanswered, undenied, wary_of
from chauffeur.planners.base import declined
from chauffeur.planners.onboard.choose import choose
from chauffeur.planners.onboard.doubts import CAN_DO
from chauffeur.planners.onboard.exemplars import program_of
from chauffeur.planners.onboard.meaning import NotUnderstood
from chauffeur.planners.onboard.options import Declined
from chauffeur.planners.onboard.personal import corrections_of, leaning_of
from chauffeur.planners.onboard.thoughts import thoughts_of
from chauffeur.planners.onboard.town import asked_plainly, plan_in_town
from chauffeur.planners.onboard.understand import understand
from chauffeur.planners.weather_doubts import never_faster
from chauffeur.safety.dangers import danger

VERSION = "meaning-v2"
"""Changes whenever the same request could be planned differently."""


class RetrievalPlanner:
    """Plans by structured meaning and exemplar programs, in this process, in a few milliseconds."""

    @classmethod
    def from_spec(cls, argument: str) -> RetrievalPlanner:
        """The planner named `retrieval`. Raises ConfigError for an argument: it has no variants."""
        if argument:
            raise ConfigError(f"The retrieval planner has no variant {argument!r}.", hint="Write just: retrieval.")
        return cls()

    @property
    def id(self) -> str:
        """Registry name."""
        return "retrieval"

    @property
    def model(self) -> str:
        """Rule set with its version."""
        return VERSION

    @never_faster
    async def plan(self, request: PlanRequest) -> Plan:
        """One plan; a wish that is not understood or not possible is declined in words."""
        begun = time.perf_counter()
        if (told := plan_in_town(self, request)) is not None:
            return told
        plan = self._by_rules(request, begun)
        if (plainly := asked_plainly(request, plan)) is not None:
            return self._by_rules(plainly, begun)
        return plan

    def _by_rules(self, request: PlanRequest, begun: float) -> Plan:
        """The plan that the rules find."""
        ready = Wish.of(self, request.instruction, begun)
        if ready.declined is not None and not danger(request.instruction.text):
            return ready.declined
        reading = understand(ready.instruction.text)
        if reason := danger(request.instruction.text):  # whatever of it was taken back
            reading = NotUnderstood("unsupported", f"{reason} {CAN_DO}")
        if isinstance(reading, NotUnderstood):
            return declined(self, reading.words, begun, raw=reading.why)
        corrections = corrections_of(request.rounds)
        leaning = partial(leaning_of, request.history, corrections=corrections)
        wary = wary_of(ready.instruction.text, "+".join(step.family for step in reading.steps))
        alarm = alarm_in(ready.instruction.text, [step.family for step in reading.steps], reading.steps)
        choice = choose(reading, request.context.situation, request.limits, leaning, wary=wary)
        if isinstance(choice, Declined):
            intent = "+".join(step.family for step in reading.steps)
            return replace(declined(self, choice.words, begun, intent=intent), alarm=alarm)
        used = [leaning(step.family) for step in reading.steps]
        if why := slow_words(choice.steps, request.context.situation, request.limits):
            does = ", then ".join(step.does for step in choice.steps)
            if question := unanswered(request.instruction, f"{why} Shall I {does}?"):
                return replace(asked(self, question, begun, offer=ready.instruction.text), alarm=alarm)
        source = program_of([step.filled for step in choice.steps])
        plan = Plan(
            thoughts=thoughts_of(reading, choice, request.context.situation, used),
            policy=Program(source),
            intent=choice.intent,
            settings=choice.settings(used),
            planner=self.id,
            model=self.model,
            latency_s=time.perf_counter() - begun,
        )
        return undenied(self, plan, request, begun)
