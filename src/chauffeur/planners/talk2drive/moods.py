"""What words that name nothing to do say of the pace: a complaint about it, haste, or a wish for peace.

Only words: who says them and where is for others to weigh. They speak where the model's reading is empty or says the
opposite; what it understood otherwise stands.
"""

from __future__ import annotations

from typing import Final, Literal

from chauffeur.planners.talk2drive.patterns import any_of

Mood = Literal["hurry", "ease", ""]
HURRY: Final = "I'm in a hurry."
EASE: Final = "Drive calmly, please."


_MUCH: Final = r"(?:too|so|very|rather|pretty|quite|awfully|terribly|really|overly|a bit|a little|needlessly|this|that)"
_NEED_NOT: Final = (
    r"(?:no (?:need|reason|point)|(?:do not|don't|need not|needn't|not|never) (?:need|have|got)?)(?: to)?"
)
_TOO_SLOW: Final = any_of(
    rf"{_MUCH} (?:slow(?:ly)?|timid(?:ly)?|cautious(?:ly)?|hesitant(?:ly)?|careful(?:ly)?) (?:for|in|here|about"
    rf"|of you)",
    rf"(?:you(?:'re| are)?|we(?:'re| are)?|it(?:'s| is)|this is|why|be|drive|driving|going|so) (?:\w+ )?{_MUCH} "
    r"(?:slow(?:ly)?|timid(?:ly)?|cautious(?:ly)?|hesitant(?:ly)?|careful(?:ly)?)",
    r"be so (?:slow|careful|timid|cautious)",
    r"slower than",
    r"(?:hardly|barely|scarcely) (?:mov|roll)\w*",
    r"(?:we|you)(?:'re| are)? (?:just |only |still )?(?:crawl|creep|dawdl|plod|inch)\w*",
    rf"{_NEED_NOT} (?:crawl|creep|dawdle|tiptoe|hesitate)\w*",
    r"snail'?s?|tortoise|turtle|sunday driver|funeral|like (?:my |a |an old )?grand\w+",
    r"(?:walk|run|crawl)(?:ing)? (?:faster|quicker)|(?:faster|quicker) (?:on foot|by foot|walking)",
    r"(?:at|with) this (?:pace|speed|rate)|all (?:night|evening|afternoon)|take(?:s)? forever|falling asleep here",
    r"could have been (?:across|there|through|past|over)",
)
_TOO_FAST: Final = any_of(
    rf"{_MUCH} (?:fast|quick(?:ly)?|speedy)",
    r"(?:faster|quicker|more speed|more quickly) than (?:we|you|i|it|needed|necessary|usual|allowed)",
    r"(?:feels?|seems?|is|are|were|was|you are) (?:\w+ )?quick",
    r"(?:you(?:'re| are)|we(?:'re| are)|stop|quit|keep) (?:\w+ )?(?:rushing|racing|speeding|flying|tearing"
    r"|hurtling|zooming)",
    r"(?:as if (?:it were|this was|we were in)|like|in|not) a race|race ?track|racing driver|formula one",
    rf"{_NEED_NOT} (?:race|rush|hurry|speed)(?: \w+)?",
    r"what(?:'s| is) the (?:rush|hurry)|where(?:'s| is) the fire",
    r"fast (?:corner|turn|bend|curve)|too much speed|(?:that|this|so) much speed",
)
_CAREFUL_OF: Final = any_of(
    r"(?:people|kids|children|pedestrians?|toddlers?|families|someone|somebody|anyone)\b[^.!?]*\b(?:walk\w*|around|"
    r"step\w*|run\w*|play\w*|jump\w*|between|about|everywhere|cross\w*)",
)

_HASTE: Final = any_of(
    r"late|hurry|in a rush|asap|as soon as possible|behind schedule|overdue|deadline|no time|do(?:n't"
    r"| not) have all day",
    r"(?:waiting|waits?) (?:for (?:me|us)|at|in|outside|there|to)|expect(?:ing|ed|s)? (?:me|us)",
    r"(?:won't|will not|never|not|can't) (?:make it|wait|hold|be on time)|miss (?:my|the|our|this)",
    r"(?:starts?|begins?|boards?|leaves?|departs?|closes?|shuts?|opens?|due|sharp|on)(?: \w+)? (?:in|soon|at|any"
    r"|within|shortly|"
    r"before)",
    r"(?:starting|beginning|boarding|leaving|closing|over) (?:in|soon|at|any|now)|any (?:moment|minute|second)",
    r"about to (?:start|begin|leave|close|board|shut|depart)|already (?:started|begun|there)|(?:has"
    r"|have) (?:started|begun)",
    r"in (?:a|one|two|three|five|ten|fifteen|twenty|thirty|half|\d+|a few|less than)\b[^.!?]*\b(?:minutes?"
    r"|seconds?|hour)",
    r"minutes? (?:left|to go)|(?:nearly|almost|high|about) time|look at the (?:time|clock)|is that the time",
    r"should(?:'ve| have)? (?:been|be) (?:there|gone|at|home)|impatient|urgent(?:ly)?|emergency|in time|on time",
)
_NO_HASTE: Final = any_of(
    r"(?:no|not|n't|never|without|isn't|nobody|no one|not any) (?:\w+ ){0,3}(?:hurry|rush|late|waiting|deadline"
    r"|expect\w+|urgent)",
    r"no (?:hurry|rush)|plenty of time|all the time in the world|(?:lots of|enough) time|take (?:your|our) time"
    r"|early|day off|not before"
    r"|ahead of (?:time|schedule)",
)
_EASE: Final = any_of(
    r"asleep|sleep\w*|nap|snooz\w*|doz\w*|queasy|sick|nause\w*|dizz\w+|carsick|head ?ache|migraine|stomach|tummy"
    r"|hurts?|sore|aches?|injur\w+|nervous|anxious|uneasy|scared|frightened|worried|jumpy|tense|pounding|terrified",
    r"cup|coffee|tea|cake|eggs?|soup|vase|glass|full to the brim|spill\w*|on my lap|fragile",
    r"baby|infant|newborn|grand(?:ma|mother|child|son|daughter|pa|father)",
    r"relax\w*|unwind|quiet\w*|peace\w*|calm\w*|easy|enjoy\w*|scenery|view|landscape|read\w*|phone call|cruis\w+"
    r"|roll along",
    r"had an accident|better safe|pregnant|operation|surgery|stitches",
)


def pace_complaint(wish: str, *, in_lot: bool = False) -> Literal[-1, 0, 1]:
    """Whether words complain of the pace: 1 wants it faster, -1 slower.

    Args:
        wish: The words.
        in_lot: Among parked cars, where who is on foot is reason enough to slow down.
    """
    slow, fast = _TOO_SLOW.search(wish) is not None, _TOO_FAST.search(wish) is not None
    if slow != fast:
        return 1 if slow else -1
    return -1 if in_lot and not slow and _CAREFUL_OF.search(wish) else 0


def mood_of(wish: str) -> Mood:
    """What somebody is in who says this."""
    relieved = _NO_HASTE.search(wish) is not None
    pressed = not relieved and _HASTE.search(wish) is not None
    eased = relieved or _EASE.search(wish) is not None
    if pressed == eased:
        return ""
    return "hurry" if pressed else "ease"
