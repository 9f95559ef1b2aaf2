"""Wordings from grammar tables: what a passenger might say for a meaning, drawn at random and reproducibly.

A table (`words/*.txt`) has sections `[name]`, one template a line. In a template `(a|b|)` is a choice, `<piece>` a
named part defined by a line `@piece = ...`, `{slot}` a value of the scene. A line may begin with marks:

    !   held out: only the test split says it, so that a phrasing never seen in training exists there
    =   a whole sentence; without it the template is an imperative, which politeness may be wrapped around

Templates are our own; no sentence of LaMPilot's data is among them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

FILES = ("pieces", "distance", "speed", "road", "steps", "hints", "refusals")
_TOKEN = re.compile(r"[()|]|<[a-z_]+>|\{[a-z_]+\}|[^()|<{]+")
_QUESTIONS = ("could you", "can you", "would you", "will you")


@dataclass(frozen=True, slots=True)
class Template:
    """One line of a table.

    Attributes:
        id: `section/number`, e.g. `dec_abs_dis/3`; the number counts lines within the section.
        tree: Parsed text.
        held: Only for the test split.
        sentence: Whole sentence: nothing is wrapped around it.
    """

    id: str
    tree: Node
    held: bool
    sentence: bool


@dataclass(frozen=True, slots=True)
class Node:
    """Part of a template: `text`, `slot` (name), `piece` (name), `seq` (parts in order) or `any` (one of the parts)."""

    kind: str
    text: str = ""
    parts: tuple[Node, ...] = ()


@dataclass(frozen=True, slots=True)
class Wording:
    """A sentence and the template it came from."""

    text: str
    template: str


@cache
def _tables() -> tuple[Mapping[str, tuple[Template, ...]], Mapping[str, Node]]:
    sections: dict[str, list[Template]] = {}
    pieces: dict[str, Node] = {}
    for file in FILES:
        section = ""
        text = resources.files(f"{__package__}.words").joinpath(f"{file}.txt").read_text(encoding="utf-8")
        for raw in text.splitlines():
            line = raw.strip()
            if not line or line.startswith(";"):
                continue
            if line.startswith("@"):
                name, _, body = line[1:].partition("=")
                pieces[name.strip()] = _parse(body.strip())
            elif line.startswith("["):
                section = line.strip("[]")
                sections[section] = []
            else:
                marks = re.match(r"[!= ]*", line)
                assert marks is not None
                body = line[marks.end() :]
                number = len(sections[section])
                template = Template(f"{section}/{number}", _parse(body), "!" in marks[0], "=" in marks[0])
                sections[section].append(template)
    return {name: tuple(held) for name, held in sections.items()}, pieces


def _parse(text: str) -> Node:
    tokens = _TOKEN.findall(text)
    node, end = _alternatives(tokens, 0)
    assert end == len(tokens), f"Unbalanced brackets in template {text!r}"
    return node


def _alternatives(bits: list[str], i: int) -> tuple[Node, int]:
    branches: list[Node] = []
    parts: list[Node] = []
    while i < len(bits) and bits[i] != ")":
        bit = bits[i]
        i += 1
        if bit == "|":
            branches.append(Node("seq", parts=tuple(parts)))
            parts = []
        elif bit == "(":
            inner, i = _alternatives(bits, i)
            assert i < len(bits), "A bracket of a template is not closed"
            parts.append(inner)
            i += 1
        elif bit.startswith("<"):
            parts.append(Node("piece", bit[1:-1]))
        elif bit.startswith("{"):
            parts.append(Node("slot", bit[1:-1]))
        else:
            parts.append(Node("text", bit))
    branches.append(Node("seq", parts=tuple(parts)))
    return (branches[0] if len(branches) == 1 else Node("any", parts=tuple(branches))), i


def templates(section: str, *, held: bool | None = None) -> tuple[Template, ...]:
    """Templates of a section; `held` chooses those held out (True) or the others (False). KeyError if unknown."""
    found = _tables()[0][section]
    return found if held is None else tuple(t for t in found if t.held == held)


def sections() -> tuple[str, ...]:
    """Names of all sections."""
    return tuple(_tables()[0])


def say(template: Template, slots: Mapping[str, str], rng: np.random.Generator) -> Wording:
    """One wording of a template. KeyError if it has a slot that is not given."""
    body = _clean(_expand(template.tree, slots, rng))
    return Wording(_finish(body, rng) if template.sentence else _wrap(body, rng), template.id)


def _expand(node: Node, slots: Mapping[str, str], rng: np.random.Generator) -> str:
    if node.kind == "text":
        return node.text
    if node.kind == "slot":
        return slots[node.text]
    if node.kind == "piece":
        return _expand(_tables()[1][node.text], slots, rng)
    if node.kind == "any":
        return _expand(node.parts[int(rng.integers(len(node.parts)))], slots, rng)
    return "".join(_expand(part, slots, rng) for part in node.parts)


def _clean(text: str) -> str:
    text = re.sub(r"\s+", " ", text).strip()
    return re.sub(r"\s+([,.;:?!])", r"\1", text)


_FRAMES = tuple(
    _parse(frame)
    for frame in (
        "{body}",
        "{body}",
        "{body}",
        "please {body}",
        "{body}, please",
        "(could|can|would|will) you {body}",
        "(could|can|would) you please {body}",
        "I('d like| want| need) you to {body}",
        "(okay|alright|hey), {body}",
        "{body} (now|for me)",
        "let's {body}",
    )
)
_TIMED = re.compile(r"\b(?:now|when|once|here|there|until|at the)\b")
"""Imperatives that end badly with "now" or "for me"."""
_OF_US = re.compile(r"\b(?:us|your)\b")
"""Imperatives that cannot follow "let's"."""


def _wrap(body: str, rng: np.random.Generator) -> str:
    usable = len(_FRAMES) - 1 if _OF_US.search(body) else len(_FRAMES)
    frame = _FRAMES[int(rng.integers(usable))]
    if frame is _FRAMES[9] and _TIMED.search(body):
        frame = _FRAMES[0]
    return _finish(_clean(_expand(frame, {"body": body}, rng)), rng)


def _finish(sentence: str, rng: np.random.Generator) -> str:
    """Capital letter and a full stop, which people leave out now and then; questions end as questions."""
    sentence = sentence[0].upper() + sentence[1:]
    if sentence[-1] in ".?!":
        return sentence
    if sentence.lower().startswith(_QUESTIONS):
        return sentence + "?"
    return sentence + ("" if rng.random() < 0.2 else ".")
