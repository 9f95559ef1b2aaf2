"""Instructions in a town, on board: what is meant is learned, the ways to drive it are too, and the map decides.

The programs were learned on training routes by the feedback loop (`chauffeur bench coach --routes own`) and ship with
the package; what is recalled is checked against the junction ahead; a way or lane that is not there is refused in
words.
"""

from __future__ import annotations

import re
import time
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Final

from chauffeur.concept import Parameters, Plan, PlanRequest, Program, Situation
from chauffeur.describe.answers import DONT_KNOW, answer_to
from chauffeur.language.corrections import last_said
from chauffeur.language.emergency import SAFE_STOP_WISH
from chauffeur.memory.policies import PolicyRepository
from chauffeur.planners.arbitration import UNSURE_WORDS, asked, unanswered, undenied
from chauffeur.planners.base import NO_WISH, Planner, declined, planned
from chauffeur.planners.onboard.doubts import CAN_DO
from chauffeur.planners.onboard.town_intents import PLAIN_WISHES, TownIntent, intent_of
from chauffeur.planners.onboard.town_program import program_of
from chauffeur.planners.onboard.town_steps import (
    LANE_CHANGES,
    WORDS,
    TownStep,
    landmarks_in,
    speaks_to_somebody,
    steps_of,
)
from chauffeur.planners.onboard.understand import meanings_said
from chauffeur.planners.talk2drive.style import LOOK_AHEAD, destination_of
from chauffeur.programs.catalogue import vocabulary_of
from chauffeur.safety.dangers import danger

SNIPPETS: Final = Path(__file__).parent / "snippets"
"""The policy repository that comes with the package."""
_SIGN: Final = re.compile(
    r"\bat\s{1,3}(?:the|this)\s{1,3}(?:(?:next|first|second|third|fourth|fifth|junction with the)\s{1,3})?"
    r"(?:stop sign|stop|traffic light|lights?|signal)\b",
    re.IGNORECASE,
)
"""Directions to turn, not what to do about the sign."""
_TIME: Final = re.compile(r"\b(?:quarter|half|past|o'clock|noon|midnight|minutes?|hours?|time|least|once|all)\b")
"""What stands behind "at" or "for" and is no place."""
_CORRECTS: Final = re.compile(
    r"\b(?:sorry|no,|actually|hang on|scrap|rather|wrong|instead|forget|i mean)\b", re.IGNORECASE
)
_TO: Final = re.compile(r"\s{0,3}(?:(?:no|rather|please|now|then|better)[\s,]{1,3}){0,2}to\b", re.IGNORECASE)
"""Whoever begins so and names a place wants to go there."""
_MOST_WORDS: Final = 3
"""A longer name of a place has words of the sentence in it."""
_HOME: Final = re.compile(r"\b(?:home|my (?:place|house|flat))\b", re.IGNORECASE)
_ANYWHERE: Final = re.compile(r"\b(?:some|any)(?:where|place)\b|\b(?:some|any) place\b", re.IGNORECASE)
_NOTHING: Final = "I hear nothing in that for me to do, and change nothing. If I am to do something, please say what."
_UNSAFE: Final = f"I keep to the rules of the road and put nobody in danger. {CAN_DO}"
_NO_U_TURN: Final = (
    "I do not turn round on the street. Name a place or a street, and I find a way there; or say where to turn."
)
_WHERE: Final = "Where shall I take you? Name a place of this town, a church or a station for example."
_NO_HOME: Final = "I do not know where you live. Name a place or a street of this town, and I take you there."
_INTENTS: Final = {"unsafe": "refuse", "none": NO_WISH}
_HELP: Final = "I cannot call anybody. Shall I stop at the next safe place?"


@cache
def snippets() -> PolicyRepository:
    """The learned programs. Raises DataError where they are missing."""
    return PolicyRepository(SNIPPETS)


def town_destination(wish: str, meant: TownIntent | None = None) -> str:
    """The place that a wish in a town asks to be taken to; empty where it asks for none, or says a way or a lane.

    Args:
        wish: The words, as last corrected.
        meant: What they are after, where that is known.
    """
    meant = meant or intent_of(wish)
    goes = meant.kind == "goto"
    if any(one.manoeuvre in ("turn", "lane") for one in meanings_said(wish)) and not goes:
        return ""
    if meant.sure and meant.kind not in ("goto", "stop", "hurry", "uturn"):
        return ""
    named = landmarks_in(wish)
    place = "" if _ANYWHERE.search(wish) else destination_of(wish)
    if len(named) > 1 and goes and _CORRECTS.search(wish):
        return named[-1]
    if place and not _TIME.search(place) and not _HOME.search(place) and (not named or named[0] in landmarks_in(place)):
        return named[0] if len(place.split()) > _MOST_WORDS and named else place
    return named[0] if named and goes else ""


