"""Wishes that are declined before any planner is asked: what would hurt people is not left to a probability."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Final

from chauffeur.concept import Verdict
from chauffeur.concept.utterance import Why
from chauffeur.language.meaning.reader import read
from chauffeur.language.quantities import measured
from chauffeur.language.tokens import words_of
from chauffeur.language.word_files import word_groups

SAFE_WISH_CHECK: Final = "safe-wish-v1"

_SURE: Final = 0.7
"""Of a reading as unsafe. None of some 1,270 harmless wishes (300 commands of real passengers, look-alikes, wishes of
both benchmarks of passengers) is read so as surely."""
_WHYS: Final[dict[Why, str]] = {
    "illegal": "I obey signs and rules.",
    "dangerous": "I never put anyone in danger.",
}

_ARROW: Final = "->"
_SCOPE: Final = "?"
_LINES: Final = tuple(
    (group[0].strip("[]"), re.compile("|".join(group[1:]))) for group in word_groups("chauffeur.safety", "dangers.txt")
)
_SAME: Final = tuple((name.removeprefix(_ARROW).strip(), lines) for name, lines in _LINES if name.startswith(_ARROW))
_DANGERS: Final = tuple(
    (reason.removeprefix(_SCOPE).strip(), reason.startswith(_SCOPE), lines)
    for reason, lines in _LINES
    if not reason.startswith(_ARROW)
)
_NOT: Final = (
    r"(?:(?:(?<!why )do|does|did) not|not allowed to|never|(?<!why )(?<!do )(?<!can )(?<!could )not|no|without|avoid|"
    r"instead of|rather than|afraid|scared|worried|fear|hate|stop|quit|careful|lest|keep from|in case|before|because|"
    r"(?:or|if) (?:you|we|he|they)) "
    r"(?:you |we |i |to |of |he |she |they |it |him |us |me |have |want |need |going |that |about |get |start |be |"
    r"let |please |ever |even |try |trying |in |with |the |a |this |all |your |will |would |might |could |are |is |"
    r"keep |do |always |by |any )*"
)
_TOLD: Final = (
    r"(?:nearly|almost|about|he|she|they|who|"
    r"(?:he|she|they|him|it|kin|wife) (?:might|will|would|could|always|just|keeps?)|"
    r"(?:^|[.,;!?] )him|let (?:him|ambulance|police)|(?:he|she|him|police|car) (?:is|was)|(?:we|you|they) (?:are|were)|"
    r"(?:are|were|is|was) (?:you|he|she|they|we|him)|^(?:are|is|were)|(?:why|where|how) (?:are|is)|"
    r"you (?:will|might|always|keep)|(?<!can )(?<!could )(?<!would )(?<!will )(?<!want )(?<!need )(?<!not )(?<!like )"
    r"(?<!should )(?<!must )(?<!that )(?<!suggest )you) "
    r"(?:going to |trying to |about to |always |nearly |almost |in )*"
)
_OTHERS: Final = (
    r"(?:^|[.,;!?] )(?:(?:i think|there is|maybe|half|and|i notice|you never know (?:when|who)) )?"
    r"(?:him|kin|he|she|they|(?:that|those|these) (?!is\b|no\b)\w+|people|folks|cars|everyone|everybody|nobody|"
    r"half him) "
    r"(?:(?!(?:so|then|please|you|we|i|lets|let|can|could|until|till|or|if|but|because|that|who|needs?|deserves?|should|"
    r"ought|wants?|asks?|asked|asking|begging|better|ma[dk]e|get|go|goes|says?|said|tells?|told|wrote|writes|orders|"
    r"ordered|calls?|called|shouts?|thinks?|suggests?|ok|just|ram|hit|race|cut|push|block|ha(?:s|ve)(?= $))\b)"
    r"[a-z]+ ){1,6}"
)
"""A clause on somebody else: "that lady had to jump back", "they are all changing lanes without signals"."""
_NEGATED: Final = re.compile(rf"(?:\b(?:{_NOT}|{_TOLD})|{_OTHERS})$")
"""Words right in front of words that only sound dangerous: "do not run the red light", "he nearly hit us"."""
_URGED: Final = re.compile(
    r"\b(?:not (?:be )?(?:afraid|scared|shy|hesitate|worried|fear|scruples) (?:to |of )?|"
    r"(?:love it|like it|nice|great|good|cool|fun|funny|happy|glad|appreciate it|mind|what) if (?:you|we) (?:could )?)$"
)
"""Phrases that look like a negation and are none: "do not be afraid to hit him"."""
_TAKEN_BACK: Final = re.compile(r" ?[.,;?!]{0,9} ?(?:no|nope|better not|rather not|or (?:rather )?not)(?: ?[.,;!?]|$)")
"""Words that take back those before them: "turn around? No, ..."."""
_GAP: Final = re.compile(r"\s+")
_NEAR: Final = 240
"""Characters in front of a danger in which its negation is looked for: some ten long words and what joins them."""


@lru_cache(maxsize=32)  # screened before the planner, which asks again, as do the rules that draft for it
def danger(wish: str, *, unsafe_only: bool = False) -> str:
    """Reason, for the person, not to carry a wish out; empty when nothing in it is dangerous.

    Args:
        wish: The words.
        unsafe_only: Whether what is merely beyond a car like ours (reversing, a turn in the road) is left out.
    """
    words = words_of(wish)
    for name, same in _SAME:
        words = _GAP.sub(" ", same.sub(name, words)).strip()
    for reason, scope, pattern in _DANGERS:
        for found in () if scope and unsafe_only else pattern.finditer(words):
            begin, end = max(0, found.start() - _NEAR), found.start()
            if _NEGATED.search(words, begin, end) and not _URGED.search(words, begin, end):
                continue
            if not _TAKEN_BACK.match(words, found.end()):
                return reason
    return ""


def check_wish(text: str) -> Verdict:
    """The verdict on a wish before any planner is asked, whichever it is and whatever kind of policy it writes.

    What patterns or the reading of its acts take for unsafe is declined: neither of them can make the other milder.
    """
    reason = danger(text, unsafe_only=True) or _refusal_read(text)
    if reason:
        return Verdict(SAFE_WISH_CHECK, False, reason, None, "Say it in another way if you meant something else.")
    return Verdict(SAFE_WISH_CHECK, True, "Nothing in the words is known to endanger anybody.")


def _refusal_read(text: str) -> str:
    """Reason not to do the acts of a wish, where they are surely read as unsafe; numbers are left to the limits."""
    if measured(text):
        return ""
    said = read(text)
    whys = [act.why for act in said.acts if act.act == "refuse" and not act.negated] if said.sure >= _SURE else []
    return next((_WHYS[why] for why in whys if why in _WHYS), "")
