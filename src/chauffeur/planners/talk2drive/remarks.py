"""What a remark on the road means to a driver who sees the same road: passengers comment more often than they command.

"He is crawling" asks to pass, behind a slower car with a lane beside it; "people behind us want to get by" asks for the
right lane; "nobody is coming" asks to go. The same words mean nothing where the road does not fit them, and what is
forbidden stays forbidden: a remark becomes a wish that passes every check.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from chauffeur.concept import Situation
from chauffeur.planners.talk2drive.patterns import any_of

OVERTAKE: Final = "Overtake the car ahead."
MOVE_RIGHT: Final = "Change to the right lane."
GO: Final = "Go straight on."
GIVE_WAY: Final = "Let the others go first."


@dataclass(frozen=True, slots=True)
class Remark:
    """A remark as it is taken.

    Attributes:
        wish: What it asks for, in words that can be read.
        because: What it was taken for, a full sentence.
    """

    wish: str
    because: str


_CONTENT: Final = any_of(
    "never mind", "(?:don't|do not|doesn't|does not) (?:mind|care|matter)", "no matter", "fine", "nice", "good",
    "happy", "comfortable", "pleasant", "no (?:hurry|rush|problem)", "i like",
)  # fmt: skip
_OTHER: Final = (
    r"(?:car|vehicle|truck|lorry|van|bus|camper|tractor|trailer|guy|driver|man|woman|lady|gentleman|fellow|chap"
    r"|dude|idiot"
    r"|one|he|him|she|her|they|them|this|that|it|somebody|someone|everybody|people|in front|ahead|before us)"
)
_NEED_NOT: Final = (
    r"(?:no (?:need|reason|point|sense|use)|(?:do not|don't|does not|doesn't|need not|needn't) (?:need|have|want)? ?"
    r"(?:us )?(?:to)?|why (?:do|are|should|must|would) we(?: have to)?|(?:tired|sick|bored|fed up|had enough"
    r"|enough) (?:of|with)"
    r"|(?:do not|don't|can't|cannot) (?:see|get|understand) why(?: we)?)"
)
_HANGS_BEHIND: Final = re.compile(
    rf"\b{_NEED_NOT}\b[^.!?]*\b(?:behind|following|in (?:his|her|their|its) (?:wake|shadow)|back of)\b", re.IGNORECASE
)
_SLOW: Final = (
    r"(?:slow(?!\s*(?:down|it|up|a bit|a little|please))\w*|crawl\w*|creep\w*|dawdl\w*|plod\w*|snail\w*|tortoise|turtle"
    r"|sleep(?:ing|y)|asleep|half the (?:speed|limit)|(?:under|below) the (?:speed )?limit|taking (?:his|her"
    r"|their) time)"
)
_ABOUT_THEM: Final = re.compile(
    rf"\b{_OTHER}\b[^.!?]*?(?:'s|\bis|\bare|\bgoes|\bdrives|\bkeeps|\bjust)?[^.!?]*\b{_SLOW}\b", re.IGNORECASE
)
_SUCH_A_SLOW: Final = re.compile(rf"\b(?:slow\w*|crawling|dawdling|creeping)\b[^.!?]*\b{_OTHER}\b", re.IGNORECASE)
_ABOUT_US: Final = re.compile(
    r"\b(?:you|your|you're|we|we're|us|our|i|i'd|let's|drive|go|please|could|can|would)\b", re.IGNORECASE
)
_DETAINED: Final = re.compile(
    r"\b(?:stuck|trapped|boxed in|caught|crawling|losing (?:\w+ ){0,2}time|wast\w+ (?:\w+ ){0,2}time"
    r"|sit(?:ting)?|hang(?:ing)?"
    r"|dawdling|creeping|for (?:ages|miles|hours|ever|minutes))\b[^.!?]*\bbehind\b"
    r"|\bbehind\b[^.!?]*\b(?:for (?:ages|miles|hours|ever|minutes|too long)|forever|all (?:day|the way))\b"
    r"|\b(?:hold\w*|slow(?:s|ing)|keep\w*) (?:us|me|everybody|everyone) (?:up|back|down)\b"
    r"|\bin (?:our|my|the) way\b",
    re.IGNORECASE,
)
_LEFT_FREE: Final = re.compile(
    r"\b(?:left|next|other|passing|fast|overtaking) lane\b[^.!?]*\b(?:empty|free|clear|open|nobody|no one|wide)\b"
    r"|\b(?:nobody|no one|nothing|empty|free|clear|room|space|open)\b[^.!?]*"
    r"\b(?:(?:left|passing|fast|overtaking) lane|(?:on|to) (?:the|our) left)\b",
    re.IGNORECASE,
)
_COMPLAINS_OF_PASSING: Final = re.compile(
    r"\b(?:no|not|n't|without|stop|enough|all this|all the|never|unnecessary|needless|dislike|hate)\b[^.!?]*"
    r"\b(?:overtak\w+|pass(?:ing)?|rac(?:e|ing)|chang\w+ lanes?|lane chang\w+|weav\w+)\b",
    re.IGNORECASE,
)

_LEFT_LANE: Final = re.compile(
    r"\b(?:passing|fast|faster|left(?:most|-hand)?|overtaking|outer|outside|inner|express|wrong) lane\b|\bout here\b"
    r"|\b(?:over|out|up) here on the (?:far )?left\b|\bhog\w*\b",
    re.IGNORECASE,
)
_TO_LEFT: Final = re.compile(
    r"\b(?:change|move|switch|go|get|take|merge|pull|shift|steer|use|head|return|back)\b[^.!?]*\b(?:left|passing|fast)\b"
    r"|^(?:please |just )*(?:stay|keep|remain|drive|continue)\b",
    re.IGNORECASE,
)
_OUT_OF: Final = any_of("out of", "off", "leave", "from", "away")
_BEHIND_US: Final = re.compile(
    r"\bbehind (?:us|me)\b|\btailgat\w*|\bflash\w*|\b(?:our|my) (?:tail|bumper|back)\b|\bhonk\w*"
    r"|\b(?:block|hold|obstruct|delay)\w*\b[^.!?]*\b(?:them|others|people|everybody|everyone|traffic|faster|cars"
    r"|drivers)\b"
    r"|\bin (?:their|his|her|everybody's|everyone's|people's) way\b"
    r"|\b(?:want|wants|trying|wish|wishes|like|likes) to (?:get )?(?:by|past|pass|go by|overtake us)\b"
    r"|\blet\b[^.!?]*\b(?:go by|by|past|pass|through|overtake)\b",
    re.IGNORECASE,
)
_RIGHT_FREE: Final = re.compile(
    r"(?<!all )\bright\b[^.!?]*\b(?:room|space|free|empty|clear|open|nobody|no one|gap|available)\b"
    r"|\b(?:room|space|free|empty|clear|open|nobody|no one|gap|nothing|available)\b[^.!?]*(?<!all )\bright\b"
    r"(?! (?:behind|ahead|there))",
    re.IGNORECASE,
)
_EXIT: Final = re.compile(
    r"\b(?:exit|turn-?off|off-?ramp|ramp)\b|\b(?:get|getting|come|coming|go|going) off (?:this|the|here)\b"
    r"|\bleav(?:e|ing) (?:this|the) (?:road|highway|motorway|freeway|interstate)\b",
    re.IGNORECASE,
)
_NOT_THAT_EXIT: Final = any_of("missed", "skip", "past", r"(?:don't|do not|not) (?:take|leave|get off|use)", "next but")

_NOBODY: Final = re.compile(
    r"\b(?:nobody|no[- ]?one|no (?:other )?(?:car|cars|traffic|vehicle|vehicles|one|soul)|not a (?:car|soul"
    r"|single)\b[^.!?]*"
    r"|(?:don't|do not|can't|cannot) see (?:any(?:body|one|thing| cars?| traffic)?|a (?:car|soul)))\b"
    r"|\b(?:road|street|crossing|junction|intersection|corner|way|coast|path|side|sides|it|it's|all|everything"
    r"|both|looks)\b"
    r"[^.!?]*\b(?:clear|empty|free|deserted|quiet|open)\b"
    r"|\b(?:far|miles|long way|ages|way) (?:away|off|back)\b|\b(?:plenty of|enough|lots of) (?:time|room|space) to "
    r"(?:cross|go|get)\b",
    re.IGNORECASE,
)
_WHEN_FREE: Final = re.compile(r"\b(?:when|once|as soon as|if|until|till|after|unless)\b", re.IGNORECASE)
_CROSSES: Final = re.compile(
    r"\b(?:cross|go|get|drive|keep|continue|carry|head|move|proceed|roll)\b[^.!?]*"
    r"\b(?:across|over|through|straight|swift\w*|quick\w*|brisk\w*|ahead)\b",
    re.IGNORECASE,
)
_WAITS: Final = any_of(
    "wait", "yield", "stop", "slow(?:ly)?", "brake", r"careful\w*", "first", "give way", "let", "hold"
)
_TURNS: Final = any_of("left", "right", r"turn\w*", "u-?turn")
_COMING: Final = re.compile(
    r"\b(?:com(?:e|es|ing)|approach\w*|crossing|arriv\w+|there (?:is|are)|here (?:is|are)|i (?:can )?see)\b[^.!?]*"
    r"\b(?:side|left|right|cars?|traffic|truck|somebody|someone|people|them|others?)\b"
    r"|\b(?:crowded|busy|packed|a lot of (?:traffic|cars)|heavy traffic|right of way|their turn|here (?:first"
    r"|before))\b"
    r"|\b(?:won't|will not|not going to|doesn't|don't|can't|cannot) (?:stop|brake|see|wait|slow)\b",
    re.IGNORECASE,
)


def taken_for(wish: str, situation: Situation) -> Remark | None:
    """What a remark asks for here; None where it is no remark on this road.

    Args:
        wish: The words.
        situation: Where the car is, and who is around it.
    """
    if situation.world == "highway":
        return _on_highway(wish, situation)
    return _at_crossing(wish) if situation.world == "intersection" else None


def _on_highway(wish: str, situation: Situation) -> Remark | None:
    leftmost = situation.lane_index == 0
    last = situation.lane_count - (2 if situation.emergency_lane else 1)
    if leftmost and situation.lane_index < last:
        said = _LEFT_LANE.search(wish) or _BEHIND_US.search(wish) or _RIGHT_FREE.search(wish)
        if said and not _COMPLAINS_OF_PASSING.search(wish) and not _asks_for_left(wish):
            return Remark(MOVE_RIGHT, "I take it that you do not want to be in the left lane.")
    if situation.lane_index < last and _EXIT.search(wish) and not _NOT_THAT_EXIT.search(wish):
        return Remark(MOVE_RIGHT, "Exits are on the right.")
    if leftmost or situation.front is None or _COMPLAINS_OF_PASSING.search(wish) or _CONTENT.search(wish):
        return None
    slow = (_ABOUT_THEM.search(wish) or _SUCH_A_SLOW.search(wish)) and not _ABOUT_US.search(_SIDE.sub("", wish))
    if slow or _DETAINED.search(wish) or _HANGS_BEHIND.search(wish) or _LEFT_FREE.search(wish):
        return Remark(OVERTAKE, "I take it that the car ahead is too slow for you.")
    return None


_SIDE: Final = any_of("in front of (?:us|me)", "ahead of (?:us|me)", "before (?:us|me)", r"hold\w* (?:us|me) up")
"""Speaks of us, and is about them."""


def _asks_for_left(wish: str) -> bool:
    return _TO_LEFT.search(wish) is not None and _OUT_OF.search(wish) is None


def _at_crossing(wish: str) -> Remark | None:
    if _CROSSES.search(wish) and not _WAITS.search(wish) and not _TURNS.search(wish):
        return Remark(GO, "You want to get across.")
    if _WHEN_FREE.search(wish) or _WAITS.search(wish):
        return None
    if _NOBODY.search(wish):
        return Remark(GO, "I take it that there is nobody to wait for.")
    if _COMING.search(wish):
        return Remark(GIVE_WAY, "I take it that others are to go first.")
    return None