def driven_to(planner: Planner, place: str, request: PlanRequest, begun: float, later: str = "") -> Plan:
    """The plan to go to a place of the town, and what is said of a later one. The world refuses what it has not."""
    situation = request.context.situation
    limit, usual = situation.speed_limit_mps, LOOK_AHEAD["usual"]
    speed = round(min(limit, request.limits.most_mps(limit)), 2)
    words = f"You want to go to {_called(place)}. I take the way there, as fast as the signs allow."
    words += f" Tell me there when to go on to {_called(later)}." if later else ""
    policy = Parameters(speed, usual.distance_m, usual.ratio_s, 0, place)
    return planned(planner, words, policy, begun, intent="go_to")


def asked_plainly(request: PlanRequest, plan: Plan) -> PlanRequest | None:
    """The request to put in place of one in a town that was not understood, or only asked about; None for none.

    Where the whole sentence is surely of one kind, a question about a wish of that kind needs no yes, and what was not
    read becomes the ordinary wish of its kind.

    Args:
        request: The first one.
        plan: What came of it.
    """
    if plan.policy is not None or vocabulary_of(request.context.situation.world) != "town":
        return None
    meant = intent_of(last_said(request.instruction.text))
    if meant.surely("speed", "faster", "slower") and plan.offer:
        said = replace(request.instruction, text=plan.offer, confirmed=plan.refusal)
    elif meant.surely(*PLAIN_WISHES) and request.instruction.text != PLAIN_WISHES[meant.kind]:
        said = replace(request.instruction, text=PLAIN_WISHES[meant.kind])
    else:
        return None
    return replace(request, instruction=said)


def plan_in_town(planner: Planner, request: PlanRequest) -> Plan | None:
    """The plan for an instruction in a town; None where it is none of the kinds that were learned."""
    begun = time.perf_counter()
    if vocabulary_of(request.context.situation.world) != "town":
        return None
    said = last_said(request.instruction.text)
    meant = intent_of(said)
    if meant.surely("uturn") and not landmarks_in(said):
        return declined(planner, _NO_U_TURN, begun, intent="not there")
    if reason := danger(_SIGN.sub("", request.instruction.text)):
        return declined(planner, f"{reason} {CAN_DO}", begun, intent="refuse")
    if (plan := _declined(planner, said, meant, request.context.situation, begun)) is not None:
        return plan
    if (plan := _to_a_place(planner, said, meant, request, begun)) is not None:
        return plan
    if meant.surely(*PLAIN_WISHES, "speed"):
        return None  # a way of driving: no way to go
    if speaks_to_somebody(said) and not meant.surely("stop"):
        return _stop_asked(planner, begun)
    steps = steps_of(request.instruction.text, snippets(), meant)
    if not steps:
        if meant.likely and meant.kind == "goto":
            return declined(planner, _WHERE, begun, intent="ask")
        return _stop_asked(planner, begun) if meant.likely and meant.kind == "stop" else None
    first = steps[0]
    if not _kind(first) and meant.kind not in _GOES_ON:
        return None
    if len(steps) == 1 and first.out and first.place:  # "drop me off in front of the station"
        there = first.place
        question = "" if meant.likely and _fits(first, meant) else f"Shall I take you to {_called(there)}?"
        plan = driven_to(planner, there, request, begun)
        return _first_asked(planner, plan, question, f"Take me to {_called(there)}.", request)
    if words := _impossible(first, request.context.situation):
        return declined(planner, words, begun, intent="not there")
    near = [step.recalled for step in steps if step.recalled is not None]
    plan = planned(
        planner,
        _told(steps),
        Program(program_of(steps, said_again=request.instruction.source == "benchmark")),
        begun,
        intent="+".join(_intent(step) for step in steps),
        model=f"{planner.model}+snippets-{snippets().digest[:8]}",
        raw="; ".join(f"{one.entry.callable_name} ({one.similarity:.2f}): {one.entry.command}" for one in near),
    )
    plan = undenied(planner, plan, request, begun)
    shall_i, offer = _offered(first)
    whole = meant if len(steps) == 1 or meant.likely else intent_of(first.words)
    doubted = not (whole.likely and ((whole is meant and len(steps) > 1) or _fits(first, whole)))
    return _first_asked(planner, plan, shall_i if doubted else "", offer, request)


def _to_a_place(planner: Planner, said: str, meant: TownIntent, request: PlanRequest, begun: float) -> Plan | None:
    """The plan to go where words name a place, or the question which one; None where they want to go nowhere."""
    if there := town_destination(said, meant):
        later = next((one for one in landmarks_in(said) if one not in there), "") if meant.likely else ""
        later = "" if _CORRECTS.search(said) else later
        question = "" if meant.likely or _TO.match(said) else f"Shall I take you to {_called(there)}?"
        plan = driven_to(planner, there, request, begun, later)
        return _first_asked(planner, plan, question, f"Take me to {_called(there)}.", request)
    if meant.likely and _HOME.search(said) and meant.kind in ("goto", "go", "hurry", "uturn"):
        return declined(planner, _NO_HOME, begun, intent="ask")
    return declined(planner, _WHERE, begun, intent="ask") if meant.surely("goto") else None


def _called(place: str) -> str:
    """A place as it is spoken of: a kind of place with its article."""
    return f"the {place}" if landmarks_in(place) == (place,) else place


