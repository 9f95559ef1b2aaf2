"""The steps of an instruction in a town: what is said, cut into things to do, with sides, places, distances and counts.

What each step is after is learned (`town_intents`); the learned program that is nearest in meaning says how it is
driven (`snippets`); what has to be certain (side, number, denial, which junction) is read by rules.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from chauffeur.language import measured, tokens_of
from chauffeur.language.corrections import last_said
from chauffeur.language.denials import denied_words
from chauffeur.language.ordinals import JUNCTION_WORDS, nth_of
from chauffeur.memory.policies import PolicyRepository, Recalled
from chauffeur.planners.onboard.town_intents import TownIntent, intent_of
from chauffeur.planners.onboard.understand import meanings_said
from chauffeur.safety.constant_calls import read_program
from chauffeur.worlds.town.pack import PLACE_WORDS
from chauffeur.worlds.town.recipes import PLACE_KINDS

NEAR: Final = 0.12
"""What is less like every learned instruction is none of the town's."""
NEIGHBOURS: Final = 50
"""So many are looked through for one that goes the way the words say."""
SIDES: Final = ("left", "right")
WORDS: Final = {"left": "to the left", "right": "to the right", "straight": "straight on"}
LANE_CHANGES: Final = {"change_lane_left": -1, "change_lane_right": 1}
_TURNS: Final = {
    "turn_left_at_next_intersection": "left",
    "turn_right_at_next_intersection": "right",
    "go_straight_at_next_intersection": "straight",
}
_STANDS: Final = ("stop", "pull_over")
_NAVIGATION: Final = ("turn", "straight", "lane")
_MOST_WORDS: Final = 3
"""A longer name of a place has other words of the sentence in it."""
_FAR_M: Final = 120.0
"""A turn that is farther away than this is not at the junction that is announced as the next one is."""
_SPLIT: Final = re.compile(
    r"[,;.]?\s{1,3}(?:and\s{1,3})?(?:then|after\s{1,3}that|afterwards)\s{1,3}"
    r"|(?:,\s{1,3}|\s{1,3}and\s{1,3})(?=(?:let|drop|leave|set|stop|pull|turn|take|go|first|left|right)\b)"
)
_WHERE: Final = re.compile(r"^(?:in|after|at|past|on|behind|beyond|once|over|when|as soon as)\b", re.IGNORECASE)
_BEYOND: Final = re.compile(r"\b(?:past|after|beyond|behind|across|over)\b", re.IGNORECASE)
_OUT: Final = re.compile(
    r"\b(?:let|drop|leave|set)\s{1,3}(?:me|us|her|him|them)\s{1,3}(?:down|out|off|here|there|at|by|in)\b|\bpull\s{1,3}over\b"
    r"|\bstop\s{1,3}(?:here|there|for\s{1,3}me)\b|^\W{0,9}stop\W{0,9}$",
    re.IGNORECASE,
)
_STOPS_SOMEBODY: Final = re.compile(r"\bstop\s{1,3}(?:it|that|him|her|them|\w{2,12}ing)\b", re.IGNORECASE)
"""Said to a child."""
_ON: Final = re.compile(
    r"^\W{0,9}(?:just\s{1,3})?(?:follow|keep\s{1,3}to|stay\s{1,3}on|(?:continue|drive|go)\s{1,3}(?:along|on\s{1,3}along))"
    r"\s{1,3}(?:the|this)\s{1,3}(?:road|street)(?:\s{1,3}for\s{1,3}(?:about\s{1,3})?\d{1,5}\s{1,3}met(?:er|re)s)?\W{0,9}$",
    re.IGNORECASE,
)
"""Nothing is to be chosen: the road is followed."""
_PLACE: Final = re.compile(
    r"\b(?:after|past|behind|beyond)\s{1,3}(?:the\s{1,3}|that\s{1,3}(?:big\s{1,3})?)?"
    r"(?P<place>(?!that\b|this\b|these\b|next\b|lights?\b|junction\b|\d)"
    r"(?!(?:\w+ ){1,3}(?:met(?:er|re)s?|yards?|feet|miles?)\b)[\w'.\- ]{1,60}?)"
    r"(?=[,;!?]|\.?$|\s{1,3}(?:turn|take|go|make|keep|bear|carry|continue|where|which|that|is|please|you|we|hang)\b)",
    re.IGNORECASE,
)
_NAMES: Final = {
    name: kind.replace("_", " ")
    for kind in PLACE_KINDS
    for name in (kind.replace("_", " "), *(" ".join(tokens_of(one)) for one in PLACE_WORDS.get(kind, ())))
}
"""Names of our own towns' places, and their kinds."""
_JUST: Final = re.compile(r"\b(?:straight|just)\s{1,3}$", re.IGNORECASE)
"""Before "after": at once."""
_STRAIGHT: Final = re.compile(r"\bstraight\b(?! (?:after|past|away|behind))", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class TownStep:
    """One step of an instruction.

    Attributes:
        words: Of the step.
        place: Landmark after which it is to be done; empty for none.
        out: Whether somebody wants to get out there.
        waits: Whether the car is to stand until it is told to go on.
        recalled: The learned program that is nearest; None for a stop, and for keeping to the road.
        after_m: Way to be driven first; None where none is said.
        nth: At which of the junctions that have such a way, 1 for the next.
        before_junction: Whether to stop before the next junction.
    """

    words: str
    place: str = ""
    out: bool = False
    waits: bool = False
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
        return self.turn or ("straight" if _STRAIGHT.search(self.words) else "")

    @property
    def plain(self) -> bool:
        """True if the learned program alone is all there is to it."""
        return self.recalled is not None and not (self.place or self.after_m is not None or self.nth > 1)


def steps_of(text: str, repository: PolicyRepository, meant: TownIntent | None = None) -> tuple[TownStep, ...] | None:
    """The steps of an instruction, as last corrected; None where one of them is like nothing that was learned.

    Args:
        text: The words.
        repository: Learned programs.
        meant: What the whole of it is after, where that is known.
    """
    text = last_said(text)
    if _ON.search(text):
        return (TownStep(text),)
    parts = _parts(text)
    if len(parts) == 1:
        step = _step_of(parts[0], repository, meant or intent_of(parts[0]))
        return None if step is None else (step,)
    steps = [_step_of(part, repository, intent_of(part)) for part in parts]
    known = [step for step in steps if step is not None]
    if len(known) < len(steps) and not _leads(steps):
        return None
    return tuple(step for step in known if step != TownStep(step.words)) or tuple(known[:1])


def _parts(text: str) -> list[str]:
    """A text cut into what is to be done after each other; a mere place, distance or count belongs to what follows."""
    parts: list[str] = []
    for part in (one.strip(" ,.;") for one in _SPLIT.split(text)):
        whole = not parts or bool({*SIDES, "straight"} & set(tokens_of(parts[-1])))
        if not whole and (_WHERE.match(parts[-1]) or nth_of(parts[-1]) > 1):
            parts[-1] = f"{parts[-1]}, then {part}"
        elif part:
            parts.append(part)
    return parts


def _leads(steps: Sequence[TownStep | None]) -> bool:
    """True if all but what stands in front is understood: "when I say so, turn left"."""
    return steps[-1] is not None and all(step is not None for step in steps[1:])


def _step_of(part: str, repository: PolicyRepository, meant: TownIntent) -> TownStep | None:
    denied = denied_words(part)
    rules = meanings_said(part)
    family = rules[0].manoeuvre if rules else ""
    far = next((amount for dimension, amount in measured(part) if dimension == "distance"), None)
    told = _OUT.search(part)
    navigates = meant.surely(*_NAVIGATION)
    if family == "resume" and denied:  # "don't stop here"
        return TownStep(part)
    if meant.surely("wait"):
        return TownStep(part, waits=True)
    if (
        not navigates
        and (family in _STANDS or meant.surely("stop") or told is not None)
        and not (told is not None and denied & set(tokens_of(told.group())))
    ):
        at_junction = bool(JUNCTION_WORDS & set(tokens_of(part))) and not _BEYOND.search(part)
        return TownStep(part, landmark_in(part), out=True, after_m=far, before_junction=at_junction)
    if (
        meant.surely("go")
        or (meant.likely and meant.kind == "yield")
        or (meant.surely("straight") and not _STRAIGHT.search(part))
    ):
        return TownStep(part, after_m=far)
    nth = nth_of(part)
    found = None if nth > 1 else _PLACE.search(part)
    place = "" if found is None else found["place"].strip()
    if len(place.split()) > _MOST_WORDS:
        place = landmark_in(place) or place
    words = part if found is None else f"{_JUST.sub('', part[: found.start()])} {part[found.end() :]}".strip(" ,.;")
    fit = _recalled(words, repository, denied, meant)
    if not fit:
        return None
    # A lane may lead elsewhere than the words say: of those that agree, the first that chooses the way itself.
    choose = (one for one in fit if (step := TownStep(words, recalled=one)).way == step.turn)
    step = TownStep(part, place, recalled=next(choose, fit[0]))
    if family in ("", "resume") and not step.turn and far is not None and not {"in", "after"} & set(tokens_of(part)):
        return TownStep(part, place, after_m=far)  # "drive 200 meters"
    if step.turn in SIDES:
        return replace(step, nth=nth, after_m=far if far is not None and far > _FAR_M else None)
    return step


def _recalled(words: str, repository: PolicyRepository, denied: frozenset[str], meant: TownIntent) -> list[Recalled]:
    """The learned programs that do as words say, the nearest in meaning first."""
    said = " ".join(one for one in words.split() if not denied & set(tokens_of(one)))
    over = meant.surely("lane") or "lane" in tokens_of(words)
    if meant.sure and meant.kind not in _NAVIGATION:
        return []
    near = repository.recall(f"{said[:1].upper()}{said[1:]}.", "town", NEIGHBOURS)
    if over and not any(_agrees(words, one, over, denied) for one in near):  # said without the word
        side = next((one for one in SIDES if one in tokens_of(said)), "")
        near = repository.recall(f"Change to the {side} lane now.", "town", NEIGHBOURS) if side else near
    return [one for one in near if one.similarity >= NEAR and _agrees(words, one, over, denied)]


def speaks_to_somebody(words: str) -> bool:
    """True if words may tell another passenger to stop something."""
    return _STOPS_SOMEBODY.search(words) is not None


def landmark_in(words: str) -> str:
    """The first kind of place of our own towns that words name, as its kind; empty for none."""
    said = f" {' '.join(tokens_of(words.replace('&', ' and ')))} "
    named = [(said.index(f" {name} "), -len(name), kind) for name, kind in _NAMES.items() if f" {name} " in said]
    return min(named, default=(0, 0, ""))[2]


def landmarks_in(words: str) -> tuple[str, ...]:
    """All kinds of places of our own towns that words name, in the order in which they are to be gone to: "the station,
    but by the bakery first"."""
    said = f" {' '.join(tokens_of(words))} "
    spans = [
        (found.start(), found.end(), kind)
        for name, kind in _NAMES.items()
        for found in re.finditer(f" {name}(?= )", said)
    ]
    named = sorted(one for one in spans if not any(a <= one[0] and one[1] < b for a, b, _ in spans))
    first = re.search(r"(?<!at) first (?=[.,;!?]|$)|(?<!at) first $", said)
    if first is not None and len(named) > 1 and (before := [one for one in named if one[1] <= first.start() + 1]):
        named.remove(before[-1])
        named.insert(0, before[-1])
    return tuple(dict.fromkeys(kind for _, _, kind in named))


def _agrees(words: str, recalled: Recalled, over: bool, denied: frozenset[str]) -> bool:
    """True if a learned program goes to the side, and changes lanes, as the words say: likeness alone may not."""
    said = set(re.findall(r"\w+", words.casefold()))
    sides = {side for side in SIDES if side in said and side not in denied}
    step = TownStep(words, recalled=recalled)
    lanes = {name.removeprefix("change_lane_") for name in LANE_CHANGES if name in step.calls}
    if over:
        return lanes == sides and not step.turn
    return not lanes and {step.turn} & set(SIDES) == sides
