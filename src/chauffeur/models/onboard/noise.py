"""Slips of fingers, tongues and speech recognizers, never ones that change what is meant.

Words that carry the meaning (numbers, units, sides, comparisons, negations, conditions) stay as they are, but for case,
for the apostrophe of a negation, and for a few misspellings that nobody reads as another word.
"""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.models.onboard.wordings import wordings

_TABLES: Final[dict[str, Any]] = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
_NUMBERS: Final = str(_TABLES["numbers"])
_PROTECTED: Final = frozenset(f"{_NUMBERS} {_TABLES['units']} {_TABLES['meant']}".split())

SAFE_SLIPS: Final[dict[str, list[str]]] = _TABLES["slips"]
"""Misspellings of protected words that nobody takes for another one."""
_SLIPS = frozenset(slip for slips in SAFE_SLIPS.values() for slip in slips)

_HEARD: Final[dict[str, list[str]]] = _TABLES["heard"]
_SHORT: Final[list[tuple[str, str]]] = _TABLES["short"]
_FULL: Final[list[tuple[str, str]]] = _TABLES["full"]
"""Contractions said in full: recognizers and careful people write so."""
_FILLERS = ("um", "uh", "er", "like", "you know", "uhm", "well", "ehm", "hmm", "let's see")
_KEYS = ("qwertyuiop", "asdfghjkl", "zxcvbnm")
_NEAR: dict[str, str] = {
    key: "".join(
        _KEYS[r][c]
        for r in (row - 1, row, row + 1)
        for c in (column - 1, column, column + 1)
        if 0 <= r < 3 and 0 <= c < len(_KEYS[r]) and _KEYS[r][c] != key
    )
    for row, keys in enumerate(_KEYS)
    for column, key in enumerate(keys)
}
_PAUSES = re.compile(
    rf"(?<!\bone)[,.!?;:]+(?=\s|$)|[,.!?;:]+(?=\s|$)(?!\s(?:\d|{_NUMBERS.replace(' ', '|')}))", re.IGNORECASE
)
"""Commas and stops, but not in "quick one, sixty": without it that is another number."""
_TOKEN = re.compile(r"^(\W*)(.*?)(\W*)$")


_REWORDED = tuple(
    (re.compile(rf"\b{find}(?<=\S)(?!\w)|\b{find}(?<=\s)", re.IGNORECASE), by.split("|"))
    for find, by in _TABLES["alike"]
)
"""Words, and others that a passenger may say for them: none changes a side, a direction, an amount or a denial."""
MOST_REWORDED = 3


def reworded(text: str, rng: np.random.Generator) -> str:
    """The sentence with up to three words, or turns of phrase, exchanged for others of the same meaning."""
    done = 0
    for place in rng.permutation(len(_REWORDED)):
        pattern, options = _REWORDED[int(place)]
        found = pattern.search(text)
        if found is None:
            continue
        others = [option for option in options if option.strip().lower() != found[0].strip().lower()]
        new = others[int(rng.integers(len(others)))]
        if found[0][0].isupper():
            new = new[0].upper() + new[1:]
        text = text[: found.start()] + new + text[found.end() :]
        done += 1
        if done == MOST_REWORDED:
            break
    return text


def said_in_full(text: str) -> str:
    """The sentence without contractions: "I'm late" becomes "I am late"; the wish is the same."""
    for pattern, by in _FULL:
        text = re.sub(pattern, by, text)
    return text


def noisy(text: str, rng: np.random.Generator, level: int) -> str:
    """The text as it may arrive.

    Args:
        text: A sentence.
        rng: Random draws.
        level: 0 leaves it as it is, 1 adds a slip or two, 2 several.
    """
    if level <= 0:
        return text
    words = text.split()
    heard = rng.random() < 0.5
    for _ in range(int(rng.integers(1, 3)) if level == 1 else int(rng.integers(2, 6))):
        draw = rng.random()
        if draw < 0.4:
            words = _misheard(words, rng) if heard else _mistyped(words, rng)
        elif draw < 0.52:
            words = _slipped(words, rng)
        elif draw < 0.7:
            words = _stammered(words, rng) if heard else _shortened(words, rng)
        elif draw < 0.85:
            words = _shortened(words, rng)
        else:
            words = _mistyped(words, rng)
    text = " ".join(words)
    # a recognizer writes neither commas nor capitals
    if rng.random() < (0.85 if heard else 0.35):
        text = _PAUSES.sub("", text)
    draw = rng.random()
    if draw < (0.85 if heard else 0.5):
        text = text.lower()
    elif draw > 0.97:
        text = text.upper()
    return re.sub(r"\s+", " ", text).strip() or text


