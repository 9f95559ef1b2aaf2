"""Instructions in a town, on board: the learned program that is nearest in meaning, put together with places and stops.

The programs were learned on training routes by the feedback loop (`chauffeur bench coach-town`) and ship with the
package; what is recalled is checked against the junction ahead; a way or lane that is not there is refused in words.
"""

from __future__ import annotations

import re
import time
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Final

from chauffeur.concept import Parameters, Plan, PlanRequest, Program, Situation, Thoughts
from chauffeur.language import measured, read_quantities, tokens_of
from chauffeur.language.corrections import last_said
from chauffeur.language.denials import denied_words
from chauffeur.memory.policies import PolicyRepository, Recalled
from chauffeur.planners.arbitration import undenied
from chauffeur.planners.base import Planner, declined
from chauffeur.planners.onboard.dangers import danger
from chauffeur.planners.onboard.doubts import CAN_DO
from chauffeur.planners.onboard.understand import meanings_said
from chauffeur.planners.talk2drive.style import LOOK_AHEAD, destination_of
from chauffeur.programs.catalogue import vocabulary_of
from chauffeur.safety.constant_calls import read_program
from chauffeur.worlds.town.recipes import PLACE_KINDS

SNIPPETS: Final = Path(__file__).parent / "snippets"
"""The policy repository that comes with the package."""
NEAR: Final = 0.12
"""What is less like every learned instruction is none of the town's."""
NEIGHBOURS: Final = 50
"""So many are looked through for one that goes the way the words say."""
_SIDES: Final = ("left", "right")
_STANDS: Final = ("stop", "pull_over")
_JUNCTION: Final = frozenset(
    ("junction", "intersection", "crossing", "crossroads", "corner", "light", "lights", "signal")
)
_ORDINALS: Final = {"second": 2, "2nd": 2, "third": 3, "3rd": 3, "fourth": 4, "4th": 4, "fifth": 5, "5th": 5}
_MOST_JUNCTIONS: Final = 9
_STOPS_BEFORE_M: Final = 12.0

_TURNS: Final = {
    "turn_left_at_next_intersection": "left",
    "turn_right_at_next_intersection": "right",
    "go_straight_at_next_intersection": "straight",
}
_LANES: Final = {"change_lane_left": -1, "change_lane_right": 1}
_SPLIT: Final = re.compile(
    r"[,;.]?\s{1,3}(?:and\s{1,3})?(?:then|after\s{1,3}that|afterwards)\s{1,3}|\s{1,3}and\s{1,3}(?=let|drop|stop|pull|turn|take|go)"
)
_OUT: Final = re.compile(
    r"\b(?:let|drop)\s{1,3}(?:me|us)\s{1,3}(?:out|off)\b|\bpull\s{1,3}over\b|\bstop\s{1,3}(?:here|there|for\s{1,3}me)\b|^\W{0,9}stop\W{0,9}$",
    re.IGNORECASE,
)
_ON: Final = re.compile(
    r"^\W{0,9}(?:just\s{1,3})?(?:follow|keep\s{1,3}to|stay\s{1,3}on|(?:continue|drive|go)\s{1,3}(?:along|on\s{1,3}along))"
    r"\s{1,3}(?:the|this)\s{1,3}(?:road|street)(?:\s{1,3}for\s{1,3}(?:about\s{1,3})?\d{1,5}\s{1,3}met(?:er|re)s)?\W{0,9}$",
    re.IGNORECASE,
)
"""Nothing is to be chosen: the road is followed."""
_PLACE: Final = re.compile(
    r"\b(?:after|past|behind|beyond)\s{1,3}(?:the\s{1,3})?"
    r"(?P<place>(?!that\b|this\b|next\b|lights?\b|junction\b|\d)[\w'.\- ]{1,60}?)"
    r"(?=,|\.?$|\s{1,3}(?:turn|take|go|make|keep|bear|carry|continue)\b)",
    re.IGNORECASE,
)
_SIGN: Final = re.compile(
    r"\bat\s{1,3}(?:the|this)\s{1,3}(?:(?:next|first|second|third|fourth|fifth|junction with the)\s{1,3})?"
    r"(?:stop sign|stop|traffic light|lights?|signal)\b",
    re.IGNORECASE,
)
"""Where to turn, not what to do about the sign."""
_WORDS: Final = {"left": "to the left", "right": "to the right", "straight": "straight on"}


