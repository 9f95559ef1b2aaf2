"""Wordings from grammar tables: what somebody might say for a meaning, drawn at random and reproducibly.

A table is a text file with sections `[name]`, one template a line; a section may go on in another table. In a
template `(a|b|)` is a choice, `<piece>` a named part defined by a line `@piece = ...`, `{slot}` a value given when it
is said. A line may begin with marks:

    !   held out: training never says it, so that tests have phrasings of their own
    =   a whole sentence; without it the template is an imperative, which politeness may be wrapped around
    ~   part of a sentence: neither wrapped nor finished with a capital letter and a full stop

Lines with `;` are remarks; `;?` and `;!` give a section the question or the reason that answers its wishes.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import prod
from pathlib import Path

import numpy as np

_TOKEN = re.compile(r"[()|]|<[a-z_]+>|\{[a-z_]+\}|[^()|<{]+")


@dataclass(frozen=True, slots=True)
class Template:
    """One line of a table.

    Attributes:
        id: `section/number`, e.g. `dec_abs_dis/3`; the number counts lines within the section.
        tree: Parsed text.
        held: Held out from training.
        sentence: Whole sentence: no imperative frame is put around it.
        part: Part of a sentence.
    """

    id: str
    tree: Node
    held: bool
    sentence: bool
    part: bool = False


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


@dataclass(frozen=True, slots=True)
class GrammarFrame:
    """Words around a template's: `{body}` stands for them, `{ing}` for them with the first verb as a gerund.

    Attributes:
        text: The frame, as a template.
        unless: Texts it cannot go around; it is not drawn for them.
        plain: Texts it goes around badly; where it is drawn for one, the text stays alone.
    """

    text: str
    unless: re.Pattern[str] | None = None
    plain: re.Pattern[str] | None = None


@dataclass(frozen=True, slots=True)
class Manner:
    """Frames and endings of sentences.

    Attributes:
        frames: Put around imperatives, all equally likely; repeat one to make it more so.
        openings: Put around whole sentences; none leaves them as they are.
        questions: Beginnings, in lower case, of sentences that end with a question mark.
        gerunds: First verbs of imperatives and their gerunds, for frames with `{ing}`.
        unfinished: Share of sentences without a full stop.
        loud: Share of sentences with an exclamation mark instead.
    """

    frames: Sequence[GrammarFrame] = (GrammarFrame("{body}"),)
    openings: Sequence[GrammarFrame] = ()
    questions: tuple[str, ...] = ()
    gerunds: Mapping[str, str] = field(default_factory=dict[str, str])
    unfinished: float = 0.2
    loud: float = 0.0


class Grammar:
    """The tables of a folder and the manner in which their sentences are said."""

    def __init__(self, folder: Path, files: Sequence[str], manner: Manner) -> None:
        """Read the tables.

        Args:
            folder: Holds the tables.
            files: Names of the tables, without `.txt`.
            manner: Frames and endings.
        """
        self._sections: dict[str, tuple[Template, ...]] = {}
        self._pieces: dict[str, Node] = {}
        self._replies: dict[str, tuple[str, str]] = {}
        self._manner = manner
        self._frames = tuple((frame, _parse(frame.text)) for frame in manner.frames)
        self._openings = tuple((frame, _parse(frame.text)) for frame in manner.openings)
        for file in files:
            self._read((folder / f"{file}.txt").read_text(encoding="utf-8"))
        # (templates of training, templates held out)
        self._apart = {
            name: (tuple(t for t in found if not t.held), tuple(t for t in found if t.held))
            for name, found in self._sections.items()
        }

    def _read(self, text: str) -> None:
        section = ""
        for raw in text.splitlines():
            line = raw.strip()
            if line.startswith((";?", ";!")):
                self._replies[section] = (line[1], line[2:].strip())
            elif not line or line.startswith(";"):
                continue
            elif line.startswith("@"):
                name, _, body = line[1:].partition("=")
                assert name.strip() not in self._pieces, f"Piece {name} is defined twice"
                self._pieces[name.strip()] = _parse(body.strip())
            elif line.startswith("["):
                section = line.strip("[]")
                self._sections.setdefault(section, ())
            else:
                marks = re.match(r"[!=~ ]*", line)
                assert marks is not None
                number = len(self._sections[section])
                tree = _parse(line[marks.end() :])
                held, sentence, part = ("!" in marks[0], "=" in marks[0], "~" in marks[0])
                self._sections[section] += (Template(f"{section}/{number}", tree, held, sentence, part),)

    def sections(self) -> tuple[str, ...]:
        """Names of all sections."""
        return tuple(self._sections)

    def templates(self, section: str, *, held: bool | None = None) -> tuple[Template, ...]:
        """Templates of a section; `held` chooses those held out (True) or the others (False). KeyError if unknown."""
        return self._sections[section] if held is None else self._apart[section][held]

    def question(self, section: str) -> str:
        """Question about the wishes of a section; empty if they need none."""
        return self._reply(section, "?")

    def reason(self, section: str) -> str:
        """Reason to refuse the wishes of a section; empty if they are not refused."""
        return self._reply(section, "!")

    def _reply(self, section: str, kind: str) -> str:
        found = self._replies.get(section, ("", ""))
        return found[1] if found[0] == kind else ""

    def say(self, template: Template, slots: Mapping[str, str], rng: np.random.Generator) -> Wording:
        """One wording of a template. KeyError if it has a slot that is not given."""
        body = _clean(self._expand(template.tree, slots, rng))
        if template.part:
            return Wording(body, template.id)
        if not template.sentence:
            body = self._framed(self._frames, body, rng)
        elif self._openings:
            body = self._framed(self._openings, body, rng)
        return Wording(self._finish(body, rng), template.id)

    def clause(self, template: Template, slots: Mapping[str, str], rng: np.random.Generator) -> Wording:
        """The words of a template alone, to be put into a longer sentence: no frame, no capital letter, no ending."""
        return Wording(_clean(self._expand(template.tree, slots, rng)), template.id)

    def slots(self, template: Template) -> frozenset[str]:
        """Names of the slots that a template needs, those of its pieces among them."""
        return self._slots(template.tree)

    def text(self, template: Template) -> str:
        """All words that a template may say, one after the other, without its slots."""
        return self._text(template.tree)

    def forms(self, template: Template) -> int:
        """Ways of choosing within a template, frames apart."""
        return self._forms(template.tree)

    def _slots(self, node: Node) -> frozenset[str]:
        if node.kind == "slot":
            return frozenset((node.text,))
        if node.kind == "piece":
            return self._slots(self._pieces[node.text])
        return frozenset[str]().union(*(self._slots(part) for part in node.parts))

    def _text(self, node: Node) -> str:
        if node.kind == "text":
            return node.text
        if node.kind == "piece":
            return self._text(self._pieces[node.text])
        return " ".join(self._text(part) for part in node.parts)

    def _forms(self, node: Node) -> int:
        if node.kind == "piece":
            return self._forms(self._pieces[node.text])
        counts = [self._forms(part) for part in node.parts]
        return sum(counts) if node.kind == "any" else prod(counts)

    def _expand(self, node: Node, slots: Mapping[str, str], rng: np.random.Generator) -> str:
        if node.kind == "text":
            return node.text
        if node.kind == "slot":
            return slots[node.text]
        if node.kind == "piece":
            return self._expand(self._pieces[node.text], slots, rng)
        if node.kind == "any":
            return self._expand(node.parts[int(rng.integers(len(node.parts)))], slots, rng)
        return "".join(self._expand(part, slots, rng) for part in node.parts)

    def _framed(self, frames: Sequence[tuple[GrammarFrame, Node]], body: str, rng: np.random.Generator) -> str:
        first, _, rest = body.partition(" ")
        gerund = self._manner.gerunds.get(first, "")
        usable = [
            (frame, tree)
            for frame, tree in frames
            if (frame.unless is None or not frame.unless.search(body)) and (gerund or "{ing}" not in frame.text)
        ]
        frame, tree = usable[int(rng.integers(len(usable)))]
        if frame.plain is not None and frame.plain.search(body):
            return body
        if not frame.text.startswith("{body}") and not re.match(r"I\b", body):
            body = body[0].lower() + body[1:]
        return _clean(self._expand(tree, {"body": body, "ing": f"{gerund} {rest}".strip()}, rng))

    def _finish(self, sentence: str, rng: np.random.Generator) -> str:
        """Capital letter and a full stop, which people leave out now and then; questions end as questions."""
        sentence = sentence[0].upper() + sentence[1:]
        if sentence[-1] in ".?!":
            return sentence
        if self._manner.questions and sentence.lower().startswith(self._manner.questions):
            return sentence + "?"
        draw = rng.random()
        return sentence + ("" if draw < self._manner.unfinished else "!" if draw > 1.0 - self._manner.loud else ".")


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


def _clean(text: str) -> str:
    text = re.sub(r"\s+", " ", text).strip()
    return re.sub(r"(?<!\s)\s+([,.;:?!])", r"\1", text)
