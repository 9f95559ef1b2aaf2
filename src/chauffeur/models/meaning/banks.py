"""Banks of phrases: what one writer says for acts, references, conditions and all that stands around them.

A bank is a text file in `data/meaning`, one writer each, so that whole writers can be held out. Sections begin with
`== name`, lines are phrases; `data/meaning/CARD.md` tells the sections and the slots. `[a|b|]` chooses one, `*3` in
front makes a phrase three times as frequent.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import accumulate, pairwise
from pathlib import Path
from typing import Final

from chauffeur.concept import DataError
from chauffeur.concept.data import data_folder

_HEAD: Final = re.compile(r"==\s{1,3}(\S[^\n]*)")
_WEIGHT: Final = re.compile(r"\*(\d{1,3}) ")
_CHOICE: Final = re.compile(r"\[([^\[\]]*)\]")
_SLOT: Final = re.compile(r"\{([a-z_]+)\??\}")

_SLOTS_WORDS: Final = (
    "side to ref of target place at before after behind in_front_of beside near opposite on into next here "
    "manner speed gap a b x who n they"
)
SLOTS: Final = frozenset(_SLOTS_WORDS.split())
"""Names that may stand in braces."""


@dataclass(frozen=True, slots=True)
class Phrases:
    """Phrases of a section.

    Attributes:
        texts: The phrases.
        sums: Running sums of their shares; the last is 1.
    """

    texts: tuple[str, ...]
    sums: tuple[float, ...]

    @property
    def shares(self) -> list[float]:
        """Share of each in what is said."""
        return [b - a for a, b in pairwise((0.0, *self.sums))]


@dataclass(frozen=True, eq=False)
class Bank:
    """One writer's phrases by section."""

    name: str
    sections: dict[str, Phrases]

    def get(self, section: str) -> Phrases | None:
        """Phrases of a section; None where the writer has none."""
        return self.sections.get(section)

    @cache  # noqa: B019 - a bank lives as long as its program
    def under(self, prefix: str) -> list[str]:
        """Names of the sections that begin with a word, e.g. all of `act turn`."""
        return [name for name in self.sections if name == prefix or name.startswith(f"{prefix} ")]


def read_bank(path: Path) -> Bank:
    """A writer's bank.

    Raises:
        DataError: A line stands before the first section, or has a slot that is not known; names the line.
    """
    found: dict[str, list[tuple[str, float]]] = {}
    section: list[tuple[str, float]] | None = None
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        text = line.strip()
        if not text or text.startswith("#"):
            continue
        head = _HEAD.fullmatch(text)
        if head is not None:
            section = found.setdefault(" ".join(head[1].split()), [])
            continue
        if section is None:
            raise DataError(f"{path.name}, line {number}: a phrase before the first section.")
        weight = _WEIGHT.match(text)
        text = text[weight.end() :] if weight else text
        unknown = [name for name in _SLOT.findall(text) if name not in SLOTS]
        if unknown:
            raise DataError(f"{path.name}, line {number}: unknown slot {{{unknown[0]}}}.")
        section.append((text, float(weight[1]) if weight else 1.0))
    return Bank(path.stem, {name: _phrases(lines) for name, lines in found.items() if lines})


def _phrases(lines: Sequence[tuple[str, float]]) -> Phrases:
    total = sum(weight for _, weight in lines)
    return Phrases(tuple(text for text, _ in lines), tuple(accumulate(weight / total for _, weight in lines)))


def merged(banks: Sequence[Bank], name: str = "all") -> Bank:
    """One bank of several writers, each of them with the same weight in every section that they have."""
    found: dict[str, list[tuple[str, float]]] = {}
    for bank in banks:
        for section, phrases in bank.sections.items():
            # A writer with ten phrases says each of them as often as one with forty: variety counts, not authors.
            rows = zip(phrases.texts, phrases.shares, strict=True)
            found.setdefault(section, []).extend((text, share * len(phrases.texts)) for text, share in rows)
    return Bank(name, {section: _phrases(lines) for section, lines in found.items()})


def chosen(text: str, uniform: Callable[[], float]) -> str:
    """A phrase with one of each `[a|b]` chosen, innermost first, by numbers from [0, 1)."""
    while (choice := _CHOICE.search(text)) is not None:
        options = choice[1].split("|")
        text = text[: choice.start()] + options[int(uniform() * len(options))] + text[choice.end() :]
    return text


def banks(held_out: Sequence[str] = ()) -> list[Bank]:
    """The writers' banks, in the order of their names.

    Raises:
        DataError: A writer held out has no bank, or a bank is damaged.
    """
    found = [read_bank(path) for path in sorted(data_folder("meaning").glob("*.txt"))]
    if missing := set(held_out) - {bank.name for bank in found}:
        raise DataError(f"No bank of phrases is called {', '.join(sorted(missing))}.")
    return [bank for bank in found if bank.name not in held_out]
