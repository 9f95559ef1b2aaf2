"""When not to guess: empty, foreign, off-topic and unsupported wishes, and questions; each told in words that help."""

from __future__ import annotations

import re
import unicodedata

from chauffeur.language.tokens import plain
from chauffeur.planners.onboard.clauses import Clause
from chauffeur.planners.onboard.lexicon import rewrite
from chauffeur.planners.onboard.meaning import Meaning, NotUnderstood
from chauffeur.planners.onboard.words import words_file
from chauffeur.safety.dangers import danger

CAN_DO = (
    "I can drive faster or slower or at a speed you name, follow closer or further back, change lanes, overtake, turn "
    "or go straight at a junction, pull over, and drive in a hurry, relaxed, gently, carefully or economically."
)

ENGLISH_ONLY = f"I understand English only. {CAN_DO}"


def _groups(name: str) -> list[tuple[str, list[str]]]:
    """Groups of a vocabulary file with their headings."""
    return [(group[0].strip("[]"), group[1:]) for group in words_file(name)]


_DOUBTS = [(heading, re.compile("|".join(lines))) for heading, lines in _groups("doubts.txt")]
_BY_NAME = dict(_DOUBTS)
_UNSUPPORTED = [
    (pattern, heading.removeprefix("unsupported "))
    for heading, pattern in _DOUBTS
    if heading.startswith("unsupported ")
]
_OFF_TOPIC, _DRIVING = _BY_NAME["off_topic"], _BY_NAME["driving"]
_QUESTION, _REQUEST = _BY_NAME["question"], _BY_NAME["request"]
_EITHER = re.compile(
    r"\b(left|right|faster|slower|speed up|slow down|closer|further) or (?:to )?(?:the )?"
    r"(left|right|faster|slower|speed up|slow down|closer|further)\b(?! away| back)"
)
_FOREIGN_SHARE = 0.3
_COURTESIES = re.compile(
    r"\b(?:por favor|per favore|s il (?:vous|te) plait|bitte(?: schon)?|danke(?: schon)?|gracias|grazie|merci|prego|"
    r"lutfen|prosze|amigo|monsieur|madame|senor|senora|signore|mein freund|mon ami)\b"
)
"""Said in English sentences too."""
_FOREIGN_WORDS = {name: frozenset(" ".join(lines).split()) for name, lines in _groups("foreign.txt")}


def doubt_before(text: str, max_chars: int) -> NotUnderstood | None:
    """Doubts that arise before any meaning is sought."""
    if not text.strip():
        return NotUnderstood("empty", f"I did not hear a wish. {CAN_DO}")
    if len(text) > max_chars:
        return NotUnderstood("too_long", "That was too long for me. Please tell me in a sentence what you want.")
    letters = [c for c in text if c.isalpha()]
    if not letters and not any(c.isdigit() for c in text):
        return NotUnderstood("symbols", f"I understand words only. {CAN_DO}")
    if foreign(text):
        return NotUnderstood("language", ENGLISH_ONLY)
    reason = danger(text)
    if reason:
        return NotUnderstood("unsupported", f"{reason} {CAN_DO}")
    words = plain(text)
    line = rewrite(re.sub(r"\s+", " ", re.sub(r"[^a-z/#0-9 .,;!?]", " ", words)))
    for pattern, why in _UNSUPPORTED:
        if pattern.search(words) or pattern.search(line):
            return NotUnderstood("unsupported", f"{why} {CAN_DO}")
    either = _EITHER.search(words)
    if either is not None:
        return NotUnderstood("ambiguous", f"{either[1].capitalize()} or {either[2]}: which one do you want?")
    if _OFF_TOPIC.search(words) and not _DRIVING.search(words):
        return NotUnderstood("off_topic", f"I only drive. {CAN_DO}")
    return None


def doubt_without_meaning(text: str, clauses: list[Clause]) -> NotUnderstood:
    """Words for a wish in which no manoeuvre was found."""
    if _QUESTION.match(plain(text)):
        return NotUnderstood("question", f"I take wishes, and cannot answer questions. {CAN_DO}")
    kinds = {e.cue.kind for clause in clauses for e in clause.evidence}
    if "verb" in kinds and "noun" not in kinds:
        return NotUnderstood("ambiguous", "More or less of what: speed, or the distance to the vehicle ahead?")
    if "noun" in kinds:
        return NotUnderstood("ambiguous", "What shall I do with it: more, less, or a number you name?")
    if any(clause.quantities for clause in clauses):
        return NotUnderstood("ambiguous", "A number of what: speed, or the distance to the vehicle ahead?")
    return NotUnderstood("unknown", f"I did not understand what you want me to drive. {CAN_DO}")


def is_question(text: str, found: list[Meaning]) -> bool:
    """Whether the wish asks about the drive instead of asking for something."""
    words = plain(text).strip()
    if not _QUESTION.match(words) or _REQUEST.search(words):
        return False
    # "What are you doing? Slow down!": a plain wish in a sentence of its own answers the question
    tail = re.split(r"[?!.,]", words, maxsplit=1)
    return len(tail) < 2 or not tail[1].strip() or len(found) < 2


def foreign(text: str) -> bool:
    """Whether a text is in another language than English, but for a word or two."""
    letters = [c for c in text if c.isalpha()]
    if not letters:
        return False
    latin = sum(1 for c in letters if "LATIN" in unicodedata.name(c, ""))
    if latin < 0.7 * len(letters):
        return True
    words = re.findall(r"[a-z]+", _COURTESIES.sub(" ", plain(text)))
    strong = any(w in _FOREIGN_WORDS["driving"] for w in words)
    known = sum(1 for w in words if any(w in each for each in _FOREIGN_WORDS.values()))
    return (strong or known > 1) and known >= _FOREIGN_SHARE * len(words)
