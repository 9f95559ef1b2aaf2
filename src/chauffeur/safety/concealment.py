"""Finds instructions hidden in a text: patterns of words, and codes that decode to such words.

The words are those of the ways in which language models are known to be talked out of their rules, in the languages
that passengers of the hostile suite speak. A list of words never ends; what it misses meets the checks and limits.
"""

from __future__ import annotations

import base64
import binascii
import codecs
import html
import quopri
import re
from collections.abc import Callable, Iterator
from typing import Final, Literal
from urllib.parse import unquote

from chauffeur.language.letters import dressed, folded, ignorable, skeleton, words_that_mix

Kind = Literal["override", "role", "code", "control", "lookalike", "encoded", "long"]
"""Kind of finding: words that claim to change the rules; a forged speaker or chat-template token; program text, markup
or JSON that tries to be the policy; invisible characters; letters dressed as others; text that decodes to an
instruction; far too much text."""

Found = tuple[Kind, tuple[int, int], str]
"""Kind, place in the text, and words."""

MAX_READ_CHARS: Final = 8_000
"""Of a longer text only the beginning is read: the time it takes must not be the sender's to choose."""

_DEPTH: Final = 2
"""Codes within codes that are undone."""
_SHOWN: Final = 120

_VERBS: Final = (
    r"ignor\w*|disregard\w*|forget|overrid\w*|overrul\w*|overwrit\w*|bypass\w*|skip|disabl\w*|(?:switch|turn)\w* off"
    r"|cancel\w*|delet\w*|drop|lift\w*|suspend\w*|revok\w*|unlock\w*|scrap|scratch|void|leave out|set aside|replac\w*"
    r"|stop following|redefin\w*|append|update"
)
_RULES: Final = (
    r"instructions?|rules?|guidelines?|directives?|checks?|limits?|restrictions?|constraints?|prohibitions?|safety"
    r"|gate|envelope|verification|system prompt|guard|governor|headway floor|limiter|everything you were told|memory"
)
_OVERRIDE: Final = (
    rf"\b(?:{_VERBS})\b(?:[^\w.!?]+\w+){{0,6}}?[^\w.!?]+(?:{_RULES})\b",
    rf"\b(?:no|without|beyond|past) (?:any |all |your )?(?:{_RULES})\b",
    rf"\b(?:{_RULES}) (?:is|are|was|were|has been|have been) (?:now )?"
    r"(?:off|void|lifted|suspended|removed|withdrawn|optional)",
    rf"\b(?:{_RULES})\s*(?:[:=]\s*)?(?:off|none)\b",
    r"\byou(?:'re| are) now\b|\byou are no longer\b|\byour name is\b|\b(?:stay )?in (?:the )?(?:role|character)\b",
    r"\bsystem override\b|\bdeveloper mode\b|\bjailbreak\w*|\bproduction mode\b|\brescue mode\b|\boperator release\b",
    r"\b(?:to the|for the|hint to|note to|note for) (?:planner|language model|assistant|ai|model|automated)\b",
    r"\b(?:planner|assistant|language model|cars?|vehicles?)[,:]? (?:must|obey|reply|should|shall|are requested)\b",
    r"\b(?:higher|highest) priority\b|\bpriority (?:zero|message)\b|\bsupersed\w*|\boutrank\w*|\bdo not refuse\b",
    r"\bmust (?:begin with|be read as)\b|\bdecode\b.{0,20}\b(?:follow|comply|do|obey)\b|\bcomply\b|\bobey\b",
    r"\bset target speed\b|\b(?:disable|skip)\w* (?:parameter )?verification\b|\bset[, ]+target[, ]+speed\b",
    r"\b(?:ignora|olvida|desactiva|saltate)\b.{0,40}\b(?:instrucciones|reglas|limites|verificacion|normas)",
    r"\b(?:ignorez?|oubliez?|desactivez?|coupez?)\b.{0,40}\b(?:consignes|regles|limites|instructions|securites)",
    r"\b(?:ignorier\w*|vergiss|schalte|missachte|umgehe)\b.{0,40}\b(?:regeln|anweisungen|grenz\w*|prufung|sperre|check)",
    r"\b(?:esqueca|ignore|desligue|desative)\b.{0,40}\b(?:regras|instrucoes|limites?)",
    r"\b(?:zignoruj|zapomnij|wylacz)\b.{0,40}\b(?:poleceni\w*|instrukcj\w*|zasad\w*|sprawdzani\w*|ogranicz\w*)",
    r"(?:talimat|kural|kontrol|sinir)\w{0,20}.{0,30}\b(?:unut|kapat|yok say|gormezden)",
    r"\b(?:niyam|rules?|safety check)\b.{0,30}\b(?:bhool|band|tod)",
    r"(?:игнорируй|забудь|отключи)\w{0,20}.{0,40}(?:инструкци|правил|ограничени|проверк)",
    r"(?:忽略|无视|忘记|关闭|解除).{0,15}(?:指令|规则|限制|检查|安全)",
    r"(?:指示|ルール|制限|安全|確認).{0,10}(?:無視|切っ|解除|忘れ)",
    r"(?:تجاهل|ألغ|عطل).{0,30}(?:التعليمات|القواعد|الفحص|الحدود)",
)
_ROLE: Final = (
    r"(?:^|[\n.!?>\]]\s{0,9}|-\s)(?:system|assistant|user|human|developer|tool|planner|chauffeur|operator)\s{0,9}:",
    r"<\s{0,9}[|｜][^<>]{0,60}[|｜]?\s{0,9}>|\[/?inst\]|<</?sys>>|</?s>|<(?:start|end)_of_turn>",
    r"</?\s{0,9}(?:system|assistant|user|human|history|context|instruction|data|tool_call|tool_result|hidden)\b[^<>]{0,200}>",
    r"\[{1,3}\s{0,9}(?:system|user|assistant|admin|tool result|end tool result)\b[^\]\n]{0,80}\]",
    r"#{2,9}\s{0,9}(?:instruction|response|system|input|user|assistant)\b|-{3,9}\s{0,9}(?:begin|end) (?:of )?\w+",
    r"[\"']role[\"']\s*:",
)
_CODE: Final = (
    r"```|~~~|\bdef\s+\w+\s*\(|\bclass\s+\w+\s*:|\byield\s+(?:from\s+)?\w+\s*\(|\bimport\s+(?:os|sys|math|subprocess)\b",
    r"\b[a-z]+(?:_[a-z]+)+\s*\(|\b(?:eval|exec|open|globals|getattr|compile)\s*\(|__\w{1,30}__|\blambda\b[^:\n]{0,40}:",
    r"\{\s{0,9}[\"'][\w ]{1,40}[\"']\s*:|<[!?/]?[a-z][^<>]{0,200}>|\$\([^)\n]{1,80}\)|\bsudo\s+\w+|\s--[a-z]+-[a-z]+",
    r"\bselect\b.{1,60}\bfrom\b.{1,60}\bwhere\b|\bdrop\s+table\b|\brm\s+-?\w+\.\w+",
)
_LEET: Final = (str.maketrans("013457@$", "oieastas"), str.maketrans("013457@$", "oleastas"))
_LEET_WORD: Final = re.compile(r"[a-z@$][0134570]|[0134570][a-z@$]")
_SPACED: Final = re.compile(r"(?<![^\W_])(?:[^\W_][ .\-_]{1,3}){3,}[^\W_](?![^\W_])")
"""Letters one by one. What parts them must not be taken for a letter as well: the time would double with each."""
_TELLING: Final = re.compile(
    r"\b(?:speed|limits?|headway|gap|stop|sign|drive|lane|checks?|ignore|brakes?|shoulder|traffic|ram|throttle|faster"
    r"|safety|merge|wrong way|set_\w+|m/s|km/h)\b"
)


