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

from chauffeur.language.letters import clean
from chauffeur.language.tokens import plain

Kind = Literal["stop", "safe_stop", "ask", "no_stop"]
"""`stop`: the minimal-risk manoeuvre at once. `safe_stop`: a stop at the next safe place, asked for in so many words.
`ask`: a person or the car is in distress, and the car offers that stop in one question. `no_stop`: the person says that
the car is not to stop, brake or pull over."""

MOST_CHARACTERS: Final = 2_000
"""As many as a wish may have."""

SAFE_STOP_WISH: Final = "Stop at the next safe place."
"""The sentence that is always read as `safe_stop`: what a yes to the question stands for."""


@dataclass(frozen=True, slots=True)
class Emergency:
    """What was read.

    Attributes:
        kind: What the car is to do about it.
        words: The stretch that says so, in plain words.
        alone: Whether the utterance says nothing else that a planner could be asked for.
        slower: Of `no_stop`: whether slowing down is forbidden as well ("don't brake").
    """

    kind: Kind
    words: str
    alone: bool = True
    slower: bool = False


def read_emergency(text: str) -> Emergency | None:
    """What an utterance has of an emergency; None where it has nothing."""
    line = _line(text)
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
    return _distress_in(line)


# From text to a line of plain words ----------------------------------------------------------------------------------

_SENTENCE_END: Final = re.compile(r"[.!?;:\n]+")
_OTHER_SIGNS: Final = re.compile(r"[^a-z0-9., ]+")
_DRAWN_OUT: Final = re.compile(r"([a-z])\1{2,}")
_TORN: Final = re.compile(r"\b(do|does|did|ca|wo|should|would|could|must|need) ?n ?t\b")
_SLIPS: Final = re.compile(r"\b(?:stopp|stpo|sotp|sstop|stio|stoip)\b")
_GAPS: Final = re.compile(r"\s+")


def _line(text: str) -> str:
    """Plain words with `.` between sentences and `,` within them, one space around everything."""
    line = plain(clean(text[:MOST_CHARACTERS]))
    line = _SENTENCE_END.sub(" . ", line).replace(",", " , ")
    line = _DRAWN_OUT.sub(r"\1", _OTHER_SIGNS.sub(" ", line))
    line = _TORN.sub(r"\1 not", _GAPS.sub(" ", line)).replace("ca not", "can not").replace("wo not", "will not")
    return f" {_SLIPS.sub('stop', line).strip()} "


def _pieces(line: str) -> list[tuple[str, int]]:
    """Stretches between signs, each with where it begins."""
    return [(match[0], match.start()) for match in re.finditer(r"[^.,]+", line)]


# Stop ----------------------------------------------------------------------------------------------------------------

_CAR: Final = (
    r"(?:(?:the|this|your|our|my|that) )?(?:damn(?:ed)? |bloody |fucking )?(?:car|vehicle|thing|taxi|cab|van|truck)"
)
_BRAKES: Final = r"(?:the |your |those )?(?:emergency )?(?:brakes?|breaks?|hand ?brake)"
_STOP: Final = (
    rf"(?:(?:do |make |perform )?(?:an )?emergency (?:stop|halt|brake|braking)|full braking"
    rf"|cease driving|(?:stop|halt)(?: (?:{_CAR}|driving|moving|rolling|going|everything))?(?! sign\b| light\b)"
    rf"|brake(?: {_CAR})?|(?:slam|stand|step|jam|get|put|hit|press|apply|pull|use)(?: on)? {_BRAKES}(?: on)?"
    rf"|bring {_CAR} to a (?:\w+ )?(?:stop|halt|stand|standstill)"
    rf"|come to a (?:\w+ )?(?:stop|halt|stand|standstill)|stand still"
    rf"|make (?:it|this|{_CAR}) stop|get {_CAR} stopped)"
)
_COURTESY: Final = (
    r"(?:please|kindly|just|oh|ah|aah|argh|hey|hi|hello|ok|now|no|yes|yeah|car|chauffeur|computer|driver|sir|mate|man"
    r"|dude|buddy|bro|quick|quickly|hurry|god|my god|jesus|christ|hell|shit|fuck|damn|damn it|fucking|bloody hell"
    r"|(?:for )?(?:gods?|heavens?|christs?|goodness|petes?)(?: s)? sake|for the love of god|listen|look|look out"
    r"|watch out|careful|help|help me|wait|hold on|emergency|danger|attention|alert|i am begging you|i beg you|i said"
    r"|i say|i repeat|really|simply|immediately|at once|right now|right away|everybody|excuse me|whoa|woah|ouch|uh|um"
    r"|er)"
)
_ASKING: Final = (
    r"(?:(?:can|could|will|would|wo not) you|you (?:really )?(?:must|should|have to|need to|had better|better|ought to)"
    r"|i (?:want|need|order|command|beg|ask|am telling|am ordering|would like|told) you to|i demand that you|lets"
    r"|would you mind and|do)"
)
_LEAD: Final = rf"(?:(?:{_COURTESY}|{_ASKING}) )*+"
_TRAIL: Final = (
    rf"(?: (?:{_COURTESY}|here|right here|right there|there(?! (?:is|are|was|has)\b)|right|this (?:very )?(?:instant"
    rf"|second"
    r"|minute|moment)|instantly|straight away|directly|asap|fast|hard|as hard as you can|on the spot|where you are"
    r"|already|ok"
    r"|completely|dead|for me|will you|would you|can you|could you|thank you|thanks|you (?:idiot|fool|moron)|i mean it"
    rf"|do it|do you hear(?: me)?|{_CAR}|stop|halt|brake|break)(?= |$))*+"
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
    r"|help|call|open)\b"
    r"| before\b(?= it is too late))"
)
_STOP_CLAUSE: Final = re.compile(rf"^ (?P<lead>{_LEAD})(?P<stop>{_STOP})(?P<trail>{_TRAIL})(?: ?$|(?={_REASON}))")
_HOMOPHONE: Final = re.compile(
    rf"^ (?:{_COURTESY} )*+(?P<stop>break(?: break)*+)(?: (?:now|hard|please|break)(?= |$))*+ ?$"
)
_NEED: Final = re.compile(
    rf"^ (?:{_COURTESY} )*+(?:we|i) (?:really |just )?(?:must|should|have to|need to|have got to|got to|want to|better)"
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
    rf"^(?: {_COURTESY})*+ (?:if|when|whenever|unless|in case|once|as soon as|should (?:there|you|we|i))\b"
)


