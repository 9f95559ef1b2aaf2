"""Plain words: what people write or say, without the decoration: one case, no contractions, units in one form."""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache

_CONTRACTIONS = (
    (r"\bcan't\b|\bcannot\b|\bcant\b", "can not"),
    (r"\bwon't\b|\bwont\b", "will not"),
    (r"\bshan't\b", "shall not"),
    (r"\bain't\b|\baint\b", "is not"),
    (r"\blet's\b|\blets\b", "lets"),
    (r"\b(do|does|did|is|are|was|were|has|have|had|would|could|should|need|must|might)n't\b", r"\1 not"),
    (r"\b(do|does|did|is|are|was|would|could|should|need)nt\b", r"\1 not"),
    (r"\b(i)'?m\b", r"\1 am"),
    (r"\b(you|we|they)'re\b|\b(you)re\b", r"\1\2 are"),
    (r"\b(i|you|we|they)'ve\b", r"\1 have"),
    (r"\b(i|you|we|they|he|she|it|that)'(?:ll)\b", r"\1 will"),
    (r"\b(i|you|we|they|he|she|it)'d\b", r"\1 would"),
    (r"\b(it|that|he|she|there|what|who|where|how|here)'s\b", r"\1 is"),
    (r"\bgotta\b", "have to"),
    (r"\bgonna\b", "going to"),
    (r"\bwanna\b", "want to"),
    (r"\bgimme\b", "give me"),
    (r"\bkinda\b", "kind of"),
    (r"\bpls\b|\bplz\b", "please"),
    (r"\bokay\b", "ok"),
    (r"\b(\w+)in'(?=\s|$)", r"\1ing"),
    (r"'s\b|'", " "),
)
_GLUED_UNIT = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)(?=(?:[ms]|[a-z]{2,})(?![a-z0-9])|[a-z]+/|%)")
"""A unit is a letter only where it is that of metres or seconds: `12b` is an exit, and `5o` nothing."""
_UNIT_FORMS = (
    (r"\bm\.p\.h\b\.?", "mph"),
    (r"\bmiles\s*/\s*h(?:ou)?r?\b", "mph"),
    (r"\bm\s*/\s*s(?:ec)?\b", "m/s"),
    (r"\b(?:km|k)\s*/\s*h(?:r|our)?\b", "km/h"),
    (r"\bmet(?:er|re)s?\s*/\s*s(?:ec(?:ond)?)?\b", "m/s"),
    (r"\bkilomet(?:er|re)s?\s*/\s*h(?:our)?\b", "km/h"),
)
_TOKEN = re.compile(r"m/s|km/h|mi/h|[a-z]+\d\w*|\d+[a-z]\w*|\d+(?:\.\d+)?|[a-z]+|%|[.,;:!?]")
"""Letters and digits that touch are one word and no number: A1, 12b, l00."""

_MINUS = re.compile(r"(?<![\w.])[-−](?=\d)")
_NUMBER_COMMA = re.compile(r"(?<=\d),(?=\d{3}\b)")
_NO_NOUGHT = re.compile(r"(?<![\w.])\.(?=\d)")
_DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d{1,2}\b)")
_CONTRACT = tuple((re.compile(pattern), by) for pattern, by in _CONTRACTIONS)
_UNITS = tuple((re.compile(pattern), by) for pattern, by in _UNIT_FORMS)


_OTHER_SIGNS = re.compile(r"[^a-z0-9 .,;!?]")
_GAP = re.compile(r"\s+")


def words_of(text: str) -> str:
    """Plain words, numbers and the signs that part clauses, one space between them."""
    return _GAP.sub(" ", _OTHER_SIGNS.sub(" ", plain(text))).strip()


@lru_cache(maxsize=256)  # a dozen readers look at the same few texts of a request
def plain(text: str) -> str:
    """Lower case, straight quotes, no accents, contractions written out, hyphens and slashes opened."""
    text = unicodedata.normalize("NFKC", text).lower()
    text = text.replace("’", "'").replace("‘", "'").replace("`", "'").replace("…", " . ").replace("—", " , ")
    text = _MINUS.sub("minus ", text)
    text = "".join(c for c in unicodedata.normalize("NFD", text) if not unicodedata.combining(c))
    text = _NO_NOUGHT.sub("0.", _DECIMAL_COMMA.sub(".", _NUMBER_COMMA.sub("", text)))
    for pattern, by in (*_CONTRACT, *_UNITS):
        text = pattern.sub(by, text)
    text = split_units(text)
    return text.replace("-", " ").replace("–", " ")


def split_units(text: str) -> str:
    """The text with a space between a number and the unit that touches it; names such as A1 and 12b stay whole."""
    return _GLUED_UNIT.sub(r"\1 ", text.lower())


def tokens_of(text: str) -> list[str]:
    """Words, numerals and punctuation of a plain text."""
    return _TOKEN.findall(plain(text))