def _stop_asked(planner: Planner, begun: float) -> Plan:
    """The question whether to stop."""
    question, offer = _offered(TownStep("", out=True))
    return asked(planner, f"{UNSURE_WORDS} {question}", begun, offer=offer)


def _first_asked(planner: Planner, plan: Plan, question: str, offer: str, request: PlanRequest) -> Plan:
    """A plan, or the question whether it is meant, where there is one that is not answered yet."""
    words = f"{UNSURE_WORDS} {question}"
    if plan.policy is None or not question or not unanswered(request.instruction, words):
        return plan
    return replace(asked(planner, words, 0.0, offer=offer), latency_s=plan.latency_s)


_KINDS: Final = {
    "turn": ("turn",),
    "straight": ("straight", "go"),
    "lane": ("lane",),
    "stop": ("stop", "distress"),
}
"""Which intents fit what is to be done."""
_GOES_ON: Final = ("straight", "go", "yield", "wait", "turn", "lane")
"""Intents that are served by going on where nothing else is to be done."""


def _kind(step: TownStep) -> str:
    """Kind of a step: one of `_KINDS`; empty if it changes nothing."""
    if step.waits:
        return "wait"
    if step.out:
        return "stop"
    if step.turn:
        return "straight" if step.turn == "straight" else "turn"
    return "lane" if any(name in step.calls for name in LANE_CHANGES) else ""


def _fits(step: TownStep, meant: TownIntent) -> bool:
    """True if what was learned of whole sentences says the same as the step."""
    return meant.kind in _KINDS.get(_kind(step), (meant.kind,))


def _offered(step: TownStep) -> tuple[str, str]:
    """(how a step is asked about, the wish that a yes stands for); empty for one that changes nothing."""
    side = next((name.rpartition("_")[2] for name in LANE_CHANGES if name in step.calls), "")
    return {
        "stop": ("Shall I stop here, so that you can get out?", "Stop here, please."),
        "turn": (f"Shall I turn {step.turn} at the next junction?", f"Turn {step.turn} at the next junction."),
        "straight": ("Shall I go straight on?", "Go straight on at the next junction."),
        "lane": (f"Shall I change to the {side} lane?", f"Change to the {side} lane."),
    }.get(_kind(step), ("", ""))


def _declined(planner: Planner, said: str, meant: TownIntent, situation: Situation, begun: float) -> Plan | None:
    """The answer in words; None if there is something to drive."""
    if not meant.sure and not (meant.likely and meant.kind == "unsafe"):
        return None
    if meant.kind == "question":  # one clause of it may be answered
        told = (answer_to(clause, situation) for clause in re.split(r"[.,;!?]+", said))
        return declined(planner, next(filter(None, told), DONT_KNOW), begun, intent=NO_WISH)
    words = {"none": _NOTHING, "unsafe": _UNSAFE, "distress": _HELP}
    if meant.kind not in words:
        return None
    plan = declined(planner, words[meant.kind], begun, intent=_INTENTS.get(meant.kind, "ask"))
    return replace(plan, offer=SAFE_STOP_WISH, alarm="distress") if meant.kind == "distress" else plan


def _impossible(step: TownStep, situation: Situation) -> str:
    """Reason why a step cannot be done from here; empty if it can."""
    if step.place or step.nth > 1 or step.after_m is not None:
        return ""  # the junction that is meant may be another one
    if step.way and situation.turns and step.way not in situation.turns:
        ways = " or ".join(WORDS[turn] for turn in situation.turns)
        return f"No way leads {WORDS[step.way]} at the next junction; it leads {ways}."
    if step.turn and not situation.turns:
        return "There is no junction ahead of us."
    for name, side in LANE_CHANGES.items():
        if name in step.calls and not step.turn and not 0 <= situation.lane_index + side < situation.lane_count:
            return f"There is no lane to the {'left' if side < 0 else 'right'} of ours."
    return ""


def _intent(step: TownStep) -> str:
    if step.waits:
        return "wait"
    if step.out:
        return "stop"
    if step.turn:
        return "straight on" if step.turn == "straight" else f"way {step.turn}"
    return next(
        ("over " + ("left" if side < 0 else "right") for name, side in LANE_CHANGES.items() if name in step.calls), "on"
    )


def _told(steps: tuple[TownStep, ...]) -> str:
    parts: list[str] = []
    for step in steps:
        where = f" after {step.place}" if step.place else ""
        if step.waits:
            parts.append("I wait here until you tell me to go on")
        elif step.out:
            there = " before the next junction" if step.before_junction else f" at {step.place}" if step.place else ""
            far = "" if step.after_m is None else f" in {step.after_m:.0f} m"
            parts.append(f"I stop{there}{far}, so that you can get out")
        elif step.recalled is None:
            parts.append("I keep to the road" + ("" if step.after_m is None else f" for {step.after_m:.0f} m"))
        else:
            where += "" if step.after_m is None else f" in {step.after_m:.0f} m"
            where += f", at the junction number {step.nth} that leads there," if step.nth > 1 else ""
            parts.append(f'{step.words}: I drive{where} as I learned for "{step.recalled.entry.command}"')
    return "; then ".join(parts) + "."
