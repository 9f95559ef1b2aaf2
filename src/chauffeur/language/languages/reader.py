"""Commands in German, Spanish, French and Chinese: the commonest acts, read by a closed table of whole sentences.

A sentence is read only if the table of its language has all of it, but for courtesies. One with a negation, a condition
or any other word is not read, and the person is told in their language that English is needed.
Calls to stop and for help are read by `language.emergency`, before anything else.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal

from chauffeur.language.word_files import word_groups

Language = Literal["german", "spanish", "french", "chinese"]
LANGUAGES: Final[tuple[Language, ...]] = ("german", "spanish", "french", "chinese")

_MOST_CHARACTERS: Final = 200
"""Longer texts are told by their language, but are no command and no call."""
_LEAST_SHARE: Final = 0.4
"""Of a text's words, known in the language that it is taken for."""
_HEADING: Final = re.compile(r"\[([^\[\]]+)\] ?(.*)")
_SPOKEN: Final = ("stop", "distress", "lead", "= v", "= cross")
"""Groups, beside those of the acts, whose words tell the language."""
_LONG: Final = 6
"""Letters of a word that is hardly a name or a slip in English."""
_LATIN: Final = re.compile(r"\b(?!kmh\b)[a-z]{2,}\b")
_WORD: Final = re.compile(r"(?<![^\W\d_])(?!(?:km|h|kmh|kph)\b)[^\W\d_]+")
_PIECE: Final = re.compile(r"[^.,!?;:。，！？；、\n]+")
_KMH: Final = re.compile(r"\bkm ?/ ?h\b|(?<=\d)km ?/ ?h\b|kmh\b|km h\b")
_DIGITS: Final = re.compile(r"(?<![\w.,])\d{1,3}(?![.,]?\d)|(?<=[^\W\d])\d{1,3}(?![.,]?\d)")
_NUMBER: Final = "#"
_HAN: Final = re.compile(r"[\u3400-\u4dbf\u4e00-\u9fff]")
_NEITHER: Final = re.compile(r"[\u3040-\u30ff\uac00-\ud7af]")
"""Kana and Hangul: Japanese and Korean have Chinese characters too."""


@dataclass(frozen=True, slots=True)
class Call:
    """A call to stop or for help.

    Attributes:
        language: Which.
        kind: As of `language.emergency`.
        words: What says so.
    """

    language: Language
    kind: Literal["stop", "ask"]
    words: str


@dataclass(frozen=True, slots=True)
class OtherWish:
    """A wish in another language than English.

    Attributes:
        language: Which.
        english: The English sentence of its act; empty where English is needed.
        words: For the person, in their language: how the wish is read, or that English is needed.
    """

    language: Language
    english: str
    words: str


class _Table:
    """A language's file, compiled: patterns of whole sentences, and the words that tell the language."""

    def __init__(self, language: Language) -> None:
        groups = word_groups("chauffeur.language.languages", f"{language}.txt")
        found = {match[1]: (match[2], group[1:]) for group in groups if (match := _HEADING.fullmatch(group[0]))}
        self.language: Final = language
        self.spaceless: Final = language == "chinese"
        self.told: Final = found["told"][1][0]
        self.english_only: Final = found["english only"][1][0]
        self.help: Final = found["help"][1][0]
        self._folds: Final = [tuple(line.split()) for line in found["fold"][1]]
        plain = {heading: [self._fold(line) for line in lines] for heading, (_, lines) in found.items()}
        parts = {one[2:]: f"(?:{lines[0]})" for one, lines in plain.items() if one.startswith("= ")}

        def any_of(heading: str) -> str:
            source = "|".join(plain[heading]) or r"(?!)"
            for name, words in parts.items():
                source = source.replace(f"{{{name}}}", words)
            return f"(?:{source})"

        gap, edge = ("", "") if self.spaceless else (" ", r"\b")
        stop, reason, distress = any_of("stop"), any_of("reason"), any_of("distress")
        self._stop: Final = re.compile(
            rf"(?:{reason}.{{0,60}}{gap})?{stop}(?:{gap}{stop}){{0,9}}(?:{gap}{reason}.*)?", re.DOTALL
        )
        self._distress: Final = re.compile(rf"{distress}(?:{gap}{distress}){{0,9}}")
        self._filler: Final = re.compile(rf"{edge}{any_of('filler')}{edge}")
        self._lead: Final = re.compile(any_of("lead") if self.spaceless else rf"^{any_of('lead')}\b")
        self._acts: Final = [
            (heading, found[heading][0], re.compile(any_of(heading))) for heading in found if heading.endswith(".")
        ]
        values = [
            (words, line.split(" ", 1)[0]) for line in plain["numbers"] for words in line.split(" ", 1)[1].split("|")
        ]
        self._numbers: Final = [
            (re.compile(rf"{edge}{words}{edge}"), value)
            for words, value in sorted(values, key=lambda one: -len(one[0]))
        ]
        self.negations: Final = frozenset(" ".join(plain["not"]).split())
        sources = [any_of(heading) for heading in found if heading in _SPOKEN or heading.endswith(".")]
        self.words: Final = frozenset(_LATIN.findall(" ".join((*plain["words"], *sources)))) | self.negations

    def _fold(self, text: str) -> str:
        for written, folded in self._folds:
            text = text.replace(written, folded)
        return text

    def plain(self, text: str) -> str:
        """The words alone, as the patterns have them; `text` is folded."""
        text = self._fold(_KMH.sub(" kmh ", text))
        return re.sub(r"[\W_]+", "" if self.spaceless else " ", text).strip()

    def _forms(self, words: str) -> tuple[str, ...]:
        """The words as they are, without courtesies, and without what makes a request of an order."""
        bare = self._bare(words)
        return words, bare, self._bare(self._lead.sub("", words)), self._bare(self._lead.sub("", bare))

    def _bare(self, words: str) -> str:
        blank = "" if self.spaceless else " "
        return " ".join(self._filler.sub(blank, words).split())

    def negated(self, words: str) -> bool:
        """True if any word denies something; "can you not" asks for it."""
        words = self._lead.sub("", words)
        return not self.negations.isdisjoint(words if self.spaceless else words.split())

    def call_in(self, text: str) -> Call | None:
        """A call to stop or for help that is a whole stretch between signs, or the whole text."""
        stretches = [self.plain(one) for one in (*_PIECE.findall(text), text) if not _is_english(one)]
        calls: tuple[tuple[Literal["stop", "ask"], re.Pattern[str]], ...] = (
            ("stop", self._stop),
            ("ask", self._distress),
        )
        for kind, pattern in calls:
            for piece in stretches:
                if any(map(pattern.fullmatch, self._forms(piece))):
                    return Call(self.language, kind, piece)
        return None

    def act_in(self, text: str) -> tuple[str, str] | None:
        """(the English sentence of the act, how it is told); None where the table has not all of the text."""
        words = self.plain(text)
        if self.negated(words) or ("?" in text and self._lead.search(words) is None):
            return None
        values: list[str] = _DIGITS.findall(words)
        words = _DIGITS.sub(_NUMBER, words)
        for pattern, value in self._numbers:
            words, count = pattern.subn(_NUMBER, words)
            values += [value] * count
        forms = self._forms(words)
        for english, told, pattern in self._acts:
            if any(map(pattern.fullmatch, forms)):
                value = values[0] if values else ""
                return english.replace(_NUMBER, value), self.told.format(told.replace(_NUMBER, value))
        return None


