"""The words in which an act's place and condition were said, and those of them by which these are known."""

from __future__ import annotations

from typing import Final

from chauffeur.concept.utterance import Act, ReferenceKind
from chauffeur.language.tokens import tokens_of

_OPENING_WORDS: Final = (
    "when whenever if once until till after before while unless as at by near behind beside past next in opposite "
    "through under from for into within away close provided"
)
_EMPTY_WORDS: Final = (
    "the a an that this these those my our your his her its their some any of to in on at by for with from as so when "
    "whenever if once until till after before while unless soon next near behind beside past through under into "
    "within close is are was has have had been it we you i he she they and then please just there here lane road "
    "street junction intersection crossing crossroads corner left right first second third ahead front light lights"
)
_OPENS: Final = frozenset(_OPENING_WORDS.split())
"""Words with which a place or a condition begins."""
_EMPTY: Final = frozenset(_EMPTY_WORDS.split())
"""Words by which no place and no condition is known, or which every world knows."""
_COMMON: Final[frozenset[ReferenceKind]] = frozenset((
    "junction", "light", "stop_sign", "lane", "road", "crosswalk", "end_of_road", "me_here", "car", "truck", "bus",
    "van", "motorcycle", "bicycle", "pedestrian", "vehicle", "vehicles", "pedestrians", "traffic", "parking_space",
))  # fmt: skip
"""References of a place that say which of what is on every road is meant."""


def circumstance_of(act: Act, text: str, *, whatever: bool = False) -> str:
    """The words in which an act's place or condition was said; empty where it has none but what every drive sees to,
    or with `whatever` none at all."""
    reference = None if act.place is None else act.place.ref
    place = reference is not None and (whatever or reference.kind not in _COMMON)
    goal = act.act == "goto" and act.target is not None
    waits = act.when is not None and not (act.when.event in ("clear", "told") and act.when.ref is None)
    if act.span is None or not (place or waits or goal):
        return ""
    said = text[act.span[0] : act.span[1]]
    for clause in said.split(","):
        words = clause.split()
        begins = next(
            (k for k, word in enumerate(words) if word.lower() in (_OPENS | {"to"} if goal else _OPENS)), None
        )
        if begins is not None and content_of(" ".join(words[begins:])):
            return " ".join(words[begins:]).strip(" .;!?")
    return said.strip(" .,;!?")


def content_of(words: str, *, whole: bool = False) -> frozenset[str]:
    """Words by which something is known, in lower case and without a plural's s; all of them where `whole`."""
    return frozenset(
        word.removesuffix("s") for word in tokens_of(words.lower()) if word.isalnum() and (whole or word not in _EMPTY)
    )
