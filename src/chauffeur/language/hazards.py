"""Something in the car's way, as it is called out: there is no time to ask a question.

Two manners are read: a sentence that says what stands where ("a child on the road"), and a mere name that is all there
is to the words, and is called out, said twice or said with a warning ("Deer!", "watch out, a moose"). Words that go on
about an animal are no warning of it.
"""

from __future__ import annotations

import re
from typing import Final

from chauffeur.language.plain_line import COURTESY

_ANIMAL: Final = (
    r"(?:dogs?|puppy|cats?|kitten|deer|moose|elk|reindeer|horses?|pony|ponies|donkey|cows?|cattle|bull|sheep|lambs?"
    r"|pigs?|boars?|fox(?:es)?|rabbits?|hare|badger|bears?|wolf|wolves|kangaroo|ducks?|geese|goose|swans?|animals?)"
)
_CHILD: Final = r"(?:child(?:ren)?|kids?|toddlers?|schoolchildren|pedestrians?|baby|boys?|girls?)"
_RIDER: Final = r"(?:cyclists?|bikers?|motorcyclists?|joggers?|runners?|skaters?|pram|pushchair|wheelchair)"
_SMALL: Final = rf"(?:{_ANIMAL}|{_CHILD})"
_GROWN: Final = rf"(?:{_RIDER}|man|woman|men|women|person|people|somebody|someone|guy|lady|body)"
"""Whoever is ahead "in front of us" mostly sits in a car; on the road itself nobody does."""
_THING: Final = (
    r"(?:trees?|branch(?:es)?|trunk|log|rocks?|stones?|boulders?|ladder|sofa|couch|mattress|pallets?|tyres?|tires?"
    r"|debris|rubble|cargo|boxes|crates?|trailer|caravan|obstacle|obstruction|wreck(?:age)?|cables?|wires?|pylon"
    r"|landslide|mudslide|avalanche|sinkhole|something)"
)
_VEHICLE: Final = r"(?:car|truck|lorry|bus|van|bike|motorbike|motorcycle|train|tram|tanker|tractor)"
_ROAD: Final = (
    r"(?:all over|on|in|onto|into|across|over) (?:the|our|my|your) (?:middle of the )?(?:road|street|lane|way|path"
    r"|highway|motorway|freeway|carriageway|track|tarmac|autobahn)"
)
_FRONT: Final = (
    rf"(?:{_ROAD}|in front of (?:us|you|the car|me)|ahead of us|(?:right|just|straight|directly) ahead|in the way"
    rf"|under the car)"
)
_DOES: Final = (
    r"(?: (?:is|are|has|have|just|right|directly|there|running|runs?|ran|walking|walks|lying|lies|standing|stands"
    r"|sitting|crossing|crosses|jumped|jumping|stepp?ed|stepping|darted|darting|playing|coming|came|out|off|down"
    r"|suddenly|wandering|crawling|fell|fallen|got loose|loose))"
)
_POINTED: Final = (
    rf"(?:{COURTESY}|there (?:is|are)|(?:i|we) (?:can )?see|(?:that|it|this) is|stop|a|an|the|some|another|two|three"
    r"|four|my|little|small|young|old|elderly|big|huge|giant|fallen|loose|stray|wild|whole|lots of)"
)
_AHEAD: Final = re.compile(
    rf"^ (?:{_POINTED} )*+(?:{_SMALL}{_DOES}{{0,5}} {_FRONT}|{_GROWN}{_DOES}{{0,5}} {_ROAD}"
    rf"|{_GROWN} (?:is )?(?:just |suddenly )?(?:lying|standing|walking|crossing|running|ran|jumped"
    rf"|stepped)(?: \w+){{0,2}} {_FRONT}"
    rf"|(?:{_SMALL}|{_GROWN}) (?:is |are )?(?:crossing|(?:running|ran|jumped|stepped) out(?! of))"
    rf"|(?:{_SMALL}|{_GROWN}) (?:(?:is|are|has|have|just|suddenly) )++(?:running|ran|run|jumped|stepped|darted|darting)"
    r" out(?! of)"
    rf"|(?<= a )(?:{_SMALL}|{_RIDER}) run out(?! of)"
    rf"|(?:{_SMALL}|{_GROWN}) (?:(?:has|have|just) )*+(?:fell|fallen) off (?:his|her|their|the|a)"
    r" (?:bike|bicycle|scooter|motorbike|skateboard)"
    r")\b"
)
_BLOCKED: Final = re.compile(
    rf"^ (?:{_POINTED} )*+(?:{_THING}{_DOES}{{0,5}} {_ROAD}"
    rf"|{_VEHICLE}(?: (?:in front|ahead|of us|is|has|just|suddenly)){{1,6}} (?:jackknif\w+|overturn\w*|rolling over"
    rf"|flipp\w+|crash(?:ed|ing))"
    rf"|(?:wrong way|ghost) driver(?= ?(?:ahead|coming|$))"
    rf"|{_VEHICLE} (?:\w+ ){{0,3}}(?:straight|right|directly|head on) (?:at|towards?|for|into) us)\b"
)
_HITTING: Final = re.compile(
    r"\b(?:you|we) (?:are )?(?:going|about) to (?:crash|collide|die(?! (?:of|for|to)\b)"
    r"|hit (?!(?:the )?(?:road|motorway|highway|town|traffic|rush|beach|city|shops|pub|gym)\b)"
    r"|run (?:\w+ ){0,3}over|kill (?:him|her|them|that|a|the)\b)"
)
_ONLY_TOLD: Final = re.compile(
    r"\b(?:if|when|whenever|until|unless|in case|might|may|could|would|was|were|had|saw|did|used to|yesterday|last"
    r"|ago|once|story"
    r"|film|movie|book|song|news|radio|imagine|suppose|is there|are there|watch for|look for|mind|beware|careful of"
    r"|sometimes|often|afraid|scared|worried"
    r"|always|never|(?:is|are) (?:no|not)|nobody|slower|slow|drive|driving|parked|car with|as there|like)\b|~"
)
_ANOTHER_WISH: Final = re.compile(
    r"\b(?:turn|pull|move|follow|park|lane|change|overtake|pass|wait for|continue|go (?:straight|around|round)"
    r"|more (?:room|distance)|use the|let (?:him|her|them|it))\b"
)
"""Actions about a thing that lies ahead, where that is said."""

