"""The on-board VLM as a planner: wish, picture and what is remembered in; scene, thoughts and action matrix out."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from chauffeur.concept import (
    ActionMatrix,
    CameraImage,
    History,
    InstructionError,
    Plan,
    PlanRequest,
    Situation,
    Usage,
)
from chauffeur.language.weather import FOG, RAIN, SNOW, UNKNOWN, said_weather, weather_of, without_said_weather
from chauffeur.planners.base import planned
from chauffeur.planners.camera_faults import camera_fault
from chauffeur.planners.motion import settings_of
from chauffeur.planners.prompts.motion import matrix_words
from chauffeur.planners.vlm.engine import VlmEngine, VlmReading, shipped
from chauffeur.planners.vlm.taste import (
    STEP,
    STYLE_SETTING,
    TASTE_SETTING,
    WEATHER_SETTING,
    judged_drives,
    sign_of,
    taste_of,
)
from chauffeur.planners.vlm.template import RECALLS, SEEN_WEATHERS, STYLES
from chauffeur.planners.vlm.thoughts import AS_SEEN, SAID, more_careful, scene_words, taste_words, thought_words
from chauffeur.safety.gain_box import care, most_careful, moved

INTENT: Final = "motion.gains"
RECALL_SETTING: Final = "recall"
"""Among a plan's settings: -1 where it was made gentler than the words alone, 1 brisker, 0 neither."""
SURE: Final = 0.8
"""What the model sees is said from this share on; below, of a road that bends far ahead, it says either."""
SIMILAR: Final = 0.6
"""A remembered wish this much like the present one speaks for it."""
_LEAST_SHIFT: Final = 0.02
"""Smaller shifts of the gains by a person's taste are left out: nobody would feel them."""
_DOUBTED: Final = 0.5
"""Share of the weather below which a picture may show no road at all, and is taken for the worst weather too."""
_STANDS_MPS: Final = 1.0
_DAMP: Final = ("sunny", "night")
"""What the weather services' "dry" may look like."""


@dataclass(frozen=True, slots=True)
class _Made:
    """A wish answered: the reading that is told of, the gains and by how much they are to this person's taste,
    the scene and the thoughts."""

    read: VlmReading
    policy: ActionMatrix
    shift: float
    scene: str
    thoughts: str