@lru_cache(maxsize=1)
def _tables() -> tuple[_Table, ...]:
    return tuple(_Table(language) for language in LANGUAGES)


def _table(language: Language) -> _Table:
    return _tables()[LANGUAGES.index(language)]


@lru_cache(maxsize=1)
def _english() -> frozenset[str]:
    return frozenset(" ".join(word_groups("chauffeur.language.languages", "english.txt")[0][1:]).split())


def _is_english(text: str) -> bool:
    """True if a folded text has no word that English has not."""
    return _english().issuperset(_WORD.findall(text))


def _folded(text: str) -> str:
    """Lower case without accents, one form of each sign."""
    parts = unicodedata.normalize("NFD", unicodedata.normalize("NFKC", text[:_MOST_CHARACTERS]).casefold())
    return "".join(char for char in parts if not unicodedata.combining(char))


def language_of(text: str) -> Language | None:
    """The language that a text is in, of the four; None for English and for all others.

    A denial in one of the four decides, in a sentence of mixed languages too: what is denied must not be driven.
    """
    folded = _folded(text)
    if _NEITHER.search(unicodedata.normalize("NFC", folded)) is not None:
        return None
    scores: list[tuple[int, Language]] = []
    for table in _tables():
        if table.spaceless:
            signs = _HAN.findall(folded)
            english = len(_english().intersection(_LATIN.findall(folded)))
            known, fits = len(signs), len(signs) > english
            denied = table.negated("".join(signs))
        else:
            words = set(_LATIN.findall(table.plain(folded)))
            english = len(words & _english())
            own = words & table.words - _english()
            known = len(own)
            least = english if any(len(word) >= _LONG for word in own) else english + 1
            fits = known >= max(least, _LEAST_SHARE * len(words))
            denied = any(len(word) > 2 and word not in _english() for word in words & table.negations)
        if known and (fits or denied):
            scores.append((known, table.language))
    return max(scores)[1] if scores else None


def read_call(text: str) -> Call | None:
    """A call to stop or for help in one of the four languages; None where there is none."""
    if len(text) > _MOST_CHARACTERS:
        return None
    folded = _folded(text)
    calls = [call for table in _tables() if (call := table.call_in(folded)) is not None]
    return min(calls, key=lambda call: call.kind != "stop", default=None)


def read_other(text: str) -> OtherWish | None:
    """A wish in one of the four languages; None for English and for all others."""
    folded = _folded(text)
    if len(text) <= _MOST_CHARACTERS and not _is_english(folded):
        for table in _tables():
            if act := table.act_in(folded):
                return OtherWish(table.language, *act)
    language = language_of(text)
    return None if language is None else OtherWish(language, "", _table(language).english_only)


def help_question(language: Language) -> str:
    """The question to a person in distress, in their language."""
    return _table(language).help
