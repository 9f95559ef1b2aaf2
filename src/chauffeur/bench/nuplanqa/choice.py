"""Reads which option an answer in free words chooses, or why it chooses none.

Read in this order, the first that decides stands: an object's field (`{"answer": "b"}`, counted from 1 where it is a
number), a ticked letter, a verdict on each option, a correction ("a... wait, b"), a stated answer ("the answer is
(b)"), a conclusion ("so d"), a letter in front, the only letter in brackets, the text of exactly one option, an ordinal
("the second one"), what is left when three are ruled out. What names two options, refuses, or says "none" chooses
nothing, and how it failed is counted. Reasoning, and turns that the model made up, are left out before.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal, cast

from chauffeur.bench.nuplanqa.questions import LETTERS
from chauffeur.foreign.fields import objects_in
from chauffeur.foreign.model_text import read_model_text

EXTRACTION: Final = "choice-v3"

How = Literal["letter", "text", "ordinal", "none", "refused", "several", "unclear", "empty"]


@dataclass(frozen=True, slots=True)
class OptionChoice:
    """Option chosen by an answer.

    Attributes:
        index: Of the option; None where none was chosen.
        how: What decided, or why nothing did.
    """

    index: int | None
    how: How


_L: Final = r"[\(\[\{<\"'`*_]{0,6}([a-dA-D])[\)\]\}>\"'`*_]{0,6}"
_END: Final = r"(?![\w'’])"
_STATED: Final = re.compile(
    rf"(?:\b(?:answer|choice|option|selection|pick|select|choose|go(?:ing)? with|go for|correct one)\b)"
    rf"(?:\s{{1,3}}(?:is|are|was|would be|should be|must be|has to be|here|number|letter|option|choice|answer|"
    rf"therefore|thus|then|clearly|definitely|most likely|likely|probably|to|for|the|my|final|correct|right|"
    rf"best|remains|be)\b){{0,6}}"
    rf"[\"']?\s{{0,3}}[:=\-–—>]{{0,6}}\s{{0,3}}(?:option|choice|letter|answer)?\s{{0,3}}{_L}{_END}"
    rf"(?!\s{{1,3}}(?:car|truck|bus|pedestrian|vehicle|red|"
    rf"green|yellow|clear|cloudy|dry|wet|busy|single|two|three|four|few|lot|group|cyclist|good|more|little)\b)",
    re.IGNORECASE,
)
_BOXED: Final = re.compile(r"\\boxed\{\s{0,3}(?:\\text\{)?\s{0,3}\(?([a-dA-D])\)?\s{0,3}\}?\s{0,3}\}")
_TAGGED: Final = re.compile(rf"<(?:answer|ans|choice)>\s{{0,3}}{_L}", re.IGNORECASE)
_FRONT: Final = re.compile(
    r"^[\s\(\[\{\"'`*_#>]{0,6}([a-dA-D])(?:[\s\"'`*_]{0,6}[\)\]\}:.,;!\-–—=|]{1,6}|[\"'`*_]{1,6}|\s{0,3}\n)",
    re.MULTILINE,
)
_ALONE: Final = re.compile(r"^[\W_]{0,12}([a-dA-D])[\W_]{0,12}$")
_BRACKETED: Final = re.compile(r"[\(\[]\s{0,3}([a-dA-D])\s{0,3}[\)\]]|(?<![\w(])([a-dA-D])\)")
_BARE: Final = re.compile(
    r"(?<![\w'’])([b-dB-D]|A(?!\s{1,3}(?!(?:or|and)\b)[a-z])|a(?=\s{1,3}(?:or|and)\s{1,3}[b-d]\b))(?![\w'’])"
)
"""A letter by itself; an A before a word, and a small one, is the article."""
_TICKED: Final = re.compile(
    rf"\[[xX✓✔]\]\s{{0,3}}{_L}{_END}|\|\s{{0,3}}{_L}\s{{0,3}}\|\s{{0,3}}(?:yes|correct|right|true|✓|✔)", re.IGNORECASE
)
_CONCLUDED: Final = re.compile(
    rf"\b(?:so|therefore|thus|hence|leaves|leaving|maybe|perhaps|probably|guess)\b[\s,:]{{1,3}}"
    rf"(?:it(?:'s|’s| is)\s{{1,3}}|is\s{{1,3}})?{_L}\s{{0,3}}(?:[.!?;,]|$)"
    rf"|\bonly\s{{1,3}}{_L}\s{{1,3}}(?:remains|is left)\b|(?<![\w-])correct\s{{0,3}}:\s{{0,3}}{_L}{_END}",
    re.IGNORECASE | re.MULTILINE,
)
_LIST: Final = rf"{_L}(?:\s{{0,3}},\s{{0,3}}{_L})?\s{{0,3}},?\s{{0,3}}(?:and|or|nor)\s{{1,3}}{_L}{_END}"
_LISTED_OUT: Final = re.compile(
    rf"(?:options?\s{{1,3}})?{_LIST}\s{{1,3}}(?:(?:do|are) not\b|don't\b|aren't\b|(?:can be|are|could be)\s{{1,3}}"
    rf"(?:all\s{{1,3}})?(?:excluded|ruled out|eliminated|wrong|incorrect|false))"
    rf"|\b(?:(?:cannot|can't|can’t)\s{{1,3}}be|not(?:\s{{1,3}}be)?(?:\s{{1,3}}either)?)\s{{1,3}}{_LIST}",
    re.IGNORECASE,
)
"""Several letters that are ruled out in one breath."""
_CAPITAL_OUT: Final = re.compile(
    r"(?<![\w'’])([A-D])\s{1,3}(?:is|seems)\s{1,3}(?:clearly )?(?:wrong|incorrect|false|ruled out)"
)
_MARKUP: Final = re.compile(r"<(b|i|u|p|em|strong)>([^<]{0,400})</\1>", re.IGNORECASE)
_WRONG: Final = r"\s{1,3}(?:is|would be|seems)\s{1,3}(?:clearly\s{1,3})?(?:wrong|incorrect|false|not)\b"
_NEGATED: Final = re.compile(
    rf"(?:\b(?:not|isn't|isn’t|never|neither|nor|rule out|ruled out|exclude|excluding|except|rather than|instead of|"
    rf"unlike)\b\s{{1,3}}(?:the\s{{1,3}})?(?:option|choice|answer)?\s{{0,3}}(?:is\s{{1,3}})?{_L}{_END})"
    rf"|(?:(?:option|choice)?\s{{0,3}}[\(\[\"'*]{{0,6}}([a-dA-D])[\)\]\"'*]{{1,6}}\s{{0,3}}"
    rf"(?:is|are|was|seems|looks|cannot be|can't be)\s{{0,3}}"
    rf"(?:clearly |definitely |obviously )?(?:not\b(?: (?:right|correct|visible|true))?|wrong|incorrect|false|"
    rf"ruled out|impossible|unlikely|out\b|be right|be correct))",
    re.IGNORECASE,
)
_REFUSED: Final = re.compile(
    r"\b(?:i(?:'m| am)? (?:sorry|unable|afraid)|(?:i )?(?:cannot|can't|can’t|could not|couldn't|am not able to|"
    r"won't) (?:determine|answer|see|view|tell|say|help|assist|identify|process|access|provide|be determined)|"
    r"as an ai|not possible to (?:determine|tell|answer)|unable to|no images? (?:was|were|is|are)|i decline|"
    r"not enough information|insufficient information|i (?:do not|don't|don’t) know|no idea|not sure|hard to say)",
    re.IGNORECASE,
)
_NONE: Final = re.compile(
    r"^\W{0,6}(?:none|neither|nothing|no (?:option|answer|choice)|n/?a)\b|\bnone of (?:the|these|them|those)\b|"
    r"\bno (?:correct|right|valid|suitable) (?:option|answer|choice)\b|"
    r"\bnone (?:is|are|fits|fit|applies|apply)\b|\bnot (?:any|one) of (?:the|these|them)\b",
    re.IGNORECASE,
)
_ALL: Final = re.compile(
    r"\b(?:all of (?:the above|them|these)|(?:both|all) (?:options|answers|are)|any of them)\b", re.IGNORECASE
)
_LISTED: Final = re.compile(r"\[\s{0,3}[\"']([a-dA-D])[\"']\s{0,3}\]")
_FIELDS: Final = re.compile(
    r"(?:final|correct|selected|chosen|best|my|predicted)?[ _-]?"
    r"(?:answer|choice|option|letter|selection|prediction|label)(?:[ _-]?(?:letter|key|id|choice|option))?"
    r"|selected|chosen|correct|final|result|response",
    re.IGNORECASE,
)
"""Fields of an object in which an answer stands."""
_RIGHT: Final = r"yes|true|correct|right|holds|[✓✔✅☑]"
_FALSE: Final = r"no|not true|not correct|false|incorrect|wrong|[✗✘❌☒✖]"
_VERDICT: Final = re.compile(
    r"(?:^|[\s,;])(?:(?:option|choice|answer)\s{1,3})?[\(\[*_]{0,4}([a-dA-D1-4])(?:[\)\].:,?*_=–—-]|\s){1,6}"
    rf"(?:[^\n.;:]{{0,120}}?[\s:?–—=-]{{1,4}})??(?:is\s{{1,3}})?[\(\[*_]{{0,4}}(?:({_RIGHT})|({_FALSE}))(?![\w'’])"
    r"(?!\s{1,3}(?:one|of|lane|car|light|pedestrian|cyclist|vehicle|traffic|rain|turn)\b)",
    re.IGNORECASE | re.MULTILINE,
)
"""A letter or number with what is said of it."""
_SIGNED: Final = re.compile(r"(?:([✓✔✅☑])|([✗✘❌☒✖]))\s{0,3}[\(\[*_]{0,4}([a-dA-D])(?![\w'’])")
"""A letter behind its sign."""
_DENIED: Final = re.compile(r"\bnot\b|n['’]t\b|\bnever\b|\bhardly\b", re.IGNORECASE)
_UNDECIDED: Final = re.compile(
    rf"\b(?:either|between|maybe|perhaps|possibly|both)\s{{1,3}}{_L}\s{{0,3}},?\s{{0,3}}(?:(?:and|or)\s{{1,3}})?"
    rf"(?:(?:else|maybe|perhaps|possibly)\s{{1,3}})?{_L}{_END}",
    re.IGNORECASE,
)
_LEAST_VERDICTS: Final = 3
_SHORT: Final = 3
"""Characters of an option that is too short to be told from other words."""
_SAID: Final = {"True": "yes", "False": "no"}
_ONCE_MORE: Final = (
    r"wait|actually|no|hold on|on second thoughts?|on reflection|correction|scratch that|sorry|i mean|i meant|make that"
    r"|rather|(?:i|let me) (?:take that back|correct myself|change my (?:mind|answer))"
)
_CORRECTED: Final = re.compile(
    rf"\b(?:{_ONCE_MORE})\b[\s,.:;!–—-]{{1,6}}(?:(?:{_ONCE_MORE}|then)\b[\s,.:;!–—-]{{1,6}}){{0,2}}"
    rf"(?:(?:it(?:'s|’s| is| must be| should be)|that(?:'s| is)|i (?:choose|say|pick)|to)\s{{1,3}})?"
    rf"(?:(?:option|choice)\s{{1,3}})?{_L}{_END}(?!\s{{1,3}}(?:or|and)\b)"
    rf"(?=\s{{0,3}}(?:[.!;,)]|it is\b|is (?:right|correct)|$))",
    re.IGNORECASE | re.MULTILINE,
)
"""Words of a model that takes its answer back."""
_ORDINALS: Final = (
    "first|1st|one|1|i",
    "second|2nd|two|2|ii",
    "third|3rd|three|3|iii",
    "fourth|4th|four|4|iv|last|final",
)
_ORDINAL: Final = tuple(
    re.compile(
        rf"(?:\b(?:the|my)\s{{1,3}}(?:{'|'.join(w for w in words.split('|') if len(w) > 3 or w[0].isdigit())})\b"
        rf"(?!\s{{1,3}}(?:lane|car|vehicle|light|truck|time|half|frame|image|picture|view|glance|place|pedestrian|person))"
        rf"|\b(?:option|choice|answer|number|no\.|#)\s{{0,3}}(?:is\s{{1,3}})?(?:number\s{{1,3}})?(?:{words})\b"
        rf"|^\W{{0,6}}(?:the\s{{1,3}})?(?:{words})(?:\s{{1,3}}(?:one|option|choice|answer))?\W{{0,6}}$"
        rf"|\b(?:{words})\s{{1,3}}(?:one|option|choice|answer)\b)",
        re.IGNORECASE,
    )
    for words in _ORDINALS
)


def read_choice(answer: str, options: Sequence[str]) -> OptionChoice:
    """The option an answer chooses.

    Args:
        answer: What the model wrote.
        options: Texts of the options, in the order in which they were lettered.
    """
    said = read_model_text(answer)
    if said.unfinished:
        return OptionChoice(None, "unclear")
    if (written := _written(said.answer, options)) is not None:
        return written
    return _read(said.answer, options)


def _written(answer: str, options: Sequence[str]) -> OptionChoice | None:
    """Choice in the field of an object, or in a list of one; None where there is neither."""
    objects = objects_in(answer)
    judged = [one for one in objects if len(one) >= _LEAST_VERDICTS and {*LETTERS}.issuperset(map(str.lower, one))]
    if judged:
        return _judged("\n".join(f"{name}: {_SAID.get(str(value), value)}" for name, value in judged[-1].items()), ())
    found = [
        choice
        for one in objects
        for name, value in one.items()
        if _FIELDS.fullmatch(name) and (choice := _valued(value, options)) is not None
    ]
    listed = _LISTED.fullmatch(answer.strip())
    if not found and listed is not None:
        return _letter(listed[1])
    if not found:
        return None
    return found[0] if len({one.index for one in found}) == 1 else OptionChoice(None, "several")


def _valued(value: object, options: Sequence[str]) -> OptionChoice | None:
    if isinstance(value, Mapping):
        inner = [_valued(one, options) for one in cast("Mapping[str, object]", value).values()]
        return next((one for one in inner if one is not None and one.index is not None), None)
    if isinstance(value, list):
        several = cast("list[object]", value)
        return _valued(several[0], options) if len(several) == 1 else OptionChoice(None, "several")
    if isinstance(value, bool) or value is None:
        return None
    if isinstance(value, int):
        return OptionChoice(value - 1, "ordinal") if 1 <= value <= len(LETTERS) else OptionChoice(None, "unclear")
    return _read(value, options) if isinstance(value, str) else None


def _read(answer: str, options: Sequence[str]) -> OptionChoice:
    text = unicodedata.normalize("NFKC", answer).strip()
    text = _MARKUP.sub(r"\2", text)
    if not text:
        return OptionChoice(None, "empty")
    if (alone := _ALONE.match(text)) is not None:
        return _letter(alone.group(1))
    exact = _same(text, options)
    if exact is not None:
        return OptionChoice(exact, "text")
    positive = _NEGATED.sub(" ", _CAPITAL_OUT.sub(" ", _LISTED_OUT.sub(" ", text)))
    kept = _without_options(positive, options)
    for pattern in (_BOXED, _TAGGED, _TICKED):
        if found := _letters(pattern.findall(kept)):
            return _letter(found[-1])  # a model that corrects itself ends with what it means
    if (judged := _judged(text, options)) is not None:
        return judged
    if corrected := _letters(_CORRECTED.findall(kept)):
        return _letter(corrected[-1])
    if (stated := _stated(kept)) is not None:
        return stated
    undecided = _UNDECIDED.search(kept)
    if (
        undecided is not None
        and undecided[1].lower() != undecided[2].lower()
        and not _CONCLUDED.search(kept, undecided.end())
    ):
        return OptionChoice(None, "several")
    if concluded := _letters(_CONCLUDED.findall(kept)):
        return _letter(concluded[-1])
    front = _FRONT.match(kept)
    bracketed = _letters(_BRACKETED.findall(kept))
    if front is not None and _leads(front.group(1), bracketed, kept, front.end()):
        return _letter(front.group(1))
    if len(set(bracketed)) == 1:
        return _letter(bracketed[0])
    named = _named(positive, options)
    if not bracketed and len(named) == 1:
        return OptionChoice(named[0], "text")
    found = _rest(kept, bracketed, named)
    left = _left_over(text) if found.index is None and not bracketed else None
    return found if left is None else _letter(left)


def _judged(text: str, options: Sequence[str]) -> OptionChoice | None:
    """The one option that is called right, or left, where each is judged; None where an answer is stated besides."""
    for index, option in enumerate(options):  # an option named by its text is named
        if len(option) > _SHORT:
            name = re.escape(option.rstrip("."))
            text = re.sub(
                rf"(?<!\w){name}(?=\s{{0,3}}[:=?–—-])", f" {LETTERS[index].upper()} ", text, flags=re.IGNORECASE
            )
    first, sign = _VERDICT.search(text), _SIGNED.search(text)
    if sign is not None and (first is None or sign.start() < first.start()):
        found = [(one[3].lower(), one[1] is not None, one.end()) for one in _SIGNED.finditer(text)]
    else:
        found = [
            (_lettered(one[1]), one[2] is not None and _DENIED.search(one.group()) is None, one.end())
            for one in _VERDICT.finditer(text)
        ]
    verdicts = {letter: is_right for letter, is_right, _ in found}
    if len(verdicts) < _LEAST_VERDICTS or len(found) != len(verdicts) or _STATED.search(text, found[-1][2]):
        return None
    right = [letter for letter, is_right in verdicts.items() if is_right]
    if len(right) > 1:
        return OptionChoice(None, "several")
    if right:
        return _letter(right[0])
    left = [letter for letter in LETTERS if letter not in verdicts]
    return _letter(left[0]) if left else OptionChoice(None, "none")


def _lettered(mark: str) -> str:
    return LETTERS[int(mark) - 1] if mark.isdecimal() else mark.lower()


def _rest(kept: str, bracketed: Sequence[str], named: Sequence[int]) -> OptionChoice:
    """Choice where no letter and no single option decides."""
    if len(set(bracketed)) > 1:
        last = _letters(_BRACKETED.findall(kept.splitlines()[-1]))
        listed = len({match.group(1).lower() for match in _FRONT.finditer(kept)}) > 1
        if listed and _FRONT.match(kept.splitlines()[-1]) and bracketed.count(last[-1] if last else "") < 2:
            return OptionChoice(None, "several")
        if len(set(last)) == 1 and ("\n" in kept and (bracketed.count(last[0]) > 1 or not _lists_all(bracketed))):
            return _letter(last[0])
        return OptionChoice(None, "several")
    if _ALL.search(kept):
        return OptionChoice(None, "several")
    if _NONE.search(kept):
        return OptionChoice(None, "none")
    ordinal = [index for index, pattern in enumerate(_ORDINAL) if pattern.search(kept)]
    if len(ordinal) == 1:
        return OptionChoice(ordinal[0], "ordinal")
    if len(ordinal) > 1 or len(named) > 1:
        return OptionChoice(None, "several")
    if _REFUSED.search(kept):
        return OptionChoice(None, "refused")
    bare = set(_BARE.findall(kept))
    if len(bare) == 1:
        return _letter(bare.pop())
    return OptionChoice(None, "several" if bare else "unclear")


def _left_over(text: str) -> str | None:
    """The one letter that is not ruled out, where three are."""
    told = [one for pattern in (_NEGATED, _LISTED_OUT, _CAPITAL_OUT) for one in pattern.findall(text)]
    out = {letter.lower() for found in told for letter in found if letter}
    return (set(LETTERS) - out).pop() if len(out) == len(LETTERS) - 1 else None


def _lists_all(bracketed: Sequence[str]) -> bool:
    """True if an answer goes through all options."""
    return len(set(bracketed)) == len(LETTERS)


def _stated(text: str) -> OptionChoice | None:
    """The last answer that is stated as such; none where two letters are stated in one breath ("a or b")."""
    found = list(_STATED.finditer(text))
    if not found:
        return None
    # "Option (B) is unsafe" speaks of an option; "Selected option: (A)" chooses one.
    said = [one for one in found if not one.group().lower().startswith("option") or ":" in one.group()]
    last = (said or found)[-1]
    tail = text[last.end() : last.end() + 24]
    other = re.match(rf"\s*(?:and|or|/|&|,)\s*(?:also\s+|maybe\s+|option\s+)?{_L}{_END}", tail, re.IGNORECASE)
    if other is not None and other.group(1).lower() != last.group(1).lower():
        return OptionChoice(None, "several")
    return _letter(last.group(1))


def _leads(letter: str, bracketed: Sequence[str], text: str, end: int) -> bool:
    """True if a letter in front is the answer, and not the first of a list."""
    second = re.match(rf"\s*(?:and|or|/|&)?\s*{_L}(?:[\)\].,:]|\s*$)", text[end:], re.IGNORECASE)
    if second is not None and second.group(1).lower() != letter.lower():
        return False
    listed = {match.group(1).lower() for match in _FRONT.finditer(text)}
    return len(listed) == 1 and not _lists_all(bracketed)


def _letter(letter: str) -> OptionChoice:
    return OptionChoice(LETTERS.index(letter.lower()), "letter")


def _letters(found: Iterable[str | tuple[str, ...]]) -> list[str]:
    return [(one if isinstance(one, str) else "".join(one)).lower() for one in found]


def _plain(text: str) -> str:
    return " ".join(re.findall(r"\w+", text.lower()))


def _same(text: str, options: Sequence[str]) -> int | None:
    """The only option that an answer repeats word for word."""
    same = [index for index, option in enumerate(options) if _plain(option) == _plain(text)]
    return same[0] if len(same) == 1 else None


def _named(text: str, options: Sequence[str]) -> list[int]:
    """Options whose text stands in an answer, those left out whose text is part of another one's that does."""
    for option in options:
        name = re.escape(option.rstrip("."))
        text = re.sub(rf"{name}{_WRONG}|\bnot\s{{1,3}}{name}\b", " ", text, flags=re.IGNORECASE)
    said = f" {_plain(text)} "
    found = [(index, _plain(option)) for index, option in enumerate(options)]
    held = [(index, option) for index, option in found if option and f" {option} " in said]
    return [index for index, option in held if not any(option != other and option in other for _, other in held)]


def _without_options(text: str, options: Sequence[str]) -> str:
    """An answer without the options' own words, which may hold single letters and ordinals ("the first car")."""
    for option in sorted(options, key=len, reverse=True):
        if len(option) > _SHORT:
            text = re.sub(re.escape(option.rstrip(".")), " ", text, flags=re.IGNORECASE)
    return text