def _stops_in(line: str) -> list[tuple[int, str]]:
    """Where a line asks for a stop; what a sentence only supposes ("if ..., brake") asks for none."""
    found: list[tuple[int, str] | None] = []
    for sentence in re.finditer(r"[^.]+", line):
        if _SUPPOSED.match(sentence[0]) is None:
            found += [_stop_in(piece, sentence.start() + at) for piece, at in _pieces(sentence[0])]
    return [one for one in found if one is not None]


def _stop_in(piece: str, at: int) -> tuple[int, str] | None:
    """Where a stretch asks for a stop, and the words; None if it does not."""
    found = _STOP_CLAUSE.match(piece) or _HOMOPHONE.match(piece)
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
    return _ahead_in(piece, at)


# Somebody or something in the way: no question could be asked in time ------------------------------------------------

_SMALL: Final = (
    r"(?:child(?:ren)?|kids?|toddler|baby|boys?|girls?|pedestrians?|dogs?|cats?|deer|moose|elk|horses?|cows?|animals?"
    r"|boar|sheep"
    r"|fox|rabbit)"
)
_GROWN: Final = r"(?:man|woman|men|women|person|people|somebody|someone|guy|lady|cyclist|body)"
"""Whoever is ahead "in front of us" mostly sits in a car; on the road itself nobody does."""
_ROAD: Final = (
    r"(?:on|in|onto|into|across|over) (?:the|our|my|your) (?:middle of the )?(?:road|street|lane|way|path|highway"
    r"|motorway|freeway)"
)
_FRONT: Final = (
    rf"(?:{_ROAD}|in front of (?:us|you|the car|me)|ahead of us|(?:right|just|straight|directly) ahead|in the way"
    rf"|under the car)"
)
_DOES: Final = (
    r"(?: (?:is|are|just|right|directly|there|running|runs?|ran|walking|walks|lying|lies|standing|stands|sitting"
    r"|crossing|crosses"
    r"|jumped|jumping|stepp?ed|stepping|playing|coming|came|out|off|suddenly|wandering|crawling))"
)
_AHEAD: Final = re.compile(
    rf"^ (?:(?:{_COURTESY}|there (?:is|are)|(?:i|we) (?:can )?see|(?:that|it|this) is|stop|a|an|the|some|two|three|my"
    rf"|little|small"
    rf"|young|old|big|another) )*+(?:{_SMALL}{_DOES}{{0,5}} {_FRONT}|{_GROWN}{_DOES}{{0,5}} {_ROAD}"
    rf"|{_GROWN} (?:is )?(?:just |suddenly )?(?:lying|standing|walking|crossing|running|ran|jumped"
    rf"|stepped)(?: \w+){{0,2}} {_FRONT}"
    rf"|(?:{_SMALL}|{_GROWN}) (?:is |are )?(?:crossing|running out|ran out|jumped out|stepped out))\b"
)
_HITTING: Final = re.compile(
    r"\b(?:you|we) (?:are )?(?:going|about) to (?:crash|hit|run (?:\w+ ){0,3}over|kill (?:him|her|them|that|a|the)\b)"
)
_ONLY_TOLD: Final = re.compile(
    r"\b(?:if|when|whenever|until|unless|in case|might|may|could|would|was|were|had|saw|did|used to|yesterday|last"
    r"|ago|once|story"
    r"|film|movie|book|song|news|radio|imagine|suppose|is there|are there|watch for|look for|mind|beware|careful of"
    r"|sometimes|often"
    r"|always|never|(?:is|are) (?:no|not)|nobody|slower|slow|drive|driving|parked|car with|as there|like)\b|~"
)