@dataclass(frozen=True, slots=True)
class TownStep:
    """One step of an instruction.

    Attributes:
        words: Of the step.
        place: Landmark after which it is to be done; empty for none.
        out: Whether somebody wants to get out there.
        recalled: The learned program that is nearest; None for a stop, and for keeping to the road.
        after_m: Way to be driven first; None where none is said.
        nth: At which of the junctions that have such a way, 1 for the next.
        before_junction: Whether to stop before the next junction.
    """

    words: str
    place: str = ""
    out: bool = False
    recalled: Recalled | None = None
    after_m: float | None = None
    nth: int = 1
    before_junction: bool = False

    @property
    def calls(self) -> frozenset[str]:
        """Driving APIs of that program."""
        source = "" if self.recalled is None else self.recalled.entry.source
        return frozenset(use.name for use in read_program(source).uses)

    @property
    def turn(self) -> str:
        """The way that it chooses; empty for none."""
        return next((turn for name, turn in _TURNS.items() if name in self.calls), "")

    @property
    def way(self) -> str:
        """The way that it needs: as it chooses, or straight on where the words say so; empty for whichever there is."""
        return self.turn or ("straight" if re.search(r"\bstraight\b", self.words, re.IGNORECASE) else "")


@cache
def snippets(folder: Path = SNIPPETS) -> PolicyRepository:
    """The learned programs. Raises DataError where they are missing."""
    return PolicyRepository(folder)


def steps_of(text: str, repository: PolicyRepository) -> tuple[TownStep, ...] | None:
    """The steps of an instruction, as last corrected; None where one of them is like nothing that was learned."""
    text = last_said(text)
    if _ON.search(text):
        return (TownStep(text),)
    steps: list[TownStep] = []
    for part in (one.strip(" ,.;") for one in _SPLIT.split(text)):
        if not part:
            continue
        step = _step_of(part, repository)
        if step is None:
            return None
        steps.append(step)
    return tuple(steps) or None


def _step_of(part: str, repository: PolicyRepository) -> TownStep | None:
    denied = denied_words(part)
    meant = meanings_said(part)
    family = meant[0].manoeuvre if meant else ""
    far = next((amount for dimension, amount in measured(part) if dimension == "distance"), None)
    told = _OUT.search(part)
    if family == "resume" and denied:  # "don't stop here"
        return TownStep(part)
    if family in _STANDS or (told is not None and not denied & set(tokens_of(told.group()))):
        return TownStep(
            part, landmark_in(part), out=True, after_m=far, before_junction=bool(_JUNCTION & set(tokens_of(part)))
        )
    nth = nth_of(part)
    found = None if nth > 1 else _PLACE.search(part)
    place = "" if found is None else found["place"].strip()
    words = part if found is None else f"{part[: found.start()]} {part[found.end() :]}".strip(" ,.;")
    said = " ".join(one for one in words.split() if not denied & set(tokens_of(one)))
    near = repository.recall(f"{said[:1].upper()}{said[1:]}.", "town", NEIGHBOURS)
    fit = [one for one in near if one.similarity >= NEAR and _agrees(words, one, denied)]
    if not fit:
        return None
    # A lane may lead elsewhere than the words say: of those that agree, the first that chooses the way itself.
    choose = (one for one in fit if (step := TownStep(words, recalled=one)).way == step.turn)
    step = TownStep(part, place, recalled=next(choose, fit[0]))
    if family in ("", "resume") and not step.turn and far is not None and not {"in", "after"} & set(tokens_of(part)):
        return TownStep(part, place, after_m=far)  # "drive 200 meters"
    return replace(step, nth=nth) if step.turn in _SIDES else step


def landmark_in(words: str) -> str:
    """The kind of place of our own towns that words name; empty for none."""
    said = " ".join(tokens_of(words))
    kinds = (kind.replace("_", " ") for kind in PLACE_KINDS)
    return next((kind for kind in sorted(kinds, key=len, reverse=True) if f" {kind} " in f" {said} "), "")


def nth_of(words: str) -> int:
    """Which of several: 3 for "the third street", and for "after two more junctions"; 1 where nothing is said."""
    tokens = tokens_of(words)
    ordinal = next((_ORDINALS[one] for one in tokens if one in _ORDINALS), 1)
    counted = [round(one.value) for one in read_quantities(words) if one.dimension == "bare"]
    after = "after" in tokens and bool(counted) and 1 <= counted[0] <= _MOST_JUNCTIONS
    return counted[0] + 1 if after else ordinal