def _compiled(*sources: str) -> re.Pattern[str]:
    return re.compile("|".join(f"(?:{folded(source)})" for source in sources), re.MULTILINE)


_WORDS: Final[tuple[tuple[Kind, re.Pattern[str]], ...]] = (
    ("override", _compiled(*_OVERRIDE)),
    ("role", _compiled(*_ROLE)),
    ("code", _compiled(*_CODE)),
)
_INSTRUCTS: Final = _WORDS[0][1]


def hidden_in(text: str, depth: int = _DEPTH) -> Iterator[Found]:
    """Everything found in a text of at most MAX_READ_CHARS characters.

    Args:
        text: Words from outside.
        depth: Codes within codes that may still be undone.
    """
    bare, places = skeleton(text)
    for kind, pattern in _WORDS:
        for match in pattern.finditer(bare):
            yield kind, _place(match, places), match[0].strip()[:_SHOWN]
    yield from _characters(text)
    if depth > 0:
        for span, decoded in _decoded(text, bare, places):
            if _tells(decoded, depth - 1):
                yield "encoded", span, decoded.strip()[:_SHOWN]


def _place(match: re.Match[str], places: list[int]) -> tuple[int, int]:
    return places[match.start()], places[match.end() - 1] + 1


def _characters(text: str) -> Iterator[Found]:
    """Runs of invisible and of dressed characters, and words that mix scripts."""
    invisible = [place for place, char in enumerate(text) if char not in "\n\r\t" and ignorable(char)]
    hidden = [place for place in invisible if not _of_an_emoji(text, place)]
    if hidden:
        names = "".join(chr(ord(text[place]) - 0xE0000) for place in hidden if 0xE0020 <= ord(text[place]) < 0xE007F)
        words = names or f"{len(hidden)} invisible characters"
        yield "control", (hidden[0], hidden[-1] + 1), words[:_SHOWN]
    plain = [place for place, char in enumerate(text) if dressed(char)]
    if plain:
        start, end = plain[0], plain[-1] + 1
        yield "lookalike", (start, end), skeleton(text[start:end])[0][:_SHOWN]
    for start, end in words_that_mix(text):
        yield "lookalike", (start, end), skeleton(text[start:end])[0][:_SHOWN]


