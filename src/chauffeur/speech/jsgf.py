"""The part of JSGF (Java Speech Grammar Format 1.0) that our grammars use, read for three purposes: to tell which rule
a sentence belongs to, to list the words, and to draw sentences. pocketsphinx reads the same text for a fourth."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib import resources
from typing import Final

import numpy as np

from chauffeur.concept import DataError

_TOKEN: Final = re.compile(r"<[\w.]+>|[\[\]()|;=]|[\w'.-]+|\S")
_REMARK: Final = re.compile(r"//[^\n]*")
_WORD: Final = re.compile(r"\A[a-z][a-z'.-]*\Z")
_DEEPEST: Final = 40


@dataclass(frozen=True, slots=True)
class Part:
    """A piece of a rule: `word`, `rule` (a name), `all` (parts in order), `any` (one of them), `may` (an option)."""

    kind: str
    text: str = ""
    parts: tuple[Part, ...] = ()


class SpeechGrammar:
    """Rules by name."""

    def __init__(self, text: str, source: str = "The grammar") -> None:
        """Read a grammar.

        Args:
            text: JSGF with words in lower case, rules, groups, options and alternatives; without weights, tags,
                repetitions and imports.
            source: What to call it in errors.

        Raises:
            DataError: Not that, an unknown or an endless rule.
        """
        self.text = text
        self._source = source
        self.rules: dict[str, Part] = {}
        self.public: tuple[str, ...] = ()
        self._patterns: dict[str, re.Pattern[str]] = {}
        head, _, body = _REMARK.sub("", text).partition(";")
        if not head.strip().startswith("#JSGF"):
            raise DataError(f"{source} does not begin with #JSGF.")
        declaration, _, body = body.partition(";")
        if not declaration.strip().startswith("grammar "):
            raise DataError(f"{source} has no grammar declaration.")
        self.name = declaration.split()[1]
        for statement in body.split(";"):
            if statement.strip():
                self._rule(_TOKEN.findall(statement))
        for rule in self.rules:
            self._check(rule, ())

    def _rule(self, tokens: list[str]) -> None:
        if tokens[0] == "public":
            tokens = tokens[1:]
            self.public += (tokens[0].strip("<>"),)
        if len(tokens) < 3 or not tokens[0].startswith("<") or tokens[1] != "=":
            raise self._error(f"cannot read {' '.join(tokens[:6])!r}")
        part, end = self._any(tokens, 2)
        if end != len(tokens):
            raise self._error(f"does not close a bracket in {tokens[0]}")
        self.rules[tokens[0].strip("<>")] = part

    def _any(self, tokens: list[str], i: int) -> tuple[Part, int]:
        branches: list[Part] = []
        parts: list[Part] = []
        while True:
            bit = tokens[i] if i < len(tokens) else ""
            if bit in ("", ")", "]", "|"):
                if not parts:
                    raise self._error(f"has an empty alternative near {' '.join(tokens[max(0, i - 4) : i + 2])!r}")
                branches.append(parts[0] if len(parts) == 1 else Part("all", parts=tuple(parts)))
                parts = []
                if bit != "|":
                    return (branches[0] if len(branches) == 1 else Part("any", parts=tuple(branches))), i
                i += 1
            elif bit in ("(", "["):
                inner, i = self._any(tokens, i + 1)
                if i >= len(tokens) or tokens[i] != {"(": ")", "[": "]"}[bit]:
                    raise self._error(f"does not close a bracket near {inner.text!r}")
                parts.append(inner if bit == "(" else Part("may", parts=(inner,)))
                i += 1
            elif bit.startswith("<") and len(bit) > 2:
                parts.append(Part("rule", bit.strip("<>")))
                i += 1
            elif _WORD.match(bit):
                parts.append(Part("word", bit))
                i += 1
            else:
                raise self._error(f"uses {bit!r}, which is not read here")

    def _check(self, rule: str, above: tuple[str, ...]) -> None:
        if rule not in self.rules:
            raise self._error(f"has no rule <{rule}>")
        if rule in above or len(above) > _DEEPEST:
            raise self._error(f"never ends in <{rule}>")
        for name in _named(self.rules[rule]):
            self._check(name, (*above, rule))

    def _error(self, what: str) -> DataError:
        return DataError(f"{self._source} {what}.")

    def words(self) -> frozenset[str]:
        """Every word of every rule."""
        return frozenset(word for part in self.rules.values() for word in _words(part))

    def members(self, rule: str) -> tuple[str, ...]:
        """Names of the rules that a rule chooses from. KeyError if unknown."""
        part = self.rules[rule]
        return tuple(one.text for one in (part.parts if part.kind == "any" else (part,)) if one.kind == "rule")

    def matches(self, rule: str, text: str) -> bool:
        """Whether a rule can say exactly this text. KeyError if unknown."""
        return self._pattern(rule).fullmatch(" ".join(text.split()) + " ") is not None

    def sample(self, rule: str, rng: np.random.Generator) -> str:
        """A sentence of a rule; every alternative is equally likely. KeyError if unknown."""
        return " ".join(self._draw(self.rules[rule], rng))

    def _draw(self, part: Part, rng: np.random.Generator) -> list[str]:
        if part.kind == "word":
            return [part.text]
        if part.kind == "rule":
            return self._draw(self.rules[part.text], rng)
        if part.kind == "any":
            return self._draw(part.parts[int(rng.integers(len(part.parts)))], rng)
        if part.kind == "may" and rng.random() < 0.5:
            return []
        return [word for one in part.parts for word in self._draw(one, rng)]

    def _pattern(self, rule: str) -> re.Pattern[str]:
        if rule not in self._patterns:
            self._patterns[rule] = re.compile(self._expression(self.rules[rule]))
        return self._patterns[rule]

    def _expression(self, part: Part) -> str:
        if part.kind == "word":
            return re.escape(part.text) + " "
        if part.kind == "rule":
            return self._expression(self.rules[part.text])
        inner = [self._expression(one) for one in part.parts]
        if part.kind == "any":
            return f"(?:{'|'.join(inner)})"
        return f"(?:{''.join(inner)})?" if part.kind == "may" else "".join(inner)


def _named(part: Part) -> list[str]:
    return [part.text] if part.kind == "rule" else [name for one in part.parts for name in _named(one)]


def _words(part: Part) -> list[str]:
    return [part.text] if part.kind == "word" else [word for one in part.parts for word in _words(one)]


def driving_grammar() -> SpeechGrammar:
    """The grammar of this package: what the offline engine can hear."""
    text = resources.files("chauffeur.speech.words").joinpath("driving.gram").read_text(encoding="utf-8")
    return SpeechGrammar(text, "driving.gram")
