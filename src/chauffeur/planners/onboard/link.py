"""From a program of the dialect to one that drives: its skills get bodies that fit the road, the limits and the person.

The bodies are the exemplar programs; which of them, and with which numbers, follows from the meaning of each call and
from the situation. A call that the situation does not allow is declined in words. The model's own text is not touched.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from chauffeur.concept import Limits, Situation
from chauffeur.planners.onboard.choose import Choice, choose
from chauffeur.planners.onboard.dialect import CONDITIONS, SKILLS, UNITS, DialectStep
from chauffeur.planners.onboard.exemplars import function_of
from chauffeur.planners.onboard.exemplars.texts import programs
from chauffeur.planners.onboard.meaning import Meaning
from chauffeur.planners.onboard.options import Chosen, Declined
from chauffeur.planners.onboard.personal import Leaning

PERIOD_S = 0.1
"""Time between two yields in the highway worlds."""

_WAIT = f"""def wait(seconds):
    for _ in range(int(seconds / {PERIOD_S} + 0.5)):
        yield autopilot()
"""

_TESTS = programs("chauffeur.planners.onboard", "conditions")
"""The functions of conditions, by name."""
assert _TESTS.keys() == CONDITIONS.keys()


@dataclass(frozen=True, slots=True)
class Linked:
    """A program's skills, settled.

    Attributes:
        choice: Exemplars, numbers and words of the steps.
        meanings: What they mean.
        library: The functions that the program calls.
    """

    choice: Choice
    meanings: tuple[Meaning, ...]
    library: str


def link(
    steps: Sequence[DialectStep],
    situation: Situation,
    limits: Limits,
    leaning: Callable[[str], Leaning],
    *,
    wary: bool = False,
) -> Linked | Declined:
    """Bodies for the skills of a program, or why this road or situation does not allow it.

    Args:
        steps: What the program does.
        situation: Where we are.
        limits: Bounds for what the planner chooses itself.
        leaning: What this person's history says about an intent.
        wary: Whether they say that the road is slippery or the sight bad.
    """
    meanings = tuple(step.meaning for step in steps)
    choice = choose(meanings, situation, limits, leaning, wary=wary, joins=False)
    if isinstance(choice, Declined):
        return choice
    return Linked(choice, meanings, _library(list(zip(steps, choice.steps, strict=True))))


def _library(chosen: Sequence[tuple[DialectStep, Chosen]]) -> str:
    parts: list[str] = []
    by_skill: dict[str, list[tuple[DialectStep, Chosen, bool]]] = {}
    for index, (step, one) in enumerate(chosen):
        by_skill.setdefault(step.skill, []).append((step, one, index == len(chosen) - 1))
    for name, uses in by_skill.items():
        parts += _definitions(name, uses)
    numbers = [
        n for step, _ in chosen for n in (step.number, step.wait_s, step.condition and step.condition.number) if n
    ]
    for unit in dict.fromkeys(number.unit for number in numbers if number.unit):
        parts.append(f"def {unit}(value):\n    return value * {UNITS[unit][1]!r}\n")
    for name in dict.fromkeys(step.condition.name for step, _ in chosen if step.condition is not None):
        parts.append(_TESTS[name])
    if any(step.wait_s is not None for step, _ in chosen):
        parts.append(_WAIT)
    return "\n\n".join(parts)


def _definitions(name: str, uses: Sequence[tuple[DialectStep, Chosen, bool]]) -> list[str]:
    """The function of a skill; of several uses with different numbers, one that tells them apart by its number."""
    parameters = [] if SKILLS[name].takes is None else ["amount"]
    if any(step.manner for step, _, _ in uses):
        parameters.append('how=""')
    head = f"def {name}({', '.join(parameters)}):"
    texts = [function_of(one.filled, whole=last) for _, one, last in uses]
    if len(uses) == 1 or SKILLS[name].takes is None:
        return [_named(texts[-1], head)]
    parts: list[str] = []
    lines = [head]
    for index, (step, _, last) in enumerate(uses):
        own = f"{name}_{index + 1}"
        parts.append(_named(texts[index], f"def {own}():"))
        assert step.number is not None
        lines.append(
            f"    {'else' if last or index == len(uses) - 1 else 'if' if not index else 'elif'}"
            + (":" if last or index == len(uses) - 1 else f" abs(amount - {step.number.si!r}) < 0.001:")
        )
        lines.append(f"        yield from {own}()")
    return [*parts, "\n".join(lines) + "\n"]


_HEAD = re.compile(r"^def \w+\(\):$", re.MULTILINE)


def _named(text: str, head: str) -> str:
    return _HEAD.sub(lambda _: head, text, count=1)
