"""What people say of a drive, as a table: phrase -> topic and direction.

Signs are those of `Feedback`: speed -1 is "too fast", gap -1 "too close", comfort -1 "too harsh". A request carries the
sign of the complaint it answers: "slower, please" is -1 like "too fast". So a sign is also the direction of a wish, and
opposite wishes have opposite signs.
"""

from __future__ import annotations

from typing import Literal

Topic = Literal["speed", "gap", "comfort", "approval"]
Manner = Literal["complaint", "request", "remark", "aside", "opinion", "fixed", "plea", "nothing"]
"""How a phrase takes a negation, and what it weighs.

complaint: "not too fast" is none, but "do not drive too fast" asks for less.
request: "do not go faster" asks for the opposite.
remark: "really fast" is a complaint unless the drive is praised with it.
aside: "you were slow" is a complaint only after a turn: "fine, but you were slow".
opinion: "not good" is the opposite.
fixed: a complaint or opinion with the negation inside: "not fast enough".
plea: a request with the negation inside: "not so fast".
nothing: looks like one of the others and says nothing.
"""

_FAST = r"(?:fast|quick(?:ly)?|speedy|rapid(?:ly)?|hasty|hastily)"
_SLOW = r"(?:slow(?:ly)?|sluggish(?:ly)?)"
_CLOSE = r"(?:close(?:ly)?|near|tight)"
_GAP = r"(?:gap|distance|space|room|headway|clearance)"
_SO = r"(?:so|that|this|as|quite so)"
_VERY = (
    r"(?:so|this|that|very|really|pretty|quite|rather|awfully|uncomfortably|dangerously|slightly|somewhat|kind of|kinda"
    r"|sort of|(?:a |the )?(?:wee |tiny |little )?(?:bit|touch|tad|smidge|hair|notch|shade)|a little)"
)
_WAS = r"(?:was|were|is|are|felt|seemed)"
_ASIDE = rf"^(?:it|that|this|you|we|i|(?:the|this|that) (?:ride|drive|trip)) (?:{_WAS}|drove|went|got)"
_SO_FAR = r"(?= (?:for|on|in|at|to|when|before|after|there|here|today|again|sometimes)\b|$)"
_FOR_WHOM = r"(?= for\b|$)"
_MID = r"(?:[\w']+ ){0,3}"
_ROUGH = (
    r"(?:harsh(?:ly)?|hard|rough(?:ly)?|jerky|abrupt(?:ly)?|sudden(?:ly)?|aggressive(?:ly)?|sharp(?:ly)?|sporty|wild)"
)
_TIMID = (
    r"(?:timid|cautious(?:ly)?|careful(?:ly)?|hesitant|gentl[ey]|soft|conservative(?:ly)?|passive|tame"
    r"|defensive(?:ly)?)"
)

