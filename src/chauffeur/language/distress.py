"""Distress of a person on board or of the car: fire, a tyre, a seizure; and the wish to stop where it is safe.

What is told of another time, of others' cars or of a film is no distress, and neither is a manner of speaking
("dying for a coffee").
"""

from __future__ import annotations

import re
from typing import Final

from chauffeur.language.plain_line import COURTESY

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
    r"|heart attack|(?:having|has|had) a stroke(?! of\b)|cardiac arrest"
    r"|chest (?:pains?|hurts?|is (?:tight|hurting|aching)"
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
_KIN: Final = (
    r"(?:husband|wife|partner|boyfriend|girlfriend|son|daughter|kids?|child|children|baby|brother|sister|mother|father"
    r"|mum|mom|mummy|mommy|dad|daddy|gran|granny|grandma|grandpa|granddad|grandad|grandmother|grandfather|nan|nana"
    r"|aunt|auntie|uncle|cousin|friend|mate|colleague|boss|neighbou?r|passenger|guest|man|woman|lady|boy|girl|guy)"
)
_PERSON: Final = (
    rf"(?:i|we|he|she|they|someone|somebody|(?:(?:my|our|the|his|her|this|your) )?(?:(?!not\b)\w+ )?{_KIN}(?: s)?)"
)
_STATE: Final = (
    r"(?: (?:is|are|am|was|has|have|had|just|got|getting|really|suddenly|completely|now|think|keeps?|still|been|being"
    r"|started|starting|to|be|also|both|lips|face|skin|fingers|tongue|hands))"
)
_BODY: Final = re.compile(
    rf"\b{_PERSON}{_STATE}{{0,6}} (?:"
    r"(?:turning|turned|going|gone|went|goes) (?:(?:all|very|completely|really|quite) )?(?:blue|purple|limp|floppy"
    r"|stiff|unconscious|gr[ae]y (?:in the face|and)|into (?:shock|cardiac))"
    r"|(?:blue|purple|unresponsive|out cold)(?= ?(?:[.,!]|in the face|$))"
    r"|having (?:(?:a|an|some|another|some kind of|severe|bad|massive|mild|panic|asthma|heart|allergic|epileptic) )"
    r"{0,3}"
    r"(?:fits?|strokes?(?! of\b)|attack|seizures?|overdose|reaction|aneurysm|miscarriage|spasms?|palpitations)"
    r"|overdos\w+|slumped|keeled over|keeling over|blacked out|convulsing|seizing|foaming|gagging|suffocating"
    r"|swallowed (?:a|an|some|his|her|the|my) (?!fly\b|lot\b|gum\b|pride\b)\w+"
    r"|(?:been|got|was) (?:shot|stabbed|poisoned|electrocuted|spiked)|poisoned"
    r"|(?:going|gone|went) into labou?r (?:right )?(?:here|now|in the (?:car|back|seat))"
    r"|(?:fell|fallen) out of the (?:car|door|window)"
    r"|losing (?:\w+ ){0,3}blood|coughing up blood|vomiting blood|spitting blood|in shock(?= ?(?:[.,!]|$))"
    r"|(?:attacking|strangling|stabbing|hurting) (?:me|us|him|her|someone|somebody)"
    r"|dying(?= ?(?:[.,!]|here\b|in here\b|please\b|help\b|$))"
    r"|not (?:breathing|responding|responsive|conscious|waking(?: up)?)"
    r"|stopped (?:breathing|responding)"
    r")\b"
    rf"|\b{_PERSON}{_STATE}{{0,3}} (?:will|does|can) not (?:respond|answer(?: me| us)?|wake(?: up)?|breathe"
    r"|(?:talk|speak)(?: (?:properly|clearly))?)(?= ?(?:[.,!]|and\b|$))"
)
"""A state of a person who is meant by a word for a person: "my husband's lips are going blue"."""
_LIMB: Final = r"(?:(?:left|right|whole|upper) ){0,2}(?:arms?|side|face|tongue|throat|neck|airway|lips|mouth|jaw)"
_GRAVER: Final = re.compile(
    r"\bcan (?:not|barely|hardly) (?:feel|move) (?:my|his|her) (?:(?:left|right|whole) )?(?:arms?|side)\b"
    rf"|\b(?:my|his|her|{_KIN}) {_LIMB} (?:(?:is|are|has|have|feels?|gone|going|went|started|all) ){{0,4}}(?:numb"
    r"|drooping|droops|paraly\w+|swelling|swollen|closing(?: up)?|tingling)\b"
    r"|\b(?:is|be|having) (?:a )?stroke\b(?! of\b)"
    r"|\bblood (?:is )?(?:coming|pouring|gushing|everywhere|all over)\b"
    r"|\b(?:so much|lots of|a lot of|pool of|covered in) blood\b|\b(?:shooting|shot) at (?:us|me)\b"
    r"|\b(?:filling (?:up )?with|full of) (?:\w+ )?fumes\b|\bfumes (?:in here|inside|everywhere)\b"
    r"|\bsparks? (?:(?:is|are) )?(?:coming|flying|shooting) (?:out|from|off|in)\b|\bsparking\b"
    r"|\bflames\b(?= ?(?:[.,!]|by|from|under|out|in the|$))"
    r"|\b(?:need|find|get|get me|grab) (?:my|his|her) (?:inhaler|epi ?pen)\b|\bkill (?:myself|himself|herself)\b"
    r"|\b(?:he|she|someone|somebody) has (?:got )?a (?:gun|knife|weapon)\b"
    r"|\b(?:car|our|back|rear|passenger|sliding) door (?:(?:is|has|just|came|flew|popped|swung) ){1,3}open(?:ed)?\b"
)
_UNWELL: Final = re.compile(
    r"\b(?:(?:i|we) (?:\w+ ){0,2}(?:feel|feeling|am|get|getting|going|think|start|starting)(?: \w+){0,3}?"
    r" (?:sick(?! (?:and tired )?of\b)|faint|dizzy|nauseous|nauseated|queasy|ill|unwell|woozy|light ?headed|weak"
    r"|carsick|giddy)"
    r"|(?:going|about|need|have|got|want) to (?:throw up|vomit|be sick|puke|faint|pass out|black out|collapse|hurl)"
    r"|(?:feel|feels|feeling|felt) (?:\w+ ){0,2}(?:sick(?! (?:and tired )?of\b)|faint|dizzy|nauseous|queasy|woozy"
    r"|light ?headed)"
    r"|(?:not|do not|does not) (?:feel|feeling)(?: \w+){0,2}? (?:well|good|great|right|ok)\b"
    r"|throwing up(?! (?:\w+ )?(?:stones?|gravel|dust|dirt|mud|spray|water))"
    r"|vomiting|blacking out|getting blurry|(?:everything|head|world) is spinning|makes? me (?:sick|dizzy"
    r"|nauseous))\b"
)
_EMERGENCY_ALONE: Final = re.compile(
    rf"^ (?:{COURTESY} )*?(?!please)(?:(?:emergency|mayday|sos|help us|help me|(?:i |we )?(?:need )?help|smoke"
    r"|fire|please)[., !]*+)++$"
)
_STOP_THAT: Final = re.compile(rf"^ (?:{COURTESY} )*+(?:stop (?:it|that|this))(?: {COURTESY}(?= |$))*+ ?$")
_SAID_WHAT_TO_DO: Final = re.compile(
    r"\b(?:hospital|clinic|doctor s|faster|hurry|speed up|step on it|quick(?:ly)? to|slow down|slower|slowly|ease"
    r"|easy|gentl[ey]|gentler"
    r"|smooth(?:er|ly)?|softer|careful(?:ly)?|calm(?:er|ly)?|overtake|pull over|lane|window|air|heating|less|more"
    r"|shoulder|get me to|get us to|take me|take us)\b"
)
_NO_DISTRESS: Final = re.compile(
    r"\b(?:if|unless|in case|what happens|do you know|practis\w+|drill|training|documentary|podcast|episode|survived"
    r"|(?:nearly|almost) (?:had|gave|got|died|choked|fainted)|what a|such a|gave (?:me|him|her|us|them)|of a bill|price"
    r"|in (?:19|20)\d\d|as a (?:child|kid|boy|girl)|when (?:i|he|she|they) was|(?:years?|months?|weeks?|days?) back"
    r"|yesterday|last (?:week|year|time|night|month|summer|winter)|ago|once had|used to|story"
    r"|film|movie|book|song|news|radio|imagine|suppose|joke"
    r"|no (?:smoke|fire|flames)|is there|never had|fire (?:engine|truck|brigade|department|station|fighters?)"
    r"|no longer|anymore|any more"
    r"|(?:no|not an?|without) (?:emergency|ambulance|doctor)|not (?:feel(?:ing)? )?(?:sick|dizzy|faint|ill|bleeding"
    r"|hurt|in pain|on fire|an emergency)|he was|she was|in (?:that|the) game|(?:his|her|their|other|that"
    r"|this) (?:car|truck|lorry|van|exhaust|engine|tyre|tire|bus)|car (?:ahead|in front|behind))\b"
)


def safe_stop_in(line: str) -> re.Match[str] | None:
    """Match of a request to stop at the next safe place; None if there is none."""
    return _SAFE.search(line)


def distress_in(line: str) -> str:
    """The words of a line that tell of distress; empty if it tells of none."""
    for pattern in (_GRAVE, _BODY, _GRAVER, _EMERGENCY_ALONE, _STOP_THAT):
        if (found := pattern.search(line)) is not None:
            return "" if is_only_told(line) else found[0].strip()
    found = _UNWELL.search(line)
    if found is None or is_only_told(line) or _SAID_WHAT_TO_DO.search(line):
        return ""
    return found[0].strip()


def is_only_told(line: str) -> bool:
    """True if a line speaks of distress at another time, of others or in a manner of speaking."""
    return _NO_DISTRESS.search(line) is not None
