"""The protocol of planners, and the plans that they sign."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol, runtime_checkable

from chauffeur.concept import ConfigError, Plan, PlanRequest, Policy, Thoughts, Usage
from chauffeur.planners.prompts import Message

NO_WISH: Final = "none"
"""The intent of a plan that drives nothing because words hold nothing for the driver: a story, praise, small talk."""

OnText = Callable[[str, int], None]
"""Gets each piece of a reply, and the number of the request it belongs to: a new number means: start over."""


@runtime_checkable
class Planner(Protocol):
    """Turns (I, C, S, H, feedback rounds) into (R, P).

    >>> isinstance(chauffeur.make_planner("onboard"), chauffeur.Planner)
    True
    """

    @property
    def id(self) -> str:
        """Registry name with the model, e.g. `openai/gpt-4o` or `onboard`; stands in every result."""
        ...

    @property
    def model(self) -> str:
        """Model or rule set with its version; stands in every result."""
        ...

    async def plan(self, request: PlanRequest) -> Plan:
        """One plan. Raises PlannerError when no plan can be had; declining is a Plan with `refusal`."""
        ...


def looks(planner: Planner) -> bool:
    """True if pictures are to be taken for a planner, which says so by an attribute `sees`."""
    return bool(getattr(planner, "sees", False))


def no_argument(name: str, argument: str) -> None:
    """Raise ConfigError if a planner without variants is given an argument."""
    if argument:
        raise ConfigError(f"The {name} planner has no variant {argument!r}.", hint=f"Write just: {name}")


def planned(planner: Planner, thoughts: str, policy: Policy | None, begun: float, **fields: Any) -> Plan:
    """A plan signed by its planner.

    Args:
        planner: Whose plan it is.
        thoughts: R.
        policy: P; None for a plan that drives nothing.
        begun: When planning began, by `time.perf_counter`.
        **fields: Other fields of `Plan`; a `model` replaces that of the planner.
    """
    signed: dict[str, Any] = {
        "planner": planner.id,
        "model": planner.model,
        "latency_s": time.perf_counter() - begun,
    }
    return Plan(Thoughts(thoughts), policy, **(signed | fields))


def total_usage(parts: Iterable[Usage]) -> Usage:
    """The cost of several requests together; in USD only if every part is priced."""
    found = tuple(parts)
    prices = [part.cost_usd for part in found if part.cost_usd is not None]
    return Usage(
        prompt_tokens=sum(part.prompt_tokens for part in found),
        completion_tokens=sum(part.completion_tokens for part in found),
        cost_usd=sum(prices) if len(prices) == len(found) else None,
        requests=sum(part.requests for part in found),
        cached=all(part.cached for part in found),
    )


def declined(
    planner: Planner, words: str, begun: float, *, intent: str = "", usage: Usage | None = None, raw: str = ""
) -> Plan:
    """A plan that drives nothing and says why.

    Args:
        planner: Whose plan it is.
        words: For the person.
        begun: When planning began, by `time.perf_counter`.
        intent: Short tag of what was understood.
        usage: What it cost; None for nothing.
        raw: What the planner's model wrote.
    """
    return planned(planner, words, None, begun, refusal=words, intent=intent, usage=usage or Usage(), raw=raw)


@dataclass(frozen=True, slots=True)
class Prompt:
    """The first request of a planner to its model.

    Attributes:
        url: Where to.
        messages: The conversation, word for word.
        parameters: Everything else in the request's body.
    """

    url: str
    messages: Sequence[Message]
    parameters: Mapping[str, Any]


@runtime_checkable
class Prompting(Protocol):
    """A planner that sends a prompt."""

    def prompt(self, request: PlanRequest) -> Prompt:
        """The first prompt for a request, without sending it."""
        ...


@dataclass(frozen=True, slots=True)
class Prose:
    """Words a model wrote that are no plan.

    Attributes:
        text: The words, without the reasoning that some models put in front.
        whole: Whether the model came to its end by itself.
        model: Model as the endpoint names it.
        usage: Cost.
        declined: Whether the endpoint marks the words as a refusal, or as what its filter left.
    """

    text: str
    whole: bool
    model: str
    usage: Usage
    declined: bool = False


@runtime_checkable
class Writer(Protocol):
    """A planner whose model can also be asked for prose, e.g. to describe a program."""

    async def write(self, messages: Sequence[Message]) -> Prose:
        """One reply to a conversation. Raises PlannerError when none can be had."""
        ...


@runtime_checkable
class Answerer(Writer, Protocol):
    """A model that answers questions in words; it need not be a planner.

    >>> model = chauffeur.make_planner("openai/m", base_url="http://localhost:8040/v1")
    >>> isinstance(model, chauffeur.Answerer)
    True
    """

    @property
    def id(self) -> str:
        """Registry name with the model; stands in every result."""
        ...

    @property
    def model(self) -> str:
        """Model with its version; stands in every result."""
        ...