class VlmPlanner:
    """Sets the gains of the motion controllers from what is said, seen and remembered (paper Sec. VI, Eq. 21-22)."""

    id = "vlm"
    sees = True
    """Pictures are taken for it."""

    def __init__(self, engine: VlmEngine) -> None:
        """Args: the model."""
        self._engine = engine
        self._earlier: CameraImage | None = None

    @classmethod
    def from_spec(cls, argument: str) -> VlmPlanner:
        """`vlm`, or `vlm/<folder>` for a model of one's own. Raises DataError where it cannot be read."""
        return cls(VlmEngine(Path(argument)) if argument else shipped())

    @property
    def model(self) -> str:
        """Version of the network."""
        return self._engine.version

    async def plan(self, request: PlanRequest) -> Plan:
        """One plan: always an action matrix inside the certified box.

        Raises:
            InstructionError: The wish is empty.
        """
        begun = time.perf_counter()
        text = request.instruction.text.strip()
        if not text:
            raise InstructionError("The instruction is empty.", hint="Say how you want to be driven.")
        recall = recalled(request.history)
        given = {"task": task_of(request.context.situation), "recall": RECALLS[recall]}
        fault = camera_fault(request.images, self._earlier)
        self._earlier = request.images[-1] if request.images else None
        made = self._blind(text, given, fault) if fault else self._seeing(text, given, request, recall)
        read = made.read
        return planned(
            self,
            f"{made.thoughts}{taste_words(made.shift)}",
            made.policy,
            begun,
            intent=INTENT,
            settings=(
                *settings_of(made.policy),
                (RECALL_SETTING, float((0, -1, 1)[recall])),
                (TASTE_SETTING, made.shift),
                (STYLE_SETTING, float(STYLES.index(read.values["style"]))),
                (WEATHER_SETTING, float(SEEN_WEATHERS.index(read.values["weather"]))),
            ),
            usage=Usage(completion_tokens=read.passes, requests=1),
            raw=f"{read.text}\nP = {matrix_words(made.policy)}",
            scene=made.scene,
        )

    def _blind(self, text: str, given: Mapping[str, str], fault: str) -> _Made:
        """The most careful answer, for a camera that shows nothing."""
        read = self._engine.read(text, None, {**given, "style": "conservative", "weather": "snow", "grade": "heavy"})
        scene = f"{fault}: I cannot see road or weather."
        thoughts = f"{scene} I take my most careful gains until it shows something again."
        return _Made(read, most_careful(), 0.0, scene, thoughts)

    def _seeing(self, text: str, given: Mapping[str, str], request: PlanRequest, recall: int) -> _Made:
        """The answer by camera, words and weather service. Each source is read for itself, and of all readings the
        one of the most `care` is driven: one more source, whatever it says, never makes the drive less careful."""
        pixels, heard = request.images[-1].pixels(), said_weather(text)
        rest = without_said_weather(text) if heard != "none" else ""
        readings, doubts, scene, where = list[VlmReading](), list[str](), "", ""
        for words in filter(None, (rest, text)):  # the last is what is told of
            read = self._engine.read(words, pixels, given)
            seen, doubts, where = read.values["weather"], list[str](), ""
            asked = [seen]
            if read.shares.get("weather", 1.0) < _DOUBTED:
                asked.append(SEEN_WEATHERS[-1])
                doubts.append("I am not sure what the camera shows.")
            if served := _contradicted(seen, request.context.situation):
                asked.append(more_careful(seen, served))
                doubts.append(f"The weather service says otherwise ({served}).")
            if words is text and heard != "none" and more_careful(seen, AS_SEEN[heard]) != seen:
                where = "on a slippery road" if heard == "slippery" and AS_SEEN[heard] not in asked else ""
                asked.append(AS_SEEN[heard])
                doubts.append(f"You say that {SAID[heard]}.")
            sure = {name for name in self._engine.trusted if read.shares.get(name, 1.0) >= SURE}
            scene = scene_words(read.values, sure)
            readings.append(read)
            held = {name: read.values[name] for name in ("style", "lead", "road")}
            if doubts:  # without the picture: what is seen outweighs the words that are given beside it
                for weather in sorted(set(asked[1:]), key=SEEN_WEATHERS.index):
                    known = {**given, **held, "weather": weather, "grade": "heavy"}
                    readings.append(self._engine.read(words, None, known))
        read = readings[-1]
        policy, shift = max((self._tasted(one, request.history, recall) for one in readings), key=_care)
        if not doubts:
            return _Made(read, policy, shift, scene, f"{scene} {thought_words(read.values)}")
        scene = " ".join([scene, *doubts])
        of = "the worst of all" if len(doubts) > 1 else "the worse of the two"
        return _Made(read, policy, shift, scene, f"{scene} I go by {of}. {thought_words(read.values, where)}")

    def _tasted(self, read: VlmReading, history: History, recall: int) -> tuple[ActionMatrix, float]:
        """Gains of a reading as this person likes them, and by how much more careful than the words alone ask for."""
        if recall:
            return read.policy, -STEP * (0, -1, 1)[recall]
        style, weather = STYLES.index(read.values["style"]), SEEN_WEATHERS.index(read.values["weather"])
        items = (item for item in history.items if item.intent == INTENT)
        shift = taste_of(judged_drives(items, style, weather, SIMILAR))
        shift = max(shift, 0.0) if weather else shift  # never bolder in bad weather
        shift = 0.0 if abs(shift) < _LEAST_SHIFT else round(shift, 3)
        return (moved(read.policy, shift) if shift else read.policy), shift


def _care(made: tuple[ActionMatrix, float]) -> float:
    return care(made[0])


def task_of(situation: Situation) -> str:
    """The manoeuvre that is due: at a stand, to pull away; with several lanes, to change; with one, to turn."""
    if situation.speed_mps < _STANDS_MPS:
        return "acceleration"
    return "lane_change" if situation.lane_count > 1 else "left_turn"


def recalled(history: History) -> int:
    """The correction by the newest feedback on a similar wish, as an index of `RECALLS`.

    What was liked is done again as it was; what was too much or too little moves by one step from how it was.
    """
    similar = [item for item in history.items if item.intent == INTENT and item.similarity >= SIMILAR and item.feedback]
    if not similar:
        return 0
    item = max(similar, key=lambda one: one.when)
    before = int(dict(item.settings).get(RECALL_SETTING, 0.0))
    asked = max(-1, min(1, before + sign_of(item.feedback[-1])))
    return RECALLS.index({-1: "gentler", 0: "none", 1: "brisker"}[asked])


def _contradicted(seen: str, situation: Situation) -> str:
    """The weather service's kind of weather where it is not what is seen; empty where it fits or is unknown."""
    told = weather_of(situation)
    if told == UNKNOWN:
        return ""
    kinds = [name for bit, name in ((SNOW, "snow"), (RAIN, "rain"), (FOG, "fog")) if told & bit]
    if seen in kinds or (not kinds and seen in _DAMP):
        return ""
    return kinds[0] if kinds else "sunny"
