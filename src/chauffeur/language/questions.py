"""Questions by their form, and words that end a session: what is said to the car and is no wish to be driven.

A question may still hide a wish ("why so slow?"). It is recognised here by its form alone, so that what is driven need
not end for it: asked at the wrong moment, "why are we standing?" must not become a new way.
"""

from __future__ import annotations

import re
from typing import Final

from chauffeur.language.tokens import words_of

ADDRESS: Final = r"^(?:(?:please|hey|ok|so|and|but|well|excuse me|sorry|car|chauffeur) ?,? ?)*"
"""Words before the sentence itself."""
_WE: Final = r"(?:i|we|you|he|she|they|there)"
_ANY: Final = r"(?:i|we|you|he|she|they|there|it|this|that|these|those|the|our|my|your|his|her|their|any\w*|some\w*)"
_FORM: Final = re.compile(
    r"(?:(?:and|but|so|or) )?(?:"
    rf"(?:am|is|are|was|were|does|did|has|had) (?:not )?{_ANY}\b|"
    rf"(?:do|have|shall|should|may|might|must|will|would) (?:not )?{_WE}\b|"
    r"(?:can|could|would|will) (?:it|this|that|these|those|the|he|she|they|anyone|anybody)\b|"
    r"(?:can|could|would|will|do|did) you (?:please )?(?:tell|say|see|hear|know|remember|explain)\b|"
    r"what\b|whats\b|which\b|who\b|whose\b|where (?:is|are|am|was|were|do|does|did|will|can|to)\b|where$|why\b|"
    r"how\b|when (?:is|are|was|were|do|does|did|will|can|should)\b|when$|"
    r"(?:tell (?:me|us)|i wonder) (?:what|which|who|where|why|how|when|if|whether)\b)"
)
"""Openings of a question; in English no order begins so."""
_DO_WITH_A_SIGN: Final = re.compile(rf"(?:do|have|shall|should|may|might|must|will|would) (?:not )?{_ANY}\b")
"""Begins an order as well ("do that again"): a question only with its sign."""
_REQUEST: Final = re.compile(
    r"(?:will|would) (?:not )?you\b(?! (?:be|know|say|tell|ever|still|always)\b)|"
    r"would it be (?:possible|ok|all right)\b|"
    r"(?:do|would) you mind\b|is (?:it possible|there (?:any |a )?(?:way|chance|possibility))\b|"
    r"are you able to\b|(?:what|how) about\b|what if\b|how (?:dare|would you like)\b|"
    r"why (?:do not|not|does not|would you|did not you)\b|do you think you (?:can|could)\b|shall (?:we|i) not\b"
)
"""Asks for something to be done, politely or not."""
_BESIDE: Final = re.compile(
    r"(?:please|hey|ok|so|and|well|excuse me|sorry|car|chauffeur|right|thanks|thank you|is it|is not it|are not we|"
    r"are we|do not you|um|er|hm+|oh|by the way|just asking|just curious)"
)
"""Stands beside a question and is none."""
_CLAUSE_ENDS: Final = re.compile(r"[.,;!?]")

_ACKNOWLEDGED: Final = re.compile(
    r"\A(?:(?:ok|okay|yes|yeah|yep|yup|sure|fine|good|great|nice|perfect|cool|lovely|super|thanks|thank you|cheers|"
    r"all right|alright|well done|good job|excellent|wonderful|brilliant|wow|oh|ah|aha|hm+|i see|got it|understood|"
    r"no problem|no worries|hello|hi|hey|car|chauffeur|very|so|much|a lot|then|it is)[ .,!]{0,3})+"
)
"""An answer, thanks or a greeting, and nothing to be done."""

_GOODBYES: Final = re.compile(
    r"\A(?:(?:ok|okay|right|so|well|please|now|and|thanks|thank you|hey|car|chauffeur) ?,? ?)*"
    r"(?::?q|quit|exit|end|bye|bye bye|goodbye|good bye|log out|logout|log off|sign off|see you|"
    r"(?:quit|exit|close|end|leave|finish|terminate|shut down|stop) (?:the |this |our )?"
    r"(?:session|program|programme|app|application|conversation|chat|talk|terminal)|"
    r"(?:i want to|i would like to|let us|lets|we can|you can) quit|"
    r"(?:i want to|i would like to|let us|lets|we can|you can) (?:exit|end|leave) (?:the |this |our )?session|"
    r"(?:quit|bye|bye bye|goodbye|good bye) (?:now|then|for now|for today|everyone|all))"
    r"(?: ?,? ?(?:please|thanks|thank you|car|chauffeur))*"
)
"""Leave is taken. "Exit now" is none: it may be the motorway's."""


def is_question(text: str) -> bool:
    """True if all of a text has the form of a question, and none of it that of a request.

    Args:
        text: What a person says.
    """
    words = re.sub(ADDRESS, "", words_of(text))
    clauses = [clause.strip() for clause in _CLAUSE_ENDS.split(words)]
    asked = [clause for clause in clauses if clause and not _BESIDE.fullmatch(clause)]
    signed = words.rstrip(" .!").endswith("?")
    return bool(asked) and all(
        (_FORM.match(clause) or (signed and _DO_WITH_A_SIGN.match(clause))) and not _REQUEST.match(clause)
        for clause in asked
    )


def said_aside(text: str) -> bool:
    """True if words are said beside the driving, a question or an acknowledgement, and take back nothing said before.

    Args:
        text: What a person says.
    """
    return is_question(text) or _ACKNOWLEDGED.fullmatch(words_of(text)) is not None


def ends_session(text: str) -> bool:
    """True if a person takes leave: `quit`, `exit`, `bye`. Nothing longer that could be a way to drive.

    Args:
        text: What a person says.
    """
    return _GOODBYES.fullmatch(words_of(text).strip(" .!,;?")) is not None