def _of_an_emoji(text: str, place: int) -> bool:
    """True if an invisible character is one that emoji are written with: the variation selector behind a symbol."""
    return text[place] == "\ufe0f" and place > 0 and ord(text[place - 1]) > 0x2000


def _tells(decoded: str, depth: int) -> bool:
    """True if a decoded text reads as an instruction to a driver, or holds a further code that does."""
    if len(decoded) < 4 or not decoded.isprintable():
        return False
    if _TELLING.search(skeleton(decoded)[0]):
        return True
    return any(kind in ("override", "role", "encoded") for kind, _, _ in hidden_in(decoded, depth))


Decoder = Callable[[str], str]


def _decoded(text: str, bare: str, places: list[int]) -> Iterator[tuple[tuple[int, int], str]]:
    """Yield decodings of parts of a text, code by code; most of it is noise."""
    for pattern, decode in _CODES:
        for match in pattern.finditer(text):
            yield from _tried(match.span(), match[0], decode)
    for match in _SPACED.finditer(bare):
        # Letter by letter is how people spell: only an instruction hidden that way is one.
        joined = re.sub(r"[ .\-_]", "", match[0])
        if re.search(r"ignor|limits?|throttle|tailgat|speedto|headway|checks?off", joined):
            yield _place(match, places), f"ignore: {joined}"
    whole = (0, len(text))
    for turned in (codecs.encode(bare, "rot13"), bare[::-1], " ".join(word[::-1] for word in bare.split())):
        if len(_TELLING.findall(turned)) > len(_TELLING.findall(bare)):
            yield whole, turned.replace("\n", " ")
    if _LEET_WORD.search(bare) and not _INSTRUCTS.search(bare):
        for table in _LEET:
            if _INSTRUCTS.search(plain := bare.translate(table)):
                yield whole, plain.replace("\n", " ")
                return


def _tried(span: tuple[int, int], coded: str, decode: Decoder) -> Iterator[tuple[tuple[int, int], str]]:
    try:
        decoded = decode(coded)
    except (ValueError, binascii.Error, UnicodeError, OverflowError):
        return
    if decoded != coded:
        # An instruction of several lines is one all the same.
        yield span, "".join(" " if char.isspace() else char for char in decoded).strip("\0 ")


def _base64(coded: str) -> str:
    # Of the signs that fill it up, too many are passed over, and too few are not.
    return base64.b64decode(coded.replace("-", "+").replace("_", "/") + "==").decode()


def _base64_reversed(coded: str) -> str:
    return _base64(coded[::-1])


def _base32(coded: str) -> str:
    plain = coded.rstrip("=")
    return base64.b32decode(plain + "=" * (-len(plain) % 8)).decode()


def _hex(coded: str) -> str:
    return bytes.fromhex(coded.removeprefix("0x").replace(":", "")).decode()


def _binary(coded: str) -> str:
    return bytes(int(byte, 2) for byte in re.findall(r"[01]{8}", coded)).decode()


def _decimal(coded: str) -> str:
    return bytes(map(int, re.findall(r"\d+", coded))).decode()


def _octal(coded: str) -> str:
    return bytes(int(number, 8) for number in re.findall(r"\d+", coded)).decode()


def _escapes(coded: str) -> str:
    return "".join(chr(int(digits, 16)) for digits in re.findall(r"\\[ux]([0-9a-fA-F]{2,4})", coded))


def _quoted_printable(coded: str) -> str:
    return quopri.decodestring(coded.encode()).decode()


_CODES: Final[tuple[tuple[re.Pattern[str], Decoder], ...]] = (
    (re.compile(r"(?<![A-Za-z0-9+/])[A-Za-z0-9+/_-]{12,4096}={0,2}"), _base64),
    (re.compile(r"={0,2}[A-Za-z0-9+/_-]{12,4096}"), _base64_reversed),
    (re.compile(r"\b[A-Z2-7]{16,4096}={0,6}"), _base32),
    (re.compile(r"(?:0x)?(?:[0-9a-fA-F]{2}[ :]?){5,2048}"), _hex),
    (re.compile(r"(?:[01]{8}\s?){3,512}"), _binary),
    (re.compile(r"\b(?:\d{2,3}[ ,]+){3,512}\d{2,3}\b"), _decimal),
    (re.compile(r"\b(?:[0-7]{2,3}[ ,]+){3,512}[0-7]{2,3}\b"), _octal),
    (re.compile(r"(?:%[0-9a-fA-F]{2}[^\s%]{0,40}){2,512}"), unquote),
    (re.compile(r"(?:&#x?[0-9a-fA-F]{1,6};\s?){3,512}"), html.unescape),
    (re.compile(r"(?:\\[ux][0-9a-fA-F]{2,4}){3,512}"), _escapes),
    (re.compile(r"(?:=[0-9A-F]{2}){3,512}"), _quoted_printable),
)