def _ahead_in(piece: str, at: int) -> tuple[int, str] | None:
    found = _AHEAD.search(piece) or _HITTING.search(piece)
    if found is None or _ONLY_TOLD.search(piece) is not None:
        return None
    return at + found.start(), found[0].strip()


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
    rf"^(?: (?:[.,~]+|{_COURTESY}|{_STOP}|driving|moving|going|rolling|never mind|cancel(?: that)?|forget it|can you"
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
    """Whether nothing is left that a planner could be asked for."""
    rest = re.sub(r"~+", " ~ ", masked)
    return _FILLER.match(_GAPS.sub(" ", f" {rest.strip()}")) is not None


# Distress ------------------------------------------------------------------------------------------------------------

_SAFE: Final = re.compile(
    r"\b(?:stop|halt|pull (?:over|in|off)|park)(?: (?:the|this) car)?(?: please)?"
    r" (?:(?:at|in|on|near) (?:the )?(?:next|nearest|first|a|any|some) safe (?:place|spot|point|location|area)"
    r"|somewhere safe"
    r"|(?:when|where|wherever|as soon as|once|whenever) (?:it is |you )?(?:safe(?:ly)?(?: (?:to do so|can|possible))?"
    r"|safely can|can safely)"
    r"|as soon as (?:you can|possible|you (?:can )?safely (?:can)?)|safely)\b"
)
_GRAVE: Final = re.compile(
    r"\b(?:(?:there is|i (?:can )?(?:see|smell)|(?:see|smell)s?(?: like| of)?|is that|lots? of|so much|black|white"
    r"|filling with|full of)"
    r" (?:\w+ )?(?:smoke|flames|burning|(?:gas|petrol|fuel)(?! (?:stations?|pumps?|prices?)))"
    r"|smoke (?:is|in|from|under|out|coming|everywhere|inside|behind)"
    r"|(?:smell|smells|smelling|smelled) (?:of |like )?(?:\w+ )?(?:burning|burnt|smoke|fire|gas|petrol|fuel)"
    r"|burning smell|smell of fire|flames (?:are|coming|from|out|in|under)"
    r"|fire smell|on fire|caught fire|catching fire|(?:there is|a) fire (?:in|under|inside|here)|(?:something|engine"
    r"|car|seat|battery) (?:is )?(?:burning|smoking|on fire|in flames|overheating)"
    r"|(?:flat|burst|blown|punctured|bust|popped|lost) (?:out )?(?:(?:a|the|our|one of the|my) )?(?:\w+ )?(?:tyre"
    r"|tire|wheel)s?|(?:have|got|have got) a flat(?! (?:in|on|near|share))|(?:tyre|tire|wheel)s? (?:\w+ )?(?:is |are "
    r"|has |have |feels |just )*(?:flat|burst|blown|blew|punctured|popped"
    r"|exploded|gone flat|gone|coming off|come off|falling off|fell off|losing air)|puncture|blow ?out"
    r"|brakes (?:are |have |do |just )*(?:failed|failing|not work(?:ing)?|gone|fail)|brake failure|(?:something"
    r"|anything) is (?:badly |really |very )?wrong with (?:the|this|our) (?:car|engine|brakes?|steering|tyres?|tires?"
    r"|wheels?)|steering (?:wheel )?(?:is |does |has )?(?:shaking|locked|stuck|not work\w*|gone)|warning light"
    r"|can not see (?:anything|a thing)|lost my sight|broken? (?:my|his|her) (?:arm|leg|neck|hand|foot|rib)s?"
    r"|engine (?:has |is |just )*(?:died|dying|failed|failing|overheating)"
    r"|heart attack|(?:having|has|had) a stroke|cardiac arrest|chest (?:pains?|hurts?|is (?:tight|hurting|aching)"
    r"|feels tight|aches)"
    r"|(?:pains?|tightness|pressure) in (?:my|his|her|the) chest|(?:can not|can barely|can hardly|hard to"
    r"|struggling to|unable to|trouble|difficulty|could not) breath(?:e|ing)?"
    r"|not breathing|unconscious|passed out|passing out|fainted|collapsed|choking|seizure|convuls\w+|bleeding"
    r"|allergic (?:shock|reaction)|anaphyla\w+"
    r"|in labou?r|(?:baby is coming|water(?:s)? (?:just )?broke)|(?:call|need|get|send for|fetch) (?:me |us |him "
    r"|her )?(?:an? |the )?(?:ambulance|doctor|paramedics?|911|999|112|emergency services)"
    r"|medical emergency|(?:it|this) is an emergency|(?:we|i) have an emergency|having an emergency|dying here"
    r"|(?:my )?heart (?:is |has )?(?:racing|stopped|hurts?)"
    r"|stabbing pain|terrible pain|(?:so|too) much pain|in (?:agony|severe pain|terrible pain)|hypoglyc\w+|insulin)\b"
)
_UNWELL: Final = re.compile(
    r"\b(?:(?:i|we) (?:\w+ ){0,2}(?:feel|feeling|am|get|getting|going|think|start|starting)(?: \w+){0,3}?"
    r" (?:sick(?! (?:and tired )?of\b)|faint|dizzy|nauseous|nauseated|queasy|ill|unwell|woozy|light ?headed|weak"
    r"|carsick|giddy)"
    r"|(?:going|about|need|have|got|want) to (?:throw up|vomit|be sick|puke|faint|pass out|black out|collapse|hurl)"
    r"|(?:feel|feels|feeling|felt) (?:\w+ ){0,2}(?:sick(?! (?:and tired )?of\b)|faint|dizzy|nauseous|queasy|woozy"
    r"|light ?headed)"
    r"|(?:not|do not|does not) (?:feel|feeling)(?: \w+){0,2}? (?:well|good|great|right|ok)\b"
    r"|throwing up|vomiting|blacking out|getting blurry|(?:everything|head|world) is spinning|makes? me (?:sick|dizzy"
    r"|nauseous))\b"
)
_EMERGENCY_ALONE: Final = re.compile(
    r"^ (?:please |quick |hey |car )?(?:(?:emergency|mayday|sos|help us|help me|(?:i |we )?(?:need )?help|smoke"
    r"|fire)[., ]*+)++$"
)
_STOP_THAT: Final = re.compile(rf"^ (?:{_COURTESY} )*+(?:stop (?:it|that|this))(?: {_COURTESY}(?= |$))*+ ?$")
_SAID_WHAT_TO_DO: Final = re.compile(
    r"\b(?:hospital|clinic|doctor s|faster|hurry|speed up|step on it|quick(?:ly)? to|slow down|slower|slowly|ease"
    r"|easy|gentl[ey]|gentler"
    r"|smooth(?:er|ly)?|softer|careful(?:ly)?|calm(?:er|ly)?|overtake|pull over|lane|window|air|heating|less|more"
    r"|shoulder|get me to|get us to|take me|take us)\b"
)
_NO_DISTRESS: Final = re.compile(
    r"\b(?:if|unless|in case|yesterday|last (?:week|year|time|night|month|summer|winter)|ago|once had|used to|story"
    r"|film|movie|book|song|news|radio|imagine|suppose|joke"
    r"|no (?:smoke|fire|flames)|is there|never had|fire (?:engine|truck|brigade|department|station|fighters?)"
    r"|no longer|anymore|any more"
    r"|(?:no|not an?|without) (?:emergency|ambulance|doctor)|not (?:feel(?:ing)? )?(?:sick|dizzy|faint|ill|bleeding"
    r"|hurt|in pain|on fire|an emergency)|he was|she was|in (?:that|the) game|(?:his|her|their|other|that"
    r"|this) (?:car|truck|lorry|van|exhaust|engine|tyre|tire|bus)|car (?:ahead|in front|behind))\b"
)


def _distress_in(line: str) -> Emergency | None:
    safe = _SAFE.search(line)
    if (
        safe is not None
        and _NOT_TO_THE_CAR.search(line[: safe.start()].replace(" can ", " ").replace(" could ", " ")) is None
    ):
        return Emergency("safe_stop", safe[0])
    need = next((found for piece, _ in _pieces(line) if (found := _NEED.match(piece))), None)
    found = _GRAVE.search(line) or need or _EMERGENCY_ALONE.match(line) or _STOP_THAT.match(line)
    if found is not None:
        return None if _NO_DISTRESS.search(line) else Emergency("ask", found[0].strip())
    found = _UNWELL.search(line)
    if found is None or _NO_DISTRESS.search(line) or _SAID_WHAT_TO_DO.search(line):
        return None
    return Emergency("ask", found[0].strip())
