"""Reads the exemplar texts and fills them.

An `.lmp` file holds programs, each under a line `### id` with its title in a comment line. `$name` stands for a number,
`@name` for a helper of `snippets.lmp`. Everything above the line `#: hold` brings the manoeuvre about; what follows
keeps it, and is left out when another manoeuvre comes next.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from string import Template

from chauffeur.planners.onboard.exemplars.crossing import DONE_M, ON_THE_WAY_M, PACKAGE, crossing_program
from chauffeur.planners.onboard.exemplars.texts import sections

FILES = ("speed", "gap", "road", "turn", "stop", "style")
_HOLD = "#: hold"
_NAME = re.compile(r"^def (\w+)\(\):$", re.MULTILINE)
_NUMBER = re.compile(r"\$([a-z]\w*)")


@dataclass(frozen=True, slots=True)
class Exemplar:
    """A program with open numbers.

    Attributes:
        id: E.g. `gap.wider_by`.
        title: What it does, one sentence.
        text: Its lines, helpers put in.
        function: Name of its function.
        numbers: Names of its open numbers.
    """

    id: str
    title: str
    text: str
    function: str
    numbers: frozenset[str]


@dataclass(frozen=True, slots=True)
class Filled:
    """An exemplar and the numbers to fill it with; those it has no place for are ignored."""

    id: str
    numbers: Mapping[str, float]


@cache
def exemplars() -> Mapping[str, Exemplar]:
    """All exemplars by id, in the order of the files."""
    snippets = sections(PACKAGE, "snippets")
    return {name: _exemplar(name, body, snippets) for file in FILES for name, body in sections(PACKAGE, file).items()}


def program_of(steps: Sequence[Filled]) -> str:
    """Program text that does the steps one after the other."""
    if len(steps) == 1:
        return function_of(steps[0], whole=True)
    parts: list[str] = []
    names: list[str] = []
    for index, step in enumerate(steps):
        text = function_of(step, whole=index == len(steps) - 1)
        name = _function(step)
        unique = name if name not in names else f"{name}_{index + 1}"
        parts.append(text.replace(f"def {name}():", f"def {unique}():", 1))
        names.append(unique)
    calls = "".join(f"    yield from {name}()\n" for name in names)
    parts.append(f"def in_this_order():\n    # One after the other.\n{calls}")
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def _function(step: Filled) -> str:
    if step.id.startswith("crossing."):
        return "go_straight" if step.id == "crossing.straight" else "turn"
    return exemplars()[step.id].function


def number(value: float) -> str:
    """A number as the programs and the thoughts write it: two digits at most, one at least, whole counts plain."""
    if isinstance(value, int):
        return str(value)
    text = f"{value:.2f}"
    return text[:-1] if text.endswith("0") else text


def function_of(step: Filled, *, whole: bool) -> str:
    """The function of one step; without `whole`, only what brings the manoeuvre about."""
    kind, _, side = step.id.partition(".")
    if kind == "crossing":
        return crossing_program(side, {**step.numbers, "END": DONE_M if whole else ON_THE_WAY_M})
    text = exemplars()[step.id].text
    if not whole and _HOLD in text:
        text = text[: text.index(_HOLD)].rstrip() + "\n"
    lines = [line for line in text.splitlines() if line.strip() != _HOLD]
    return Template("\n".join(lines) + "\n").substitute({k: number(v) for k, v in step.numbers.items()})


def _exemplar(name: str, body: str, snippets: Mapping[str, str]) -> Exemplar:
    title, _, code = body.partition("\n")
    for snippet, text in snippets.items():
        code = code.replace(f"    @{snippet}\n", text)
    function = _NAME.search(code)
    assert title.startswith("# ")
    assert function is not None
    code = code.replace(function[0], f"{function[0]}\n    {title}", 1)
    return Exemplar(name, title[2:], code, function[1], frozenset(_NUMBER.findall(code)))
