"""A scene for a labelled command on a highway: a lead vehicle, lanes and traffic as the world draws them.

All of its vehicles are cars without colours, so a command that tells one from another has no scene here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from chauffeur.concept import Scenario
from chauffeur.concept.utterance import Act, Event, Reference, ReferenceKind, Verb
from chauffeur.worlds.highway.scenarios import BUILT_IN

_ROADS: Final = {one.id: one for one in BUILT_IN}
_BY_VERB: Final[dict[Verb, str]] = {
    "turn": "intersection", "straight": "intersection", "pull_over": "emergency-lane", "pass": "overtake",
    "lane": "overtake", "follow": "following", "gap": "following", "yield": "following", "keep": "following",
    "speed": "cruise",
}  # fmt: skip
"""By the verb, the strongest first: `follow` needs a lead vehicle, which a road for lane changes has, too."""
_LEADS: Final[frozenset[ReferenceKind]] = frozenset({"car", "vehicle", "vehicles", "traffic"})
_PLACES: Final[frozenset[ReferenceKind]] = frozenset({"lane", "road", "me_here"})
_EVENTS: Final[frozenset[Event]] = frozenset({"clear", "slower", "closer", "further", "time"})


def highway_scenario(acts: Sequence[Act], name: str) -> Scenario | None:
    """The scenario of a labelled command; None where a highway or a crossing cannot stage it."""
    wanted = [act for act in acts if not act.purpose]
    verbs = {act.act for act in wanted}
    if not wanted or not verbs <= set(_BY_VERB) or not all(_fits(act) for act in wanted):
        return None
    road = next(road for verb, road in _BY_VERB.items() if verb in verbs)
    if road == "intersection" and len(wanted) > 1:
        return None  # one crossing, and no road behind it
    change = next((act for act in wanted if act.act == "lane"), None)
    if change is not None and (change.side == "right" or change.to == "rightmost"):
        road = "left-lane"
    return replace(_ROADS[road], id=f"realization-highway-{name}", wish="", title="")


def _fits(act: Act) -> bool:
    at_crossing = act.act in ("turn", "straight")
    if act.act == "lane" and (act.side is None and act.to not in ("leftmost", "rightmost", "original")):
        return False
    if act.target is not None and not _is_lead(act.target):
        return False
    if act.place is not None and act.place.ref is not None:
        places = {"junction", "stop_sign"} if at_crossing else _PLACES
        if act.place.ref.kind not in places or act.place.ref.ordinal not in (None, 1):
            return False
    if act.when is None:
        return True
    known = act.when.event in _EVENTS and act.when.type in ("once", "until", "while", "after", "if")
    ref = act.when.ref
    return known and (ref is None or ref.kind in _PLACES or _is_lead(ref))


def _is_lead(reference: Reference) -> bool:
    told = reference.colour or reference.side or reference.ordinal or reference.of or reference.name
    moves = reference.state in (None, "moving")
    return reference.kind in _LEADS and not told and moves and reference.where in (None, "ahead")
