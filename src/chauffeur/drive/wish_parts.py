"""The parts of a wish beside the plan that was made of it: which of them the plan uses, and which it leaves out.

The parts come from `language.wanted`, which sees no plan. A plan says its acts in `intent`; where it says none, the
calls of its program stand for them. A planner that understood more acts than the rules is given the benefit: an act
with which no part agrees takes one that the rules cannot name.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from chauffeur.concept import ASKS, Parameters, Plan, Program, Result, Verdict
from chauffeur.concept.results import undriven
from chauffeur.drive.events import EventKind
from chauffeur.language.wanted import ActKind, WantedPart, WantedSide, read_wanted
from chauffeur.safety.constant_calls import read_program
from chauffeur.worlds.town.pack import PLACE_WORDS

_KINDS: Final[dict[str, ActKind]] = {
    "turn": "turn", "way": "turn", "straight": "turn", "lane": "lane", "over": "lane", "overtake": "overtake",
    "pull_over": "pull_over", "stop": "stop", "park": "park", "go_to": "go_to", "speed": "speed", "gap": "gap",
    "follow": "follow", "yield": "yield", "wait": "wait", "style": "style", "keep": "keep", "resume": "keep",
    "on": "keep",
}  # fmt: skip
"""First word of a part of `Plan.intent`, and the act it is."""
_CALLS: Final[dict[str, tuple[ActKind, WantedSide]]] = {
    "turn_left_at_next_intersection": ("turn", "left"),
    "turn_right_at_next_intersection": ("turn", "right"),
    "go_straight_at_next_intersection": ("turn", "straight"),
    "change_lane_left": ("lane", "left"),
    "change_lane_right": ("lane", "right"),
    "set_target_lane": ("lane", ""),
    "stop": ("stop", ""),
    "set_target_speed": ("speed", ""),
    "set_desired_time_headway": ("gap", ""),
}
_SERVES: Final[dict[ActKind, tuple[ActKind, ...]]] = {
    "turn": ("turn",),
    "lane": ("lane", "overtake", "pull_over"),
    "return": ("lane", "overtake", "go_to"),
    "overtake": ("overtake", "lane"),
    "pull_over": ("pull_over", "stop", "park", "go_to"),
    "stop": ("stop", "pull_over", "park", "go_to"),
    "park": ("park", "pull_over", "stop", "go_to"),
    "go_to": ("go_to", "park", "stop", "style"),
    "speed": ("speed", "style", "keep", "follow"),
    "gap": ("gap", "follow", "style", "yield"),
    "follow": ("follow", "gap", "keep", "lane"),
    "yield": ("yield", "gap", "speed"),
    "wait": ("wait",),
}
"""Acts of a plan that serve an act that is wanted. A mood, and going on, are served by whatever is driven."""
_ONCE_EACH: Final = frozenset(("turn", "go_to", "wait", "lane"))
"""Acts that are wanted as often as they are said; others may be said twice and wanted once."""


_SEEN: Final = ("turn", "lane", "return", "overtake", "pull_over", "stop", "speed", "gap")
"""Acts that a drive shows by itself: of a planner that does not tell what it understood, the judge says whether they
were done, and not the calls of its program."""


@dataclass(frozen=True, slots=True)
class PlannedAct:
    """An act of a plan, with its side; `detail` is the rest of its tag."""

    kind: ActKind
    side: WantedSide = ""
    detail: str = ""


def planned_acts(plan: Plan) -> tuple[PlannedAct, ...]:
    """The acts of a plan in their order, by its intent or else by the calls of its program."""
    if plan.intent:
        return tuple(_planned(tag) for tag in plan.intent.split("+") if tag)
    if isinstance(plan.policy, Program):
        found = [_CALLS[use.name] for use in read_program(plan.policy.source).uses if use.name in _CALLS]
        return tuple(PlannedAct(kind, side) for kind, side in dict.fromkeys(found))
    return ()


def _planned(tag: str) -> PlannedAct:
    kind, _, detail = tag.replace(".", " ", 1).partition(" ")
    side: WantedSide = "left" if detail == "left" else "right" if detail == "right" else ""
    if kind == "straight" or detail == "straight":
        side = "straight"
    return PlannedAct(_KINDS.get(kind, "other"), side, detail)


@dataclass(frozen=True, slots=True)
class WishAccount:
    """A wish held against a plan.

    Attributes:
        served: For each act of the plan the part of the wish that it serves; None where the rules name none.
        unused: Words of parts that the plan does not use, as said.
        defied: Words of parts that forbid what the plan does.
    """

    served: tuple[WantedPart | None, ...]
    unused: tuple[str, ...]
    defied: tuple[str, ...]


def account_of(wish: str, plan: Plan) -> WishAccount:
    """Which parts of a wish a plan uses. A plan without a policy uses all of it: it says why it drives nothing."""
    planned = planned_acts(plan)
    parts = read_wanted(wish)
    if plan.policy is None:
        return WishAccount((), (), ())
    served: list[WantedPart | None] = [None] * len(planned)
    left_out: list[WantedPart] = []
    for part in (one for one in parts if one.kind == "act" and not one.denied and one.act != "other"):
        place = _serving(part, planned, served)
        if place is not None:
            served[place] = served[place] or part
        elif part.act not in ("style", "keep", *(() if plan.intent else _SEEN)) and planned:
            left_out.append(part)
    spare = [k for k, part in enumerate(served) if part is None]
    for part in [*left_out, *(one for one in parts if one.kind == "act" and one.act == "other" and not one.denied)]:
        if spare and part.act == "other":
            served[spare.pop(0)] = part
        elif part not in left_out:
            left_out.append(part)
    known = _known_to(plan)
    unused = [one for one in parts if one in left_out or (one.kind != "act" and not _is_known(one, known))]
    defied = [one.words for one in parts if one.denied and one.kind == "act" and _does(one, planned)]
    told = tuple(dict.fromkeys(one.words for one in unused)) if plan.unused is None else plan.unused
    return WishAccount(tuple(served), told, tuple(defied))


TOLD_NOT_TO_CHECK: Final = "told-not-to-v1"


def check_told_not_to(wish: str, plan: Plan) -> tuple[Verdict, ...]:
    """A verdict on a plan that does what the words forbid ("don't let him in"); nothing on other plans."""
    defied = account_of(wish, plan).defied
    if not defied:
        return ()
    reason = f"You said “{defied[0]}”, and this plan would do it: it is not driven."
    return (Verdict(TOLD_NOT_TO_CHECK, False, reason, None, "Say what the car is to do instead."),)


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
        kind: The event that closed it, one of `drive.events.FINAL`.
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
    return Result.PARTLY_DONE if account_of(wish, plan).unused else Result.DONE


def _serving(part: WantedPart, planned: tuple[PlannedAct, ...], served: list[WantedPart | None]) -> int | None:
    """The act of a plan that serves a part: a free one of the same kind and side first."""
    kinds = (*_SERVES.get(part.act, ()), "other")  # a planner may call an act as nobody else does
    fits = [k for k, act in enumerate(planned) if act.kind in kinds]
    free = [k for k in fits if served[k] is None]
    for some in (free, [] if part.act in _ONCE_EACH else fits):
        ranked = sorted(some, key=lambda k: (planned[k].side != part.side, kinds.index(planned[k].kind), k))
        if ranked:
            return ranked[0]
    return None


def _does(part: WantedPart, planned: tuple[PlannedAct, ...]) -> bool:
    """Whether a plan does what a part forbids."""
    for act in planned:
        if part.act == "yield" and (act.kind == "yield" or (act.kind == "gap" and act.detail == "increase")):
            return True
        if part.act in ("turn", "lane", "overtake") and act.kind == part.act and act.detail not in ("keep", "return"):
            return not part.side or act.side == part.side
    return False


_KEEPS_OUT: Final = frozenset(("away", "far", "not", "avoid", "without"))
_SIGNS: Final = re.compile(r"[a-z]{2,40}|\d{1,6}")


def _known_to(plan: Plan) -> frozenset[str]:
    """Words of a policy: names of places in it, of calls and of numbers. Of a parking plan also its thoughts, which its
    planners put together from what they read."""
    texts = [plan.policy.text if isinstance(plan.policy, Program) else ""]
    if isinstance(plan.policy, Parameters):
        texts.append(plan.policy.route)
    if plan.intent.startswith("park"):
        texts.append(plan.thoughts.text)
    known = set(_SIGNS.findall(" ".join(texts).lower().replace("_", " ")))
    for kind, names in PLACE_WORDS.items():  # of a kind of place all its names
        if known.issuperset(kind.split("_")):
            known.update(word for name in names for word in _SIGNS.findall(name.lower()))
    return frozenset(known)


def _is_known(part: WantedPart, known: frozenset[str]) -> bool:
    if part.kind == "exclusion" and not known & _KEEPS_OUT:
        return False
    content = {word.removesuffix("s") for word in part.content}
    return bool(content & {word.removesuffix("s") for word in known})