def _agrees(words: str, recalled: Recalled, denied: frozenset[str] = frozenset()) -> bool:
    """Whether a learned program goes to the side, and changes lanes, as the words say: likeness alone may not."""
    said = set(re.findall(r"\w+", words.casefold()))
    sides = {side for side in _SIDES if side in said and side not in denied}
    step = TownStep(words, recalled=recalled)
    lanes = {name.removeprefix("change_lane_") for name in _LANES if name in step.calls}
    if "lane" in said:
        return lanes == sides and not step.turn
    return not lanes and {step.turn} & set(_SIDES) == sides


def town_destination(wish: str) -> str:
    """The place that a wish in a town asks to be taken to; empty where it asks for none, or says a way or a lane."""
    if any(one.manoeuvre in ("turn", "lane") for one in meanings_said(wish)):
        return ""
    return destination_of(wish)


def driven_to(planner: Planner, place: str, request: PlanRequest, begun: float) -> Plan:
    """The plan to go to a place of the town. The world refuses what it has not."""
    situation = request.context.situation
    limit, usual = situation.speed_limit_mps, LOOK_AHEAD["usual"]
    policy = Parameters(
        target_speed_mps=round(min(limit, request.limits.most_mps(limit)), 2),
        look_ahead_m=usual.distance_m,
        look_ahead_ratio=usual.ratio_s,
        lane=0,
        route=place,
    )
    return Plan(
        thoughts=Thoughts(f"You want to go to {place}. I take the way there, as fast as the signs allow."),
        policy=policy,
        intent="go_to",
        planner=planner.id,
        model=planner.model,
        latency_s=time.perf_counter() - begun,
    )


def plan_in_town(planner: Planner, request: PlanRequest, repository: PolicyRepository | None = None) -> Plan | None:
    """The plan for an instruction in a town; None where it is none of the kinds that were learned.

    Args:
        planner: Whose plan it is.
        request: What is asked.
        repository: Learned programs; those that ship with the package by default.
    """
    begun = time.perf_counter()
    if vocabulary_of(request.context.situation.world) != "town":
        return None
    if reason := danger(_SIGN.sub("", request.instruction.text)):
        return declined(planner, f"{reason} {CAN_DO}", begun)
    if there := town_destination(last_said(request.instruction.text)):
        return driven_to(planner, there, request, begun)
    steps = steps_of(request.instruction.text, repository or snippets())
    if steps is None:
        return None
    if len(steps) == 1 and steps[0].out and steps[0].place:  # "drop me off in front of the station"
        return driven_to(planner, steps[0].place, request, begun)
    if words := _impossible(steps[0], request.context.situation):
        return declined(planner, words, begun, intent="not there")
    near = [step.recalled for step in steps if step.recalled is not None]
    plan = Plan(
        thoughts=Thoughts(_told(steps)),
        policy=Program(_program(steps)),
        intent="+".join(_intent(step) for step in steps),
        planner=planner.id,
        model=f"{planner.model}+snippets-{(repository or snippets()).digest[:8]}",
        latency_s=time.perf_counter() - begun,
        raw="; ".join(f"{one.entry.callable_name} ({one.similarity:.2f}): {one.entry.command}" for one in near),
    )
    return undenied(planner, plan, request, begun)


def _impossible(step: TownStep, situation: Situation) -> str:
    """Why a step cannot be done where the car is; empty where it can."""
    if step.place or step.nth > 1:
        return ""  # the junction that is meant may be another one
    if step.way and situation.turns and step.way not in situation.turns:
        ways = " or ".join(_WORDS[turn] for turn in situation.turns)
        return f"No way leads {_WORDS[step.way]} at the next junction; it leads {ways}."
    if step.turn and not situation.turns:
        return "There is no junction ahead of us."
    for name, side in _LANES.items():
        if name in step.calls and not step.turn and not 0 <= situation.lane_index + side < situation.lane_count:
            return f"There is no lane to the {'left' if side < 0 else 'right'} of ours."
    return ""


def _intent(step: TownStep) -> str:
    if step.out:
        return "stop"
    if step.turn:
        return "straight on" if step.turn == "straight" else f"way {step.turn}"
    return next(
        ("over " + ("left" if side < 0 else "right") for name, side in _LANES.items() if name in step.calls), "on"
    )


