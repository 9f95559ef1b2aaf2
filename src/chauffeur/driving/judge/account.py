"""What of a wish a plan uses, what it leaves out, and what it would do though it was told not to.

A plan says its acts, or they are those of its intent and calls. What an unsure reading has beyond them is not told.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from chauffeur.concept import ASKS, ActionMatrix, Parameters, Plan, Program, Result, Verdict
from chauffeur.concept.results import undriven
from chauffeur.concept.utterance import Act, Utterance, Verb
from chauffeur.driving.events import EventKind
from chauffeur.driving.judge.acts import NOT_DRIVEN
from chauffeur.driving.judge.sources import SURE, acts_of, heard
from chauffeur.geometry.road_graph import TURNS
from chauffeur.language.meaning.circumstances import circumstance_of, content_of
from chauffeur.language.meaning.words import act_words
from chauffeur.worlds.town.pack import PLACE_WORDS

TOLD_NOT_TO_CHECK: Final = "told-not-to-v1"
_SPOT: Final = re.compile(r"[A-Z]{1,2}\d{1,3}")
"""A parking spot's own name: `B6`."""
_STYLES: Final = ("drive carefully", "drive as usual", "drive quickly")
"""Setting `style` of a plan of gains, in words."""
_STANDS: Final[frozenset[Verb]] = frozenset({"stop", "park", "pull_over", "goto"})
_SERVES: Final[dict[Verb, frozenset[Verb]]] = {
    "turn": frozenset({"turn", "straight"}), "straight": frozenset({"straight", "turn", "go", "keep", "speed"}),
    "lane": frozenset({"lane", "pass", "pull_over", "keep", "goto"}), "pass": frozenset({"pass", "lane"}),
    "avoid": frozenset({"avoid", "pass", "lane"}), "stop": _STANDS, "park": _STANDS, "pull_over": _STANDS,
    "goto": _STANDS, "follow": frozenset({"follow", "gap", "keep", "lane"}), "wait": frozenset({"wait"}),
    "speed": frozenset({"speed", "keep", "follow"}), "gap": frozenset({"gap", "follow", "speed", "yield"}),
    "yield": frozenset({"yield", "gap", "speed"}),
}  # fmt: skip
"""Acts of a plan that serve an act that is wanted; of verbs that do not stand here, any does."""
_ONCE_EACH: Final[frozenset[Verb]] = frozenset({"turn", "goto", "wait", "lane"})
"""Acts that are wanted as often as they are said; others may be said twice and wanted once."""


def unused_of(wish: str, plan: Plan) -> tuple[str, ...]:
    """Words of a wish that a plan does not use, as said. A plan without a policy uses all of it: it says why not."""
    if plan.policy is None:
        return ()
    if plan.unused is not None:
        return plan.unused
    reading, parks = heard(wish), plan.intent.startswith("park")
    if reading.sure < SURE and not parks:
        return ()
    claimed, known = plan.acts or acts_of(plan), known_to(plan)
    asked = [act for act in reading.acts if not act.purpose and act.act not in ("none", "unclear")]
    found = [act for act in asked if act.act == "refuse"]
    if claimed and reading.sure >= SURE:
        found += _unserved([act for act in asked if not act.negated and act.act != "refuse"], claimed)
    # A parking plan says in its thoughts by what it chose the spot: beside whom not to stand is known there or nowhere.
    told = [
        circumstance_of(act, wish, whatever=parks and act.negated) for act in asked if act not in (*found, *claimed)
    ]
    told += [wish[low:high] for low, high in reading.unused if _asks(heard(wish[low:high]))]
    parts = [words for words in told if words and not _is_known(content_of(words), known)]
    parts += [wish[act.span[0] : act.span[1]] for act in found if act.span is not None]
    return tuple(sorted(set(parts), key=lambda words: (wish.find(words), words)))


