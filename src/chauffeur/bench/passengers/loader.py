"""The wishes as values, and as a data set that `LampilotBenchmark` drives."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Final, Literal, cast

from pydantic import ConfigDict, TypeAdapter, ValidationError

from chauffeur.bench.passengers.scenes import SCENES
from chauffeur.concept import DataError, Scenario
from chauffeur.concept.data import read_data
from chauffeur.worlds.highway.dblv1 import Dataset, Task

Right = Literal["drive", "ask", "refuse"]
Directness = Literal[0, 1, 2, 3]

FILE: Final = "wishes.jsonl"

STEMS: Final[Mapping[str, str]] = {
    "faster_to": "inc_abs_speed",
    "faster_by": "inc_rel_speed",
    "faster": "inc_rel_speed",
    "hurry": "inc_rel_speed",
    "slower_to": "dec_abs_speed",
    "slower_by": "dec_rel_speed",
    "slower": "dec_rel_speed",
    "relax": "dec_rel_speed",
    "wider_to": "inc_abs_dis",
    "wider_by": "inc_rel_dis",
    "wider": "inc_rel_dis",
    "room": "inc_rel_dis",
    "closer_to": "dec_abs_dis",
    "closer_by": "dec_rel_dis",
    "closer": "dec_rel_dis",
    "lane_left": "left_lc",
    "lane_right": "right_lc",
    "overtake_left": "left_overtake",
    "overtake_right": "right_overtake",
    "pull_over": "pull_over",
    "straight": "go_straight",
    "turn_left": "turn_left",
    "turn_right": "turn_right",
    "steps": "steps",
    "condition": "condition",
    "history": "history",
    "ask_side": "ask_side",
    "ask_amount": "ask_amount",
    "ask_vague": "ask_vague",
    "refuse_impossible": "refuse_impossible",
    "refuse_unsafe": "refuse_unsafe",
    "refuse_other": "refuse_other",
    "refuse_hostile": "refuse_hostile",
}
"""Kinds of wishes, and how the task names of each begin: families are told by that (`lampilot.families`)."""

_GOALS: Final = frozenset(
    {
        "ACCEvalbySpeed",
        "ACCEvalbyDistance",
        "LaneChangeEval",
        "OvertakeEval",
        "PullOverEval",
        "IntersectionEval",
        "SequenceEval",
        "ReachEval",
        "ChangeEval",
    }
)


@dataclass(frozen=True, slots=True)
class PastWish:
    """Memory record of an earlier trip.

    Attributes:
        instruction: Words of the wish then.
        intent: Tag of what was understood, as planners give it: `speed.set`, `overtake.left`.
        feedback: What the passenger said of the drive.
    """

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)

    instruction: str
    intent: str
    feedback: str


@dataclass(frozen=True, slots=True)
class PassengerWish:
    """One wish and what is right to do about it.

    Attributes:
        id: `p001` and so on; stays with a wish for ever.
        wish: The passenger's words, slips included.
        scenario: Name of the scene they are said in (`scenes.SCENES`).
        right: What a good driver does.
        goal: What a drive is judged by; `RefuseEval` where none is right.
        kind: One of STEMS.
        directness: 1 said outright, 2 a complaint, 3 a mere reason; 0 for what is not to be driven.
        note: Why asking or refusing is right.
        history: Earlier trips the wish refers to, oldest first.
    """

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)

    id: str
    wish: str
    scenario: str
    right: Right
    goal: dict[str, Any]
    kind: str
    directness: Directness = 0
    note: str = ""
    history: tuple[PastWish, ...] = ()

    @property
    def task(self) -> str:
        """Name of its task: tells the family, and ends in the wish's id."""
        return f"{STEMS[self.kind]}_{self.id}"

    @property
    def scene(self) -> Scenario:
        """The scene with the goal, as the sample of its task."""
        start = SCENES[self.scenario]
        return replace(start, id=f"{self.task}_s0", goal=self.goal, wish=self.wish)


_WISH: TypeAdapter[PassengerWish] = TypeAdapter(PassengerWish)


def load_wishes() -> tuple[PassengerWish, ...]:
    """All wishes, in the order of the file.

    Raises:
        DataError: The file is not here, or is damaged; names the line.
    """
    return parse_wishes(_content())


def parse_wishes(content: bytes) -> tuple[PassengerWish, ...]:
    """The wishes of a file's content. Raises DataError naming the first bad line."""
    wishes: list[PassengerWish] = []
    seen: set[str] = set()
    for number, line in enumerate(content.splitlines(), 1):
        try:
            wish = _WISH.validate_json(line)
        except ValidationError as error:
            faults = "; ".join(f"{'.'.join(map(str, e['loc'])) or 'line'}: {e['msg']}" for e in error.errors())
            raise _bad(number, faults) from error
        fault = _fault(wish) or (f"the id {wish.id!r} comes twice" if wish.id in seen else "")
        if fault:
            raise _bad(number, fault)
        seen.add(wish.id)
        wishes.append(wish)
    return tuple(wishes)


def as_dataset() -> Dataset:
    """The wishes as DbLv1 tasks, one each, with the goals they are judged by.

    Its hash is over the file and over the scenes that the wishes are said in, since both decide a result.

    Raises:
        DataError: As `load_wishes`.
    """
    content = _content()
    wishes = parse_wishes(content)
    scenes = {name: (SCENES[name].config, SCENES[name].seed) for name in {wish.scenario for wish in wishes}}
    digest = hashlib.sha256(content + b"\0" + json.dumps(scenes, sort_keys=True).encode()).hexdigest()
    return Dataset(Path(FILE), tuple(Task(wish.task, (wish.wish,), (wish.scene,)) for wish in wishes), digest)


def _content() -> bytes:
    return read_data("passengers", FILE)


def _bad(number: int, fault: str) -> DataError:
    return DataError(f"{FILE}, line {number}: {fault}.", hint="Correct the line; docs/passengers.md tells the fields.")


def _fault(wish: PassengerWish) -> str:
    """Faults of a wish beyond the types of its fields; empty when nothing is."""
    if not wish.wish.strip():
        return "the wish is empty"
    if wish.scenario not in SCENES:
        return f"unknown scene {wish.scenario!r}"
    if wish.kind not in STEMS:
        return f"unknown kind {wish.kind!r}"
    if wish.right == "drive":
        if wish.directness == 0:
            return "a wish to be driven needs its directness"
        return _fault_of_goal(wish.goal)
    if wish.goal != {"type": "RefuseEval"}:
        return "a wish not to be driven has the goal RefuseEval"
    if not wish.note:
        return "a wish not to be driven needs a note that says why"
    return "" if wish.kind.startswith(f"{wish.right}_") else f"the kind {wish.kind!r} is not one of {wish.right!r}"


def _fault_of_goal(goal: Mapping[str, Any]) -> str:
    kind: object = goal.get("type")
    if kind not in _GOALS:
        return f"unknown goal {kind!r}"
    if kind != "SequenceEval":
        return ""
    steps: object = goal.get("steps")
    if not isinstance(steps, list) or not steps:
        return "SequenceEval needs `steps`"
    faults = [
        _fault_of_goal(cast("dict[str, Any]", step)) if isinstance(step, dict) else "a step is a goal"
        for step in cast("list[object]", steps)
    ]
    return next((fault for fault in faults if fault), "")