def _told(steps: tuple[TownStep, ...]) -> str:
    parts: list[str] = []
    for step in steps:
        where = f" after {step.place}" if step.place else ""
        if step.out:
            there = " before the next junction" if step.before_junction else f" at {step.place}" if step.place else ""
            far = "" if step.after_m is None else f" in {step.after_m:.0f} m"
            parts.append(f"I stop{there}{far}, so that you can get out")
        elif step.recalled is None:
            parts.append("I keep to the road" + ("" if step.after_m is None else f" for {step.after_m:.0f} m"))
        else:
            where += f", at the junction number {step.nth} that leads there," if step.nth > 1 else ""
            parts.append(f'{step.words}: I drive{where} as I learned for "{step.recalled.entry.command}"')
    return "; then ".join(parts) + "."


def _program(steps: tuple[TownStep, ...]) -> str:
    """A learned program as it is, or several steps as one program."""
    if len(steps) == 1 and steps[0].recalled is not None and not steps[0].place and steps[0].nth == 1:
        return steps[0].recalled.entry.source
    navigation = all(not step.out and not step.place and step.nth == 1 for step in steps)
    if navigation and steps[0].recalled is not None:
        return steps[0].recalled.entry.source  # navigation says the rest again when this is done
    body: list[str] = []
    for step in steps:
        if step.place:
            name = re.sub(r"[^\w'. -]", "", step.place)[:40].replace('"', "")
            body += [
                f'    if get_distance_to_place("{name}") < 0:',
                f'        say("I do not find {name} ahead on this way, so I go straight on.")',
                "        yield proceed(check_speed_limit())",
                "        return",
                "    for _ in range(12000):",
                f'        if get_distance_to_place("{name}") < 0:',
                "            break",
                "        yield proceed(check_speed_limit())",
            ]
        if step.after_m is not None:
            body += [f"    yield from drive_on({step.after_m:.0f})"]
        if step.before_junction:
            body += [
                "    for _ in range(12000):",
                f"        if get_distance_to_junction() < {_STOPS_BEFORE_M}:",
                "            break",
                "        yield proceed(check_speed_limit())",
            ]
        if step.out:
            body += [
                '    say("I stop here. Please look round before you get out.")',
                "    for _ in range(200):",
                "        yield stop()",
            ]
            break
        if step.recalled is None:
            if step.after_m is None:
                body += ["    while True:", "        yield proceed(check_speed_limit())"]
                break
            continue
        if step.nth > 1:
            body += [
                f"    for _ in range({step.nth - 1}):",
                f'        yield from pass_a_way("{step.turn}")',
                "    for _ in range(12000):",
                f'        if can_go("{step.turn}"):',
                "            break",
                "        yield proceed(check_speed_limit())",
            ]
        if step.turn:
            verb = "go_straight" if step.turn == "straight" else f"turn_{step.turn}"
            body += [
                f'    if not can_go("{step.turn}"):',
                f'        say("No way leads {_WORDS[step.turn]} at the next junction, so I go straight on.")',
                "        yield proceed(check_speed_limit())",
                "        return",
                f"    {verb}_at_next_intersection()",
                "    yield from cross_the_junction()",
            ]
        else:
            lane = next((name for name in _LANES if name in step.calls), "")
            body += [f"    {lane}()"] if lane else []
            body += ["    for _ in range(100):", "        yield proceed(check_speed_limit())"]
    helpers = [
        *([_CROSSING] if any(step.turn for step in steps) else []),
        *([_PASSING] if any(step.nth > 1 for step in steps) else []),
        *([_FAR] if any(step.after_m is not None for step in steps) else []),
    ]
    return "\n".join(["".join(helpers), "def as_told():", *body, ""]).lstrip("\n")


_CROSSING: Final = """def cross_the_junction():
    last = get_distance_to_junction()
    for _ in range(12000):
        now = get_distance_to_junction()
        if now > last + 10:
            break
        last = now
        yield proceed(check_speed_limit())
    gone = 0.0
    for _ in range(12000):
        gone = gone + 0.05 * get_speed_of(get_ego_vehicle())
        if gone > 40.0:
            break
        yield proceed(check_speed_limit())


"""
_PASSING: Final = """def pass_a_way(side):
    counted = can_go(side)
    yield from cross_the_junction()
    for _ in range(8):
        if counted:
            break
        counted = can_go(side)
        yield from cross_the_junction()


"""
_FAR: Final = """def drive_on(far):
    gone = 0.0
    for _ in range(12000):
        gone = gone + 0.05 * get_speed_of(get_ego_vehicle())
        if gone > far:
            break
        yield proceed(check_speed_limit())


"""