_EASY: Final = rf"(?:{_ANIMAL}|child|toddlers?|pedestrians?|{_RIDER}|{_THING}|red light|stop sign)"
_ALARM: Final = r"(?:(?:look|watch) out|mind|careful|beware|stop|brake)"
_CALLED: Final = re.compile(
    rf"^ (?:(?:{COURTESY}|{_ALARM}|there (?:is|are)|it is|a|an|the|that|some|another|two|three|big|huge|giant|little"
    rf"|small|old|young|fallen|loose|stray|wild|{_EASY}(?= |$)) )*+"
    r"(?:(?:ahead|in front|right there|over there|coming|crossing|everywhere|on the (?:left|right)) ?)*+$"
)
"""A mere name, and nothing but what is called out around it."""
_NAMED: Final = re.compile(rf" {_EASY}(?= |$)")
_SOMEBODY: Final = re.compile(
    rf"^ (?:{COURTESY} )*?{_ALARM} (?:(?:for|of) )?(?:there is )?(?:him|her|them|(?:the|that|this|a|an|some)"
    rf" (?:\w+ ){{0,2}}?(?:{_EASY}|man|woman|lady|guy|boy|girl|baby|kids?|children|person|people|{_VEHICLE})) $"
)
"""Somebody, with a warning and a word that points: "mind the kid", "look out for that man"."""
_WARNED: Final = re.compile(rf" (?:look|watch) out (?:(?:there is )?(?:a|an|the|that) )?{_EASY} $")
_LOOK_OUT: Final = re.compile(rf"^ (?:{COURTESY} )*?(?:look|watch) out (?:{COURTESY} )*+$")
_WHOA: Final = re.compile(r"^ (?:wh?oah? ){3}(?:wh?oah? )*+$")
_GONE: Final = re.compile(
    rf"^ (?:{COURTESY} )*+(?:(?:the|our|that|this) )?(?:(?:bridge|road|street|tunnel|lane) (?:(?:is|has|just) ){{0,3}}"
    r"(?:out|gone|ends|ended|collaps\w+|caved in|missing|washed away)|(?:it|lights?) (?:is|are|went|turned) red"
    r"|(?:he|she|it|they|car|truck|lorry|bus|van) (?:is|are) (?:coming|heading|driving) (?:\w+ )?(?:at|towards?|for) us"
    r"|(?:you|we) will (?:hit|kill) \w+|wrong way) $"
)
_TWICE: Final = re.compile(rf"(?:^| )(?P<one>{_EASY}) (?P=one)(?: |$)")
_SIGNS: Final = re.compile(r"[.,! ]+")


def hazard_in(piece: str, sentence: str) -> re.Match[str] | None:
    """Match of a hazard in a stretch of a line; None if there is none.

    Args:
        piece: A stretch between two signs, a space around it.
        sentence: Its sentence: what is to be done about a thing that lies there may follow.
    """
    found = _AHEAD.search(piece) or _HITTING.search(piece)
    if found is None and _ANOTHER_WISH.search(sentence) is None:
        found = _BLOCKED.search(piece)
    return None if found is None or _ONLY_TOLD.search(piece) is not None else found


def called_out(line: str) -> str:
    """The words of a line that are nothing but a hazard called out; empty if they are anything else."""
    words = f" {_SIGNS.sub(' ', line).strip()} "
    exclaimed = "!" in line
    if exclaimed and any(pattern.match(words) is not None for pattern in (_SOMEBODY, _LOOK_OUT, _GONE)):
        return words.strip()
    if _WHOA.match(words) is not None:
        return words.strip()
    if _CALLED.match(words) is None or _NAMED.search(words) is None:
        return ""
    called = exclaimed or any(pattern.search(words) is not None for pattern in (_TWICE, _WARNED))
    return words.strip() if called else ""