def protected(word: str) -> bool:
    """True if a word keeps its spelling, but for the safe slips; punctuation around it does not matter."""
    core = _core(word).lower().replace("’", "'")
    if any(c.isdigit() for c in core) or "n't" in core:
        return True
    return any(part in _PROTECTED or part in _SLIPS for part in (core, *core.split("-")))


def _core(word: str) -> str:
    found = _TOKEN.match(word)
    return found[2] if found else word


@cache
def _vocabulary() -> frozenset[str]:
    """Words of the tables: a slip that makes one of them might mean something else."""
    found: set[str] = set()
    grammar = wordings()
    for section in grammar.sections():
        for template in grammar.templates(section):
            found.update(re.findall(r"[a-z']+", grammar.text(template).lower()))
    return frozenset(found) | {"last", "blow", "past", "cost", "step", "crash", "brush", "plow", "rive", "fats"}


def _open(words: list[str], least: int = 1) -> list[int]:
    return [i for i, word in enumerate(words) if len(_core(word)) >= least and not _kept(words, i)]


def _kept(words: list[str], i: int) -> bool:
    """True if the word stays as it is; the car of "car lengths" is a unit too."""
    return protected(words[i]) or (i + 1 < len(words) and _core(words[i + 1]).lower() in ("length", "lengths"))


def _one(choices: list[int], rng: np.random.Generator) -> int:
    return choices[int(rng.integers(len(choices)))]


def _mistyped(words: list[str], rng: np.random.Generator) -> list[str]:
    """One wrong key, two swapped letters, a letter too few or too many."""
    where = _open(words, 4)
    if not where:
        return words
    i = _one(where, rng)
    found = _TOKEN.match(words[i])
    assert found is not None
    before, core, after = found.groups()
    k = int(rng.integers(1, len(core)))
    kind = int(rng.integers(4))
    letter = core[k].lower()
    if not letter.isalpha() or not letter.isascii():
        return words
    if kind == 0:
        near = _NEAR[letter]
        changed = core[:k] + near[int(rng.integers(len(near)))] + core[k + 1 :]
    elif kind == 1 and k + 1 < len(core) and core[k + 1].isalpha():
        changed = core[:k] + core[k + 1] + core[k] + core[k + 2 :]
    elif kind == 2:
        changed = core[:k] + core[k + 1 :]
    else:
        changed = core[:k] + core[k] + core[k:]
    if changed.lower() in _vocabulary() or protected(changed):
        return words
    return [*words[:i], before + changed + after, *words[i + 1 :]]


def _slipped(words: list[str], rng: np.random.Generator) -> list[str]:
    """A safe misspelling of a word that is otherwise protected."""
    where = [i for i, word in enumerate(words) if _core(word).lower() in SAFE_SLIPS]
    if not where:
        return words
    i = _one(where, rng)
    core = _core(words[i])
    slips = SAFE_SLIPS[core.lower()]
    return [*words[:i], words[i].replace(core, slips[int(rng.integers(len(slips)))]), *words[i + 1 :]]


def _misheard(words: list[str], rng: np.random.Generator) -> list[str]:
    where = [i for i, word in enumerate(words) if _core(word).lower() in _HEARD and not _kept(words, i)]
    if not where:
        return _stammered(words, rng)
    i = _one(where, rng)
    core = _core(words[i])
    options = _HEARD[core.lower()]
    heard = words[i].replace(core, options[int(rng.integers(len(options)))])
    return [*words[:i], *heard.split(), *words[i + 1 :]]


def _stammered(words: list[str], rng: np.random.Generator) -> list[str]:
    """A filler, a word said twice, or a false start. None of it stands beside a number or a negation."""
    kind = int(rng.integers(3))
    if kind == 0:
        where = [i for i in range(len(words)) if not _kept(words, i) and (i == 0 or not _kept(words, i - 1))]
        if not where:
            return words
        i = _one(where, rng)
        filler = _FILLERS[int(rng.integers(len(_FILLERS)))]
        return [*words[:i], filler + ("," if i == 0 and rng.random() < 0.5 else ""), *words[i:]]
    where = _open(words, 2 if kind == 1 else 4)
    if not where:
        return words
    i = _one(where, rng)
    core = _core(words[i])
    begun = core if kind == 1 else core[: int(rng.integers(2, 4))]
    # "s-" before a number's end would be a unit, "so-" a word of its own
    return words if protected(begun) else [*words[:i], begun + ("" if kind == 1 else "-"), *words[i:]]


def _shortened(words: list[str], rng: np.random.Generator) -> list[str]:
    text = " ".join(words)
    order = rng.permutation(len(_SHORT))
    for k in order:
        pattern, by = _SHORT[int(k)]
        if re.search(pattern, text):
            return re.sub(pattern, by, text, count=1).split()
    return words