def understood_of(plan: Plan) -> tuple[str, ...]:
    """Things that a plan does, in plain words: its acts, the place that it leads to, or how it drives."""
    if isinstance(plan.policy, ActionMatrix):
        return tuple(words for style, words in enumerate(_STYLES) if dict(plan.settings).get("style") == style)
    if plan.acts or not isinstance(plan.policy, Parameters) or plan.policy.route in ("", *TURNS):
        return tuple(act_words(act).replace(" —", ",") for act in plan.acts or acts_of(plan))
    place = plan.policy.route.replace("_", " ")
    if plan.intent.startswith("park"):
        where = "in the nearest free spot" if place == "nearest" else f"near the {place}"
        return (f"park {f'in spot {place}' if _SPOT.fullmatch(place) else where}",)
    return (f"drive to the {place}",)


def _is_known(content: frozenset[str], known: frozenset[str]) -> bool:
    return bool(content & known) and ("away" not in content or "away" in known)


def _asks(reading: Utterance) -> bool:
    """Whether words that no act was read from ask for something by themselves: a remark asks for nothing."""
    return any(act.act != "none" for act in reading.acts)


def _unserved(asked: Sequence[Act], claimed: Sequence[Act]) -> list[Act]:
    """The acts that no act of a plan serves."""
    free, missing = list(claimed), list[Act]()
    for act in asked:
        kinds = _SERVES.get(act.act)
        fits = [one for one in free if kinds is None or one.act in kinds]
        fits.sort(key=lambda one: (one.act != act.act, one.side != act.side))
        if fits:
            free.remove(fits[0])
        elif (act.act in _ONCE_EACH and act.to != "original") or not any(
            kinds is None or one.act in kinds for one in claimed
        ):
            missing.append(act)
    return missing


def check_told_not_to(wish: str, plan: Plan) -> tuple[Verdict, ...]:
    """A verdict on a plan that does what the words forbid ("don't let him in"); nothing on other plans."""
    does = plan.acts or acts_of(plan)
    for act in heard(wish).acts:
        if not act.negated or act.act in NOT_DRIVEN or not any(_is_that(one, act) for one in does):
            continue
        words = wish if act.span is None else wish[act.span[0] : act.span[1]]
        reason = f"You said “{words}”, and this plan would do it: it is not driven."
        return (Verdict(TOLD_NOT_TO_CHECK, False, reason, None, "Say what the car is to do instead."),)
    return ()


def _is_that(does: Act, told: Act) -> bool:
    """Whether an act of a plan is the one that was forbidden."""
    if told.act == "yield" and does.act == "gap":
        return does.direction == "more"
    if does.act != told.act or does.negated or does.to == "original":
        return False
    return told.act in ("turn", "lane", "pass", "yield") and told.side in (None, does.side)


def known_to(plan: Plan) -> frozenset[str]:
    """Words of a policy: names of places in it, of calls and of numbers. Of a parking plan also its thoughts, which its
    planners put together from what they read."""
    texts = [plan.policy.text if isinstance(plan.policy, Program) else ""]
    texts += [plan.policy.route] if isinstance(plan.policy, Parameters) else []
    texts += [plan.thoughts.text] if plan.intent.startswith("park") else []
    known = set(content_of(" ".join(texts).replace("_", " "), whole=True))
    for kind, names in PLACE_WORDS.items():  # of a kind of place all its names
        if known.issuperset(kind.split("_")):
            known.update(word for name in names for word in content_of(name, whole=True))
    return frozenset(known)


_OF_EVENTS: Final[dict[EventKind, Result]] = {
    "answered": Result.DONE,
    "unplanned": Result.FAILED,
    "stale": Result.FAILED,
    "failed": Result.FAILED,
    "refused": Result.DECLINED,
    "superseded": Result.NOT_DONE,
    "interrupted": Result.NOT_DONE,
}


def result_of_event(kind: EventKind, wish: str, plan: Plan | None) -> Result:
    """What became of a wish in real time, where a drive is not judged: a program that has ended is done as far as the
    plan uses the wish.

    Args:
        kind: The event that closed it, one of `driving.events.FINAL`.
        wish: The words.
        plan: What was made of them, where anything was.
    """
    if kind == "answered" and plan is not None and plan.intent == ASKS:
        return Result.ASKED_BACK
    if kind in _OF_EVENTS:
        return _OF_EVENTS[kind]
    if plan is None:
        return Result.DECLINED if kind == "declined" else Result.DONE
    if plan.policy is None:
        return undriven(plan.intent, offer=bool(plan.offer))
    return Result.PARTLY_DONE if unused_of(wish, plan) else Result.DONE
