"""Letters behind letters: what a text looks like to a reader, whatever characters it was written with."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from functools import lru_cache
from typing import Final

_IGNORABLE: Final = re.compile(
    "[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0f\uffa0\U000e0000-\U000e0fff]"
)
"""Characters that displays leave out although they are letters, marks or symbols to Unicode, and the empty Braille
pattern. Source: DerivedCoreProperties.txt, Default_Ignorable_Code_Point."""

_KEPT: Final = ("<super>", "<sub>", "<fraction>", "<noBreak>")
"""Compatibility forms that mean something else than the letters they are made of."""

_CONFUSABLE: Final = dict(
    zip("авеёкмнорстухіјѕԁһӏɡοαεικνρτυχγωϲℓłøđı", "abeekmhopctyxijsdhlgoaeikvptuxywcllodi", strict=True)
)
"""Letters of other scripts that look like Latin ones, in lower case. Used only in words that mix scripts."""

_LINE_ENDS: Final = "\n\r\v\f\x1c\x1d\x1e\x85\u2028\u2029"
"""Characters at which `str.splitlines` ends a line."""

_WORD: Final = re.compile(r"\w+")


def ignorable(char: str) -> bool:
    """True if a character is invisible, or can be: control, format, private, unassigned, or left out by displays."""
    return unicodedata.category(char)[0] == "C" or _IGNORABLE.match(char) is not None


@lru_cache(maxsize=4096)
def fold_char(char: str) -> str:
    """The plain form of a full-width, mathematical, circled or otherwise dressed character; others stay.

    What a fold would turn into nothing, or into something that must be cleaned again, stays as well.
    """
    decomposed = unicodedata.decomposition(char)
    if not decomposed.startswith("<") or decomposed.startswith(_KEPT):
        return char
    folded = unicodedata.normalize("NFKC", char)
    if folded.isspace():
        return " "
    clean = bool(folded) and not any(ignorable(one) for one in folded)
    return folded if clean and unicodedata.normalize("NFKC", folded) == folded else char


def clean(text: str) -> str:
    """A text without invisible characters and in plain letters; line ends become newlines, tabs become blanks.

    What goes: control, format, private and unassigned characters, and everything that Unicode lets a display ignore
    (zero-width, bidirectional and tag characters, variation selectors, fillers), which hides text from people that a
    model still reads. Full-width, mathematical and circled letters become the letters they stand for. Superscripts and
    fractions stay: `10²` must not become `102`. Cleaning a clean text changes nothing.
    """
    lines = text.encode("utf-8", "replace").decode("utf-8").splitlines()
    return "\n".join(map(_clean_line, lines)).strip()


def _clean_line(line: str) -> str:
    kept = "".join(" " if char == "\t" else fold_char(char) for char in line if char == "\t" or not ignorable(char))
    return unicodedata.normalize("NFC", kept).rstrip()


def dressed(char: str) -> bool:
    """True if a character stands for an ASCII letter, digit or sign, as full-width and mathematical letters do."""
    return not char.isascii() and not char.isspace() and fold_char(char).isascii()


def skeleton(text: str) -> tuple[str, list[int]]:
    """The text in lower case, bare of accents, marks and invisible characters, and where each character came from.

    Letters that look like Latin ones become Latin in words that mix scripts; words all of one script stay.
    """
    letters: list[str] = []
    places: list[int] = []
    for place, char in enumerate(text):
        for bare in _bare(char):
            letters.append(bare)
            places.append(place)
    for word in _WORD.finditer("".join(letters)):
        if mixed(word[0]):
            for index in range(*word.span()):
                letters[index] = _CONFUSABLE.get(letters[index], letters[index])
    return "".join(letters), places


def folded(pattern: str) -> str:
    """The source of a pattern with its own letters bare as well; its ASCII part stays as it is."""
    return "".join(char if char.isascii() else "".join(_bare(char)) for char in pattern)


def mixed(word: str) -> bool:
    """True if a word has Latin letters together with look-alikes of other scripts."""
    return any("a" <= char.lower() <= "z" for char in word) and any(char in _CONFUSABLE for char in word.lower())


def words_that_mix(text: str) -> Iterator[tuple[int, int]]:
    """Positions of words that mix scripts; accented and national Latin letters do not count."""
    for word in _WORD.finditer(text):
        if mixed(word[0]) and any(_foreign(char) for char in word[0]):
            yield word.span()


def _foreign(char: str) -> bool:
    return char.lower() in _CONFUSABLE and unicodedata.name(char, "").startswith(("CYRILLIC", "GREEK", "SCRIPT"))


@lru_cache(maxsize=4096)
def _bare(char: str) -> tuple[str, ...]:
    if char in _LINE_ENDS:
        return ("\n",)
    if char == "\t":
        return (" ",)
    if ignorable(char):
        return ()
    plain = unicodedata.normalize("NFKD", char.casefold())
    return tuple(one for one in plain if unicodedata.category(one) != "Mn" and not ignorable(one))
