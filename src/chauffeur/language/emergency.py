"""Emergency words: what must be certain, and is therefore read by rules, before any planner and in the same way
wherever a person speaks or types.

An utterance asks for a stop only if stopping the car now is what it says: the verb stands at the head of its clause,
with nothing behind it but the car, "now", "here", courtesy or the reason. "Stop at the next exit", "stop tailgating
him" and "he told me to stop" are wishes or remarks like others. What stands under a negation is no stop, and of a thing
said and taken back the last counts.

Every pattern is linear in the length of the text, and no more than `MOST_CHARACTERS` are read.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.language.distress import distress_in, is_only_told, safe_stop_in
from chauffeur.language.hazards import called_out, hazard_in
from chauffeur.language.languages.reader import Language, read_call
from chauffeur.language.plain_line import COURTESY, line_of, pieces_of, sentences_of

Kind = Literal["stop", "safe_stop", "ask", "no_stop"]
"""`stop`: the minimal-risk manoeuvre at once. `safe_stop`: a stop at the next safe place, asked for in so many words.
`ask`: a person or the car is in distress, and the car offers that stop in one question. `no_stop`: the person says that
the car is not to stop, brake or pull over."""

SAFE_STOP_WISH: Final = "Stop at the next safe place."
"""The sentence that is always read as `safe_stop`: what a yes to the question stands for."""


@dataclass(frozen=True, slots=True)
class Emergency:
    """An emergency in words.

    Attributes:
        kind: What the car is to do about it.
        words: The stretch that says so, in plain words.
        alone: Whether the utterance says nothing else that a planner could be asked for.
        slower: Of `no_stop`: whether slowing down is forbidden as well ("don't brake").
        language: Of the words; None for English.
    """

    kind: Kind
    words: str
    alone: bool = True
    slower: bool = False
    language: Language | None = None


def read_emergency(text: str) -> Emergency | None:
    """The emergency in an utterance, in English or a language of `languages`; None if there is none."""
    found = _read_english(text)
    if found is not None and found.kind == "stop":
        return found
    call = read_call(text)
    return found if call is None else Emergency(call.kind, call.words, language=call.language)


def _read_english(text: str) -> Emergency | None:
    line = line_of(text)
    refusals = [match for match in _NEGATED.finditer(line) if not _MEANT_OTHERWISE.match(line, match.end())]
    masked = line
    for match in refusals:
        masked = f"{masked[: match.start()]}{'~' * (match.end() - match.start())}{masked[match.end() :]}"
    last_stop = max(_stops_in(masked), default=None)
    last_no = max((match.start(), match[0]) for match in refusals) if refusals else None
    if last_stop is not None and (last_no is None or last_stop[0] > last_no[0]):
        taken_back = _TAKEN_BACK.search(masked, last_stop[0] + len(last_stop[1]))
        if taken_back is None:
            return Emergency("stop", last_stop[1])
        return Emergency("no_stop", taken_back[0].strip(), alone=_is_filler(masked[taken_back.end() :]))
    if last_no is not None:
        slower = any(match["slow"] is not None for match in refusals)
        return Emergency("no_stop", last_no[1].strip(), alone=_is_filler(masked), slower=slower)
    if called := called_out(line):
        return Emergency("stop", called)
    return _distress_in(line)


# Stop ----------------------------------------------------------------------------------------------------------------

_CAR: Final = (
    r"(?:(?:the|this|your|our|my|that) )?(?:damn(?:ed)? |bloody |fucking )?(?:car|vehicle|thing|taxi|cab|van|truck)"
)
_BRAKES: Final = (
    r"(?:the |your |those )?(?:emergency |parking |park |hand )?(?:brake pedal|brakes?|breaks?|hand ?brake|anchors?)"
)
_ENGINE: Final = r"(?:(?:the|this|your|our|that) )?(?:engine|motor|ignition|power|car|vehicle)"
_STEP: Final = (
    r"(?:one|another|one more|a single) (?:inch|centimetre|metre|meter|foot|yard|step)(?: (?:further|farther|more))?"
)
_STOP: Final = (
    rf"(?:(?:do |make |perform )?(?:an )?emergency (?:stop|halt|brake|braking)|full braking"
    rf"|cease driving|(?:stop|halt)(?: (?:{_CAR}|driving|moving|rolling|going|everything))?(?! sign\b| light\b)"
    rf"|brake(?: {_CAR})?|(?:slam|stand|step|jam|bang|whack|get|put|hit|press|apply|pull|use)(?: on)? {_BRAKES}(?: on)?"
    rf"|(?:slam|jam|bang|whack) (?:them|em) on"
    rf"|bring (?:{_CAR}|it|her|us|this) to a (?:\w+ )?(?:stop|halt|stand|standstill)"
    rf"|come to a (?:\w+ )?(?:stop|halt|stand|standstill)|stand still"
    rf"|make (?:it|this|{_CAR}) stop|get {_CAR} stopped"
    rf"|(?:cease|quit)(?: all)? (?:driving|movement|motion|moving)"
    rf"|(?:kill|cut|stop|switch off|turn off|shut off|shut down|power down) {_ENGINE}"
    rf"|(?:switch|turn|shut) {_ENGINE} (?:off|down))"
)
_SHARP: Final = (
    rf"(?:freeze|(?:abort|terminate)(?: (?:the|this|our) (?:drive|ride|trip|journey|mission))?|hold it right there"
    rf"|shut (?:it|everything) (?:all )?down|brakes? on|(?:emergency|parking|park|hand) ?brake(?= now| on| please)"
    rf"|(?:drop|throw out) (?:the )?anchors?|anchors? (?:on|out|down)|not {_STEP}"
    rf"|(?:do not|never) (?:move|go|drive|roll)(?: {_CAR})? (?:any (?:further|farther)|{_STEP}))"
)
"""A call for a stop whose words mean something else where more follows: "freeze the gap where it is"."""
_ASKING: Final = (
    r"(?:(?:can|could|will|would|wo not) you|you (?:really )?(?:must|should|have to|need to|had better|better|ought to)"
    r"|i (?:want|need|order|command|beg|ask|am telling|am ordering|would like|told) you to|i demand that you|lets"
    r"|would you mind and|do)"
)
_LEAD: Final = rf"(?:(?:{COURTESY}|{_ASKING}) )*+"
_TRAIL: Final = (
    rf"(?: (?:{COURTESY}|here|right here|right there|there(?! (?:is|are|was|has)\b)|right|this (?:very )?(?:instant"
    rf"|second"
    r"|minute|moment)|instantly|straight away|directly|asap|fast|hard|as hard as you can|on the spot|where you are"
    r"|already|ok"
    r"|completely|dead|for me|will you|would you|can you|could you|thank you|thanks|you (?:idiot|fool|moron)|i mean it"
    rf"|do it|do you hear(?: me)?|{_CAR}|stop|halt|brake|break|freeze|abort)(?= |$))*+"
)
_REASON: Final = (
    r"(?: (?:because|cause|as (?:i|he|she|they|there))\b| before (?:we|you|i|it|he|she|they|some(?:one|body"
    r"|thing))(?: all)? (?:hit|crash|kill|die|hurt|get"
    r" hurt|run)\b| (?:there|here) (?:is|are|comes?)\b| (?:he|she|they|we)\b| i (?!mean\b)| (?:it|that) (?:is|was)\b"
    r"| you (?:are|almost|nearly|just|will|have)\b| some(?:thing|one|body)\b| (?:a|an|the|my|that"
    r"|this)(?: \w+){1,4}? (?:is|are|has"
    r"|have|was|feels?|hurts?|ran|runs?|running|jumped|fell|stopped|crossing)\b| (?:child|kid|children|kids|dog|deer"
    r"|man|woman"
    r"|person|people|fire|smoke)\b| or (?:we|you|i|else)\b| what (?:are|the|is)\b| and (?:let|get|wait|stay|stand"
    r"|help|call|open|stop|halt|pull|do not (?:move|go|drive))\b"
    r"| before\b(?= it is too late))"
)
_STOP_CLAUSE: Final = re.compile(rf"^ (?P<lead>{_LEAD})(?P<stop>{_STOP})(?P<trail>{_TRAIL})(?: ?$|(?={_REASON}))")
_CALL: Final = re.compile(rf"^ (?:{COURTESY} )*?(?P<stop>{_SHARP}){_TRAIL} ?$")
_HOMOPHONE: Final = re.compile(
    rf"^ (?:{COURTESY} )*+(?P<stop>break(?: break)*+)(?: (?:now|hard|please|break)(?= |$))*+ ?$"
)
_NEED: Final = re.compile(
    rf"^ (?:{COURTESY} )*+(?:we|i) (?:really |just )?(?:must|should|have to|need to|have got to|got to|want to|better)"
    rf" (?P<stop>{_STOP})(?P<trail>{_TRAIL}) ?$"
)
_AT_ONCE: Final = re.compile(r"\b(?:now|immediately|at once|right away|instantly|straight away|this (?:very )?\w+)\b")
_LATE: Final = re.compile(
    rf"(?<= )(?<!stop )(?P<stop>(?:stop|halt|brake)(?: (?:stop|halt|brake))++|(?:stop|halt) {_CAR}|(?:just|please"
    rf"|now) stop"
    rf"|stop (?:now|immediately|at once|right now))(?P<trail>{_TRAIL}) ?$"
)
"""At the end of a stretch that began otherwise: text of a recogniser has no signs."""
_NOT_TO_THE_CAR: Final = re.compile(
    r"\b(?:he|she|they|who|told|tell|tells|telling|say|says|said|asks?|asked|shouted?|yelled|screamed?|heard|wants?"
    r"|wish|if|when"
    r"|whenever|until|till|unless|after|before|where|why|how|would|might|in case|once|never|game|song|movie|film"
    r"|book)\b"
    r"|\b(?:to|at|the|an?|any|not|next|can|could|would|should|will|did|does|do|or|than|of|bus|pit|truck|full|and|last"
    r"|first) $|~ ?$"
)
"""In front of such a late "stop the car": told of somebody, supposed, or a noun."""
_TAKEN_BACK: Final = re.compile(
    r"\b(?:never mind|cancel(?: that| it| the stop)?|scratch that|forget (?:it|that)|just kidding|only joking"
    r"|false alarm"
    r"|(?:keep|carry|go|drive) (?:going|on|driving|moving))\b"
)


_SUPPOSED: Final = re.compile(
    rf"^(?: {COURTESY})*+ (?:if|when|whenever|unless|in case|once|as soon as|should (?:there|you|we|i))\b"
)


def _stops_in(line: str) -> list[tuple[int, str]]:
    """Positions and words of stops in a line; what a sentence only supposes ("if ..., brake") is none."""
    found: list[tuple[int, str] | None] = []
    for sentence, begin in sentences_of(line):
        if _SUPPOSED.match(sentence) is not None:
            continue
        for piece, at in pieces_of(sentence):
            found.append(_stop_in(piece, begin + at))
            if found[-1] is None and (way := hazard_in(piece, sentence)) is not None:
                found.append((begin + at + way.start(), way[0].strip()))
    return [one for one in found if one is not None]


def _stop_in(piece: str, at: int) -> tuple[int, str] | None:
    """Position and words of a stop in a stretch; None if there is none."""
    found = _STOP_CLAUSE.match(piece) or _CALL.match(piece) or _HOMOPHONE.match(piece)
    if found is None:
        found = _NEED.match(piece)
        if found is not None and _AT_ONCE.search(found["trail"]) is None:
            return None
    if found is None:
        found = _LATE.search(piece)
        if found is not None and _NOT_TO_THE_CAR.search(piece[: found.start()]) is not None:
            return None
    if found is not None:
        return at + found.start("stop"), found["stop"]
    return None


# No stop -------------------------------------------------------------------------------------------------------------

_GERUND: Final = (
    r"(?:(?!anything|during|everything|nothing|something|morning|evening|crossing|driving|moving|rolling"
    r"|going)\w+ing\b)"
)
_NEGATED: Final = re.compile(
    r"\b(?:(?:do|does|did|must|should|need|can|may|will|would|could|shall|ought|are|is|better|please|and|but"
    r"|just) not|never|not"
    r"|(?:there is |there was )?(?:no|without any|without a) (?:need|reason|cause|point|use|sense)(?: in)?|without"
    r"|avoid|refrain from|no longer|rather than"
    r"|instead of|under no circumstances|no(?= (?:stopping|braking|halting|pulling|parking|slowing)\b))"
    r"(?: ,? ?(?:under any circumstances|whatever happens|whatever you do|no matter what|i beg you|please"
    r"|ever) ?,?(?= ))?"
    r"(?: (?:you|to|for|even|ever|think|about|of|dare|try|trying|want|wanting|wish|need|have|be|please|just|now"
    r"|suddenly|necessary"
    r"|any|us|me|we|i|that|should|go|going|start|at|all|bother|be|being|like|supposed|allowed|let|the|car|anybody"
    r"|anyone|going|planning)){0,8}?"
    r" (?:(?P<slow>brak(?:e|ing)|slow(?:ing)?(?: (?:down|up|any))?|(?:hit|touch|step on|slam on|use)(?:ting"
    r"|ing)? (?:the )?brakes?)"
    r"|(?:emergency )?stop(?:ping|s)?|halt(?:ing)?"
    r"|(?:pull|pulling) (?:over|in|up|off|aside|out of|to the (?:side|right|shoulder)|on ?to the (?:side|shoulder))"
    r"|com(?:e|ing) to a (?:\w+ )?(?:stop|halt|stand|standstill)|park(?:ing)?)\b"
)
_MEANT_OTHERWISE: Final = re.compile(
    rf" (?:{_GERUND}|(?:so|too|that|as|this|like|quite|very|abruptly|suddenly|hard|harder|harshly|sharply|late|early"
    rf"|quickly|roughly"
    rf"|in such|with such|signs?|lights?|lines?|me|it|him|her|them|us)\b(?! car\b)"
    rf"|(?:the|my|your|our|these|those|any|his|her) (?!car|vehicle|van|taxi|next|first|moment|whole|entire)\w+)"
)
"""Behind the verb: another act ("don't stop accelerating"), or its manner ("don't brake so hard")."""
_FILLER: Final = re.compile(
    rf"^(?: (?:[.,!~]+|{COURTESY}|{_STOP}|driving|moving|going|rolling|never mind|cancel(?: that)?|forget it|can you"
    rf"|could you|would you|here|yet|the car|car|at all|there|for (?:anything|anybody|anyone|him|her|them|me|us)"
    rf"|whatever happens"
    r"|whatever you do|no matter what|under any circumstances|on any account|again|anywhere|in this lane"
    r"|on the (?:road|highway"
    r"|motorway|freeway|shoulder)|in the (?:lane|road)|(?:you (?:can )?)?(?:just )?(?:keep|carry|go|drive|move|roll)"
    r" (?:going|on|driving|moving|rolling|ahead)|keep it (?:up|going|rolling)|continue|we are fine|i am fine"
    r"|it is (?:fine|ok)"
    r"|everything is (?:fine|ok)|all is (?:fine|well|good)|for now|right|ever|i|you|we|lets|rather|there is"
    r"|until i (?:say|tell you)(?: so)?|anyway|and|but)(?= |$))*+ ?$"
)


def _is_filler(masked: str) -> bool:
    """True if nothing is left that a planner could be asked for."""
    rest = re.sub(r"~+", " ~ ", masked)
    return _FILLER.match(re.sub(r"\s+", " ", f" {rest.strip()}")) is not None


def _distress_in(line: str) -> Emergency | None:
    safe = safe_stop_in(line)
    if (
        safe is not None
        and _NOT_TO_THE_CAR.search(line[: safe.start()].replace(" can ", " ").replace(" could ", " ")) is None
    ):
        return Emergency("safe_stop", safe[0])
    if words := distress_in(line):
        return Emergency("ask", words)
    need = next((found for piece, _ in pieces_of(line) if (found := _NEED.match(piece))), None)
    return None if need is None or is_only_told(line) else Emergency("ask", need[0].strip())


# An alarm in the words of a model ------------------------------------------------------------------------------------

_TOLD_OF: Final = re.compile(
    r"\b(?:emergency|ambulance|distress|in danger|heart attack|unconscious|not breathing|medical (?:help|attention)"
    r"|(?:wants?|wish(?:es)?|asks?|asked|asking|demands?|needs?|tells?|told|request(?:s|ed)?|orders?|call(?:s|ed)?)"
    r"(?: \w+){0,4} (?:to|for an?) (?:immediate |emergency |sudden |full )*+(?:stop|halt|brake|freeze)"
    r" ?(?:[.,!]|the (?:car|vehicle)\b|immediately\b|now\b|at once\b|here\b|because\b|$))"
)
_OF_NONE: Final = re.compile(
    r"\bemergency (?:lane|vehicle|light)s?\b|\b(?:no|not an?|without an?|not|than) (?:\w+ )?emergency\b"
)


def tells_of_alarm(thoughts: str) -> bool:
    """True if a model's own words say that a person asks for a stop at once, or is in distress."""
    return _TOLD_OF.search(_OF_NONE.sub(" ", line_of(thoughts))) is not None
