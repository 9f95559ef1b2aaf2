"""Numbers as people and models set them: typographic signs, other scripts' digits, decimal commas."""

from __future__ import annotations

import re
import unicodedata
from typing import Final

NUMBER: Final = re.compile(
    r"(?<![\w.+-])[-+]?(?:\d{1,40}\.?\d{0,60}|\.\d{1,60})(?:[eE][-+]?\d{1,3})?(?![\w.]{0,40}\d|_)"
)
"""One number of a text that `plain_signs` has passed; not the digits of a name such as `x1`."""
_SIGNS: Final = str.maketrans(
    {
        **dict.fromkeys("\u2010\u2011\u2012\u2013\u2014\u2015\u2212\u02d7\u2043\ufe58\ufe63\uff0d\u2796", "-"),
        **dict.fromkeys("\u201c\u201d\u201e\u201f\u00ab\u00bb\uff02", '"'),
        **dict.fromkeys("\u2018\u2019\u201a\u201b\uff07", "'"),
        **dict.fromkeys("\u060c\u3001\ufe50\uff64", ","),
        **dict.fromkeys("\u200b\u200c\u200d\u2060\ufeff\u00ad\u200e\u200f", ""),
        "\u066b": ".",
        "\u066c": "",
        "\u3010": "[",
        "\u3011": "]",
        "\u27e8": "(",
        "\u27e9": ")",
        **dict.fromkeys("¼½¾⅓⅔⅕⅛⁄²³¹⁰⁴⁵⁶⁷⁸⁹", "_"),  # `10²` is not 102, and `2½` not 21/2
    }
)
_SUPER: Final = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻", "0123456789+-")
_POWER: Final = re.compile(
    r"\s?[×x·*⋅]\s?10(?:\^\{?\s?|\*\*\s?)?([⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]{1,3}|(?<=[\^{* ])[-+\u2212\u2013]?\d{1,3})\}?"
)
_DIGIT: Final = re.compile(r"[^\W\x00-\x7fa-zA-Z]")
_GROUPED: Final = re.compile(r"(?<=\d)[\u00a0\u2007\u2009\u202f](?=\d{3}(?!\d))")
_IN_WORDS: Final = re.compile(r"\b(?:minus|negative)\s{1,3}(?=[\d.])", re.IGNORECASE)
_AWAY: Final = re.compile(r"(?<![\w)\]%])([-+]) {1,2}(?=[\d.])")
"""A sign set apart from its number."""
_DECIMAL_COMMA: Final = re.compile(r"(?<=\d),(?=\d)")
_THOUSANDS: Final = re.compile(r"(?<![\d.,])(\d{1,3}),(\d{3})(?=\.\d)")


def plain_signs(text: str) -> str:
    """A text with its dashes, quotes, brackets, digits and powers of ten in ASCII, whatever they were set in.

    `(２．５，－0.1)`, `–0.1`, `- 0.1`, `٢٫٥`, `1 000` and `2.5 × 10⁻¹` become what `float` reads.
    """
    text = _POWER.sub(lambda found: f"e{found[1].translate(_SUPER).translate(_SIGNS)}", text)
    text = unicodedata.normalize("NFKC", _GROUPED.sub("", text).translate(_SIGNS)).translate(_SIGNS)
    text = _DIGIT.sub(lambda found: str(unicodedata.decimal(found[0], found[0])), text)
    return _AWAY.sub(r"\1", _IN_WORDS.sub("-", text))


def numbers_in(text: str) -> list[float]:
    """The numbers of a short piece of text that `plain_signs` has passed, separated by anything but an operation.

    A comma is decimal where something else separates: `2,5; 0,1` and `2,5, 0,1` are two numbers, `2,5` are two as well.
    """
    text = _THOUSANDS.sub(r"\1\2", text)
    if "." not in text and len(_DECIMAL_COMMA.findall(text)) > 1 and re.search(r"[;|]|,\s|\d\s{1,4}[-+]?\d", text):
        text = _DECIMAL_COMMA.sub(".", text)
    return [float(found) for found in NUMBER.findall(text)]
