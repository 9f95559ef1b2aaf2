"""Numbers that are not cleanly numbers: "l00 km/h", "1 00 km/h", "1.000 km/h", "30 mm/s".

A reader that skips what it does not know makes another number of each: 0, 0, 1 and 30 m. So whatever touches a number
has to be accounted for, by the number, by its unit, or as a label ("A1", "exit 12b"); else nothing is read, and the
person is asked which number they mean.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass, replace
from typing import Final

from chauffeur.language.quantities import ONES, TENS, Dimension, unit_of
from chauffeur.language.tokens import tokens_of

_NUMERAL: Final = re.compile(
    r"(?:0|[1-9]\d{0,11}|[1-9]\d{0,2}(?:,\d{3}){1,3})(?:\.\d{1,9})?"  # 50, 28.5, 1,200, 1,234.5
    r"|(?:0|[1-9]\d{0,11}),\d{1,2}"  # 1,5 as most of Europe writes it
    r"|\.\d+",
    re.ASCII,
)
_THOUSANDS: Final = re.compile(r"([1-9]\d{0,2})\.(\d{3})", re.ASCII)
"""A thousand with a full stop, or three decimals: 1.000 m is either."""
_LABEL: Final = re.compile(r"[a-z]{1,3}\d{1,4}[a-z]?|\d{1,4}[a-z]", re.ASCII)
"""Names of roads, exits and spots: A1, M25, 12b."""
_ORDINAL: Final = re.compile(r"\d{1,6}(?:st|nd|rd|th|x)", re.ASCII)
_LIKE_DIGITS: Final = str.maketrans("oli|sbz", "0111582")
_LIKE_DIGITS_END: Final = re.compile(r"\d[oli|sbz]*$")
_TYPED_FOR_DIGITS: Final = re.compile(r"(?=[\d.,]{0,12}[oli|])[\d.,oli|]{1,24}")
"""Digits with letters that are typed for them, and no others: a bare `5o` is no name of an exit."""
_ONLY_LETTERS_FOR_DIGITS: Final = re.compile(r"[oli|sbz]{2,}")
_NUMBER_AND_REST: Final = re.compile(rf"(?P<number>{_NUMERAL.pattern})(?P<rest>[a-z].{{0,40}})", re.ASCII)
_UNIT_LETTERS: Final = re.compile(r"[kmphftydcnsg]{2,6}")
"""What has no vowel and only letters of units is one that was mistyped: `mhp`, `kmg`."""
_LONGEST_UNIT: Final = 20
_MUCH: Final = frozenset(("thousand", "million"))
_NOUGHTS: Final = ("oh", "o")
"""Words for a nought between digits."""
_SPEEDS: Final = ("m/s", "km/h", "mph")
_NOUNS: Final[dict[Dimension, str]] = {"speed": "speed", "distance": "distance", "time": "time"}
_PLAUSIBLE: Final[dict[Dimension, tuple[float, float]]] = {
    "speed": (3.0, 70.0),
    "distance": (2.0, 1000.0),
    "time": (0.5, 60.0),
}
"""What a passenger may well mean, m/s, m and s: only that is proposed."""
_AROUND: Final = "()[]{}<>~\"'“”‘’#$€£+=≤≥*"
_ENDS: Final = ".,;:!?"


@dataclass(frozen=True, slots=True)
class Slip:
    """A number that cannot be read for certain.

    Attributes:
        said: The words, as they stand in the text.
        meant: The one plausible reading, e.g. `100 km/h`; empty where there is none or more than one.
        dimension: What it measures, as far as its unit tells.
        corrected: The whole text with `meant` in its place; empty without.
    """

    said: str
    meant: str
    dimension: Dimension
    corrected: str = ""

    @property
    def question(self) -> str:
        """The question for the person."""
        if self.meant:
            return f"Did you mean {self.meant}?"
        return f"Which {_NOUNS.get(self.dimension, 'number')} do you mean?"


@dataclass(frozen=True, slots=True)
class _Chunk:
    """Text between two spaces, without brackets and the sign that ends a clause."""

    text: str
    start: int
    end: int
    ends: bool


@dataclass(frozen=True, slots=True)
class _Unit:
    words: str
    dimension: Dimension
    factor: float
    chunks: int


def slip_in(text: str) -> Slip | None:
    """The first number of a text that is not cleanly one; None where all are."""
    normal = unicodedata.normalize("NFKC", text)
    lower = normal.lower()
    if len(lower) != len(normal):
        normal = lower
    chunks = _chunks(lower)
    for index in range(len(chunks)):
        found = _slip_at(chunks, index)
        if found is None:
            continue
        start, end, readings, dimension, unit = found
        said = normal[start:end]
        plausible = {value: None for value, factor in readings if _may_be(value * factor, dimension)}
        meant = f"{next(iter(plausible)):g} {unit}" if len(plausible) == 1 and unit else ""
        return Slip(said, meant, dimension, normal[:start] + meant + normal[end:] if meant else "")
    return None


_Found = tuple[int, int, list[tuple[float, float]], Dimension, str]
"""Where it begins and ends, its readings as (number, factor to SI), what it measures, and the unit of all readings."""


def _slip_at(chunks: list[_Chunk], index: int) -> _Found | None:
    chunk = chunks[index]
    number, unit = _apart(chunks, index)
    words = number.text
    if words == "hundred" and not chunk.ends and index + 1 < len(chunks) and _is_number(chunks[index + 1].text):
        return _found(chunks, index, 2, _apart(chunks, index + 1)[1], [])
    if words in ONES or words in TENS:
        return _spelled_apart(chunks, index)
    mistyped = _NUMBER_AND_REST.fullmatch(chunk.text)
    if mistyped and _like_unit(mistyped["rest"]) and not (unit and _LIKE_DIGITS_END.search(words)):
        return _mistyped(chunk.start, chunk.end, float(_plain(mistyped["number"])), mistyped["rest"])
    if not any(c.isdigit() for c in words):
        like = _ONLY_LETTERS_FOR_DIGITS.fullmatch(words) is not None and unit is not None
        return _found(chunks, index, 1, unit, [words]) if like and unit and unit.dimension == "speed" else None
    if _NUMERAL.fullmatch(words) and not _THOUSANDS.fullmatch(words):
        return _after_number(chunks, index, unit)
    if unit is not None or _THOUSANDS.fullmatch(words):
        return _found(chunks, index, 1, unit, _ways(words))
    if _leads_zero(words) or _TYPED_FOR_DIGITS.fullmatch(chunk.text.replace("/", "")) or not words.isascii():
        named = _LABEL.fullmatch(chunk.text) is not None and not _odd_label(chunk.text)
        return None if named else _found(chunks, index, 1, None, _ways(words))
    if chunk.ends or not words[0].isdigit() or index + 1 >= len(chunks):
        return None
    following, its_unit = _apart(chunks, index + 1)
    return _found(chunks, index, 2, its_unit, []) if its_unit and _is_number(following.text) else None


def _apart(chunks: list[_Chunk], index: int) -> tuple[_Chunk, _Unit | None]:
    """A chunk as its number and the unit that is glued to it or follows."""
    chunk = chunks[index]
    first = next((at for at, sign in enumerate(chunk.text) if sign.isdigit()), len(chunk.text))
    for at in range(max(first + 1, len(chunk.text) - _LONGEST_UNIT), len(chunk.text)):
        of_letters = chunk.text[at - 1].isalpha() and not _LIKE_DIGITS_END.search(chunk.text[:at])
        if of_letters and len(chunk.text) - at == 1:
            continue  # 5pm
        if chunk.text[at].isalpha() and (unit := _known(chunk.text[at:])) is not None:
            return _Chunk(chunk.text[:at], chunk.start, chunk.end, chunk.ends), _Unit(chunk.text[at:], *unit, 0)
    return chunk, None if chunk.ends else _unit_at(chunks, index + 1)


def _next(chunks: list[_Chunk], index: int) -> tuple[str, ...]:
    return tuple(each.text for each in chunks[index : index + 1])


def _unit_at(chunks: list[_Chunk], index: int) -> _Unit | None:
    for count in (3, 2, 1):
        part = chunks[index : index + count]
        if len(part) == count and not any(each.ends for each in part[:-1]):
            words = " ".join(each.text for each in part)
            if (unit := _known(words)) is not None:
                return _Unit(words, *unit, count)
    return None


def _known(words: str) -> tuple[Dimension, float] | None:
    """Dimension and factor of a unit that is these words and no more."""
    tokens = tokens_of(words.replace(".", "") if re.fullmatch(r"(?:[a-z]\.)+[a-z]", words) else words)
    found = unit_of(tokens, 0)
    if found is None or found[2] != len(tokens) or found[0] not in _NOUNS or words == "second":
        return None  # "take the A1 second exit": as a unit it is read, as proof of a number it is not
    return None if "/" in words and len(tokens) > 1 else found[:2]


def _after_number(chunks: list[_Chunk], index: int, unit: _Unit | None) -> _Found | None:
    """A clean numeral: whether what follows it is another part of a number, or a unit that is none."""
    chunk = chunks[index]
    if unit is not None and unit.chunks == 0:
        return None
    if chunk.ends:
        return _broken_at_sign(chunks, index)
    if index + 1 >= len(chunks):
        return None
    following, its_unit = _apart(chunks, index + 1)
    if unit is None and (_is_number(following.text) or _leads_zero(following.text)):
        joined = chunk.text + following.text if following.text.isdigit() and chunk.text.isdigit() else ""
        return _found(chunks, index, 2, its_unit, [joined] if joined else [])
    if unit is None and (following.text in _MUCH or following.text == "hundred"):
        ways = [f"{chunk.text}00"] if following.text == "hundred" and chunk.text.isdigit() else []
        return _found(chunks, index, 2, _unit_at(chunks, index + 2), ways)
    if unit is None and following.text != "one" and (following.text in ONES or following.text in TENS):
        return _found(chunks, index, 2, its_unit, [chunk.text + _digits_of(following.text)])
    if following.text == "k" and (_unit_at(chunks, index + 2) or any(map(_like_unit, _next(chunks, index + 2)))):
        return chunk.start, chunks[index + 2].end, [], "speed", ""
    if unit is None and _like_unit(following.text):
        return _mistyped(chunk.start, chunks[index + 1].end, float(_plain(chunk.text)), following.text)
    return _per_other(chunks, index, unit)


def _per_other(chunks: list[_Chunk], index: int, unit: _Unit | None) -> _Found | None:
    """A distance per a time that makes no speed we know: metres per minute."""
    after = index + 1 + (0 if unit is None else unit.chunks)
    if unit is None or unit.dimension != "distance" or after + 1 >= len(chunks) or chunks[after].text != "per":
        return None
    return chunks[index].start, chunks[after + 1].end, [], "speed", ""


def _broken_at_sign(chunks: list[_Chunk], index: int) -> _Found | None:
    """`1. 000 km/h`, `1, 00 km/h`: no number begins with a nought that has another digit behind it."""
    if index + 1 >= len(chunks) or not _leads_zero(_apart(chunks, index + 1)[0].text):
        return None
    following, unit = _apart(chunks, index + 1)
    return _found(chunks, index, 2, unit, [chunks[index].text + following.text])


def _spelled_apart(chunks: list[_Chunk], index: int) -> _Found | None:
    """Digits that are spelled one by one, and numerals behind number words: `one zero zero`, `twenty 5 km/h`."""
    count, digits, following = 1, _digits_of(chunks[index].text), ""
    while index + count < len(chunks) and not chunks[index + count - 1].ends:
        number, unit = _apart(chunks, index + count)
        following = number.text
        if not (_is_number(following) or following in ONES or following in TENS or following in _NOUGHTS):
            break
        within = chunks[index + count - 1].text in TENS and following in "123456789"
        digits = (digits[:-1] if within else digits) + _digits_of(following)
        count, following = count + 1, ""
        if unit is not None:
            break
    words = [each.text for each in chunks[index : index + count]]
    if following in _MUCH or (following == "hundred" and words[-1] not in ONES[1:10]):
        return _found(chunks, index, count + 1, _unit_at(chunks, index + count + 1), [])
    if count == 1 or following == "hundred" or _one_number(words) or words[1:] == ["o"]:
        return None
    _, unit = _apart(chunks, index + count - 1)
    if words[0] == "one" and (unit is None or unit.dimension != "speed") and not words[1].isalpha():
        return None  # "follow this one 30 m behind"
    return _found(chunks, index, count, unit, [digits] if digits.isdigit() else [])


def _one_number(words: list[str]) -> bool:
    """True if number words are one number: twenty-five, one twenty, one twenty-five."""
    ones, tens = ONES[1:10], TENS
    match words:
        case [first, second]:
            return (first in tens and second in ones) or (first == "one" and (second in tens or second in ONES[10:]))
        case ["one", second, third]:
            return second in tens and third in ones
        case _:
            return False


def _digits_of(word: str) -> str:
    if word in _NOUGHTS:
        return "0"
    if word in ONES:
        return str(ONES.index(word))
    return str(20 + 10 * TENS.index(word)) if word in TENS else word


def _found(chunks: list[_Chunk], index: int, count: int, unit: _Unit | None, ways: list[str]) -> _Found:
    last = chunks[index + count - 1 + (0 if unit is None else unit.chunks)]
    readings = [float(_plain(way)) for way in map(_digits_typed, ways) if _NUMERAL.fullmatch(way)]
    if unit is None:
        return chunks[index].start, last.end, [], "bare", ""
    return chunks[index].start, last.end, [(value, unit.factor) for value in readings], unit.dimension, unit.words


def _mistyped(start: int, end: int, value: float, words: str) -> _Found:
    """A number with a unit that is none: those that are one slip away, and only of a speed may it be told which."""
    near = [unit for unit in _SPEEDS if _one_slip(words, unit)]
    dimension: Dimension = "speed" if near or "/" in words else "bare"
    factor = (_known(near[0]) or ("speed", 1.0))[1] if len(near) == 1 else 0.0
    return start, end, [(value, factor)] if factor else [], dimension, near[0] if len(near) == 1 else ""


def _one_slip(words: str, unit: str) -> bool:
    """True if one letter too many, too few or wrong, or two exchanged, make the one of the other."""
    shorter, longer = sorted((words, unit), key=len)
    places = range(len(longer))
    if len(longer) == len(shorter) + 1:
        return any(longer[:at] + longer[at + 1 :] == shorter for at in places)
    odd = [at for at in places if len(longer) == len(shorter) and longer[at] != shorter[at]]
    return len(odd) == 1 or (
        len(odd) == 2 and odd[1] == odd[0] + 1 and longer[odd[0]] + longer[odd[1]] == shorter[odd[1]] + shorter[odd[0]]
    )


def _like_unit(words: str) -> bool:
    """True if words behind a number can only be a unit, and are none we know."""
    if _known(words) is not None:
        return False
    parts = re.split(r"[/\\|.]", words)
    if len(parts) > 1 and all(parts):
        return any(part == "h" or unit_of([part], 0) is not None for part in parts)
    return _UNIT_LETTERS.fullmatch(words) is not None and unit_of([words], 0) is None


def _ways(words: str) -> list[str]:
    """Readings of digits with something else among them."""
    thousands = _THOUSANDS.fullmatch(words)
    return [thousands[1] + thousands[2], thousands[1]] if thousands else [words]


def _digits_typed(words: str) -> str:
    return words.translate(_LIKE_DIGITS)


def _odd_label(words: str) -> bool:
    """True if what may be a label is rather a mistyped number: no exit is called 5o, and no road l00."""
    return _TYPED_FOR_DIGITS.fullmatch(words) is not None and (words[0].isdigit() or words[1:2] == "0")


def _is_number(words: str) -> bool:
    return _NUMERAL.fullmatch(words) is not None or _THOUSANDS.fullmatch(words) is not None


def _leads_zero(words: str) -> bool:
    return re.fullmatch(r"0\d+", words) is not None


def _plain(number: str) -> str:
    number = re.sub(r",(?=\d{3}(?:\D|$))", "", number)
    return number.replace(",", ".")


def _may_be(value: float, dimension: Dimension) -> bool:
    low, high = _PLAUSIBLE.get(dimension, (1.0, 0.0))
    return low <= value <= high


def _chunks(text: str) -> list[_Chunk]:
    chunks: list[_Chunk] = []
    for found in re.finditer(r"[^\s–—-]+|(?<=\s)[–—-]+(?=\s)", text):
        begin = len(found[0]) - len(found[0].lstrip(_AROUND))
        bare = found[0][begin:].rstrip(_AROUND)
        whole = bare.removesuffix("'s").removesuffix("’s").rstrip(_ENDS)
        if whole.strip("–—-"):
            start = found.start() + begin
            chunks.append(_Chunk(whole, start, start + len(whole), ends=bare[-1:] in _ENDS))
        elif chunks:  # a sign, or a dash between spaces, ends what stands before it
            chunks[-1] = replace(chunks[-1], ends=True)
    return chunks