PHRASE_BOOK: tuple[tuple[Topic, Literal[-1, 1], Manner, tuple[str, ...]], ...] = (
    # Negations that are part of the phrase, and look-alikes, come first: what they match is used up.
    (
        "speed",
        1,
        "nothing",
        (rf"{_WAS} not (?:\w+ )?(?:so|that|very|really|particularly|all that) (?:{_FAST}|{_SLOW}|{_CLOSE})",),
    ),
    ("approval", 1, "fixed", (r"could not (?:be|have been) (?:better|happier|nicer|smoother)",)),
    ("speed", 1, "fixed", (rf"not {_MID}{_FAST} enough",)),
    ("speed", -1, "fixed", (rf"not {_MID}slow(?:ly)? enough",)),
    ("speed", -1, "plea", (rf"not (?:[\w']+ ){{0,6}}{_SO} {_FAST}",)),
    ("speed", 1, "plea", (rf"not (?:[\w']+ ){{0,6}}{_SO} {_SLOW}",)),
    ("gap", -1, "plea", (rf"not (?:[\w']+ ){{0,6}}{_SO} {_CLOSE}",)),
    ("gap", 1, "fixed", (rf"not {_MID}close enough",)),
    (
        "gap",
        -1,
        "fixed",
        (
            rf"not {_MID}far enough",
            rf"not {_MID}enough {_GAP}",
        ),
    ),
    (
        "speed",
        -1,
        "fixed",
        (
            r"did not slow down",
            r"did not brake",
        ),
    ),
    (
        "speed",
        1,
        "fixed",
        (
            r"did not speed up",
            r"did not accelerate",
        ),
    ),
    ("speed", -1, "plea", (rf"(?:no|not in a|not any|not a) {_MID}(?:hurry|rush)",)),
    ("comfort", -1, "fixed", (rf"not {_MID}(?:smooth|comfortable|comfortably|gentle|safe)",)),
    ("speed", 1, "nothing", (r"(?:not (?:only|just))",)),
    ("gap", -1, "complaint", (rf"{_GAP}(?: [\w']+){{0,4}} too (?:small|short|tight|little|narrow|close)",)),
    ("gap", 1, "complaint", (rf"{_GAP}(?: [\w']+){{0,4}} too (?:big|large|wide|long|much|great|far)",)),
    ("gap", -1, "complaint", (rf"too (?:little|small|short|narrow|tight) (?:of )?(?:a )?{_GAP}",)),
    ("gap", 1, "complaint", (rf"too (?:much|big|large|long|wide|great) (?:of )?(?:a )?(?:\w+ )?{_GAP}",)),
    ("gap", -1, "complaint", (rf"too (?:\w+ly )?{_CLOSE}",)),
    ("gap", 1, "complaint", (r"too far(?: behind| back| away| from)?",)),
    (
        "gap",
        -1,
        "complaint",
        (
            r"tailgat\w*",
            r"on (?:his|her|their|the|its) (?:bumper|tail)",
            r"bumper to bumper",
            r"breathing down",
            r"closer (?:\w+ ){0,4}than (?:i|we|my)",
        ),
    ),
    ("gap", 1, "complaint", (r"(?:further|farther) (?:\w+ ){0,4}than (?:i|we|my)",)),
    (
        "gap",
        -1,
        "request",
        (
            rf"more (?:\w+ )?{_GAP}",
            rf"(?:bigger|larger|longer|wider|greater) (?:\w+ )?{_GAP}",
            r"(?:further|farther) (?:back|away|behind|from)",
            r"keep (?:your|a|some|the|my) distance",
            r"back off",
            r"stay back",
            r"hang back",
            rf"(?:increase|widen|extend|enlarge) (?:the |your |my |our )?(?:\w+ )?{_GAP}",
            r"(?:drop|fall) back",
            rf"leave (?:him |her |them |us |me )?(?:some|a bit of|plenty of|a lot of|a little) {_GAP}",
        ),
    ),
    (
        "gap",
        1,
        "request",
        (
            rf"less (?:\w+ )?{_GAP}",
            rf"(?:smaller|shorter|tighter) (?:\w+ )?{_GAP}",
            rf"(?:reduce|decrease|shorten|close|narrow) (?:the |your |my |our )?(?:\w+ )?{_GAP}",
            r"close up",
            r"catch up",
            r"closer",
        ),
    ),
    ("gap", -1, "remark", (rf"{_VERY} {_CLOSE}",)),
    ("gap", -1, "aside", (rf"{_ASIDE} {_CLOSE}{_SO_FAR}", rf"^{_CLOSE}{_FOR_WHOM}")),
    (
        "speed",
        -1,
        "complaint",
        (
            rf"too (?:\w+ly )?{_FAST}",
            r"too much speed",
            r"(?:over|above) the (?:speed )?limit",
            r"speeding",
            r"racing",
        ),
    ),
    (
        "speed",
        1,
        "complaint",
        (
            rf"too (?:\w+ly )?{_SLOW}",
            r"crawl(?:ed|ing)?",
            r"snail(?:'s)?",
            r"dawdl\w+",
            r"sluggish",
        ),
    ),
    ("speed", -1, "complaint", (r"(?:faster|quicker) (?:\w+ ){0,3}than (?:i|we|my)",)),
    ("speed", 1, "complaint", (r"(?:slower|more slowly) (?:\w+ ){0,3}than (?:i|we|my)",)),
    ("speed", 1, "nothing", (rf"{_WAS} (?:\w+ ){{0,2}}(?:faster|quicker|slower|closer|smoother)",)),
    (
        "speed",
        -1,
        "request",
        (
            r"slower",
            r"slow (?:\w+ )?down",
            r"more slowly",
            r"less (?:speed|fast)",
            r"take it easy",
            r"take your time",
            r"ease off",
            r"decelerate",
            r"(?:reduce|decrease|lower|drop) (?:the |your |my |our )?(?:\w+ )?speed",
        ),
    ),
    (
        "speed",
        1,
        "request",
        (
            r"faster",
            r"quicker",
            r"more quickly",
            r"speed (?:\w+ )?up",
            r"more speed",
            r"hurry",
            r"rush",
            r"step on it",
            r"pick up the pace",
            r"accelerate",
            r"floor it",
            r"(?:increase|raise) (?:the |your |my |our )?(?:\w+ )?speed",
            r"as (?:fast|quick(?:ly)?) as",
            r"(?:be|am|are|running|run) late",
        ),
    ),
    ("speed", -1, "remark", (rf"{_VERY} {_FAST}",)),
    ("speed", 1, "remark", (rf"{_VERY} {_SLOW}",)),
    ("speed", -1, "aside", (rf"{_ASIDE} {_FAST}{_SO_FAR}", rf"^{_FAST}{_FOR_WHOM}")),
    ("speed", 1, "aside", (rf"{_ASIDE} {_SLOW}{_SO_FAR}", rf"^{_SLOW}{_FOR_WHOM}")),
    (
        "comfort",
        -1,
        "request",
        (
            rf"less {_ROUGH}",
            r"smoother",
            r"more smoothly",
            r"gentler",
            r"more gently",
            r"gently",
            r"softer",
            r"more softly",
            r"calmer",
            r"more (?:comfortabl[ey]|careful(?:ly)?|relaxed|cautious(?:ly)?|defensive(?:ly)?|conservative(?:ly)?)",
            r"be careful",
            r"drive carefully",
            r"brake (?:\w+ )?(?:earlier|sooner|softer)",
        ),
    ),
    (
        "comfort",
        1,
        "request",
        (
            r"more (?:aggressive|assertive|confident|decisive|dynamic)(?:al)?(?:ly)?",
            r"more (?:sporty|spirited)",
            rf"less {_TIMID}",
            r"sportier",
            r"bolder",
            r"brake (?:\w+ )?later",
        ),
    ),
    (
        "comfort",
        -1,
        "complaint",
        (
            rf"too (?:\w+ly )?{_ROUGH}",
            r"brak\w+ (?:\w+ )?(?:hard|late|suddenly|sharply)",
        ),
    ),
    (
        "comfort",
        1,
        "complaint",
        (
            rf"too (?:\w+ly )?{_TIMID}",
            r"hesitat\w+",
            r"hesitant",
            r"timid",
            r"overcautious",
            r"like (?:a |my )?grand(?:ma|mother|pa|father)",
        ),
    ),
    (
        "comfort",
        -1,
        "complaint",
        (
            r"jerk(?:y|ed|ing|s)?",
            r"abrupt(?:ly)?",
            r"harsh(?:ly)?",
            r"rough",
            r"bumpy",
            r"lurch\w*",
            r"slam\w*",
            r"reckless\w*",
            r"aggressive(?:ly)?",
            r"(?:motion |car)?sick\w*",
            r"nause\w+",
            r"queasy",
            r"dizzy",
            r"scar(?:ed|y|ing)",
            r"afraid",
            r"frighten\w*",
            r"nervous",
            r"unsafe",
            r"dangerous(?:ly)?",
            r"uncomfortabl[ey]",
            r"terrif\w+",
            r"stressful",
            r"stressed",
            r"uneasy",
            r"panic\w*",
        ),
    ),
    (
        "approval",
        1,
        "nothing",
        (r"(?:would|might|may) (?:be (?:\w+ )?(?:nice|good|great|better|perfect|fine|happy)|like|love)",),
    ),
    (
        "approval",
        1,
        "opinion",
        (
            r"just right",
            r"spot on",
            r"perfect(?:ly)?",
            r"flawless(?:ly)?",
            r"excellent",
            r"great",
            r"awesome",
            r"amazing",
            r"wonderful",
            r"fantastic",
            r"brilliant",
            r"superb",
            r"lovely",
            r"nice(?:ly)?",
            r"good",
            r"well done",
            r"loved?",
            r"liked",
            r"enjoy(?:ed)?",
            r"happy",
            r"pleased",
            r"satisfied",
            r"comfortabl[ey]",
            r"ideal",
            r"fine",
            r"okay",
            r"ok",
            r"relaxing",
            r"smooth(?:ly)?",
            r"keep it up",
            r"same again",
            r"(?:was|is|felt|much|even) better",
            r"i (?:really |do |did )?like (?:it|that|this|how|the)",
            r"exactly (?:right|how|what|as|like)",
            r"as it was",
        ),
    ),
    (
        "approval",
        -1,
        "opinion",
        (
            r"hated?",
            r"terribl[ey]",
            r"horribl[ey]",
            r"awful",
            r"bad(?:ly)?",
            r"worse",
            r"worst",
            r"disliked?",
            r"annoy(?:ed|ing)",
            r"disappoint(?:ed|ing)",
        ),
    ),
    (
        "approval",
        -1,
        "fixed",
        (
            r"never again",
            r"unacceptable",
            r"poor(?:ly)?",
            r"ridiculous",
            r"not like (?:it|that|this|how|the)",
        ),
    ),
)
