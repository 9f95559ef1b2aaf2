"""The on-board model's reading of a wish as parameters: the same understanding, guard and history as its programs.

Parameters say a speed, a lane and how closely the path is followed; the gap is kept by the vehicle's own cruise
control. A wish for something else is declined in words, and so is one that takes several steps in time.
"""

from __future__ import annotations

import time
from typing import Final, Literal

from chauffeur.concept import Parameters, Plan, PlanRequest, Thoughts
from chauffeur.planners.base import declined
from chauffeur.planners.onboard.exemplars.library import number
from chauffeur.planners.onboard.language_model import LanguageModelPlanner, Settled, usage_of
from chauffeur.planners.onboard.options import Chosen, Declined, speed_words
from chauffeur.planners.onboard.thoughts import thoughts_of
from chauffeur.planners.talk2drive.style import LOOK_AHEAD, LOOK_AHEAD_PARKING, PARKING_MPS, manner_of, place_of

_STANDING: Final = frozenset({"stop", "pull_over"})
_ELSEWHERE: Final[dict[str, str]] = {
    "gap": "With these parameters the cruise control keeps the gap; I can drive slower or faster instead.",
    "yield": "With these parameters I cannot make room for others; I can slow down if you want.",
    "pull_over": "With these parameters I cannot pull over; I can slow down or stop.",
}
"""What cannot be said in parameters, by the first part of its intent."""
_ONE_BY_ONE: Final = "With these parameters I can do one thing at a time. What shall I do first?"


class EmbeddedParameters:
    """Plans parameters with the language model of the package."""

    def __init__(self, model: LanguageModelPlanner) -> None:
        self._model = model

    @property
    def id(self) -> str:
        """Registry name."""
        return "talk2drive"

    @property
    def model(self) -> str:
        """Version of the model that reads the words."""
        return self._model.model

    async def plan(self, request: PlanRequest) -> Plan:
        """One plan; what is not understood, not possible or no matter of parameters is declined in words."""
        begun = time.perf_counter()
        if request.context.situation.world == "parking" and (place := place_of(request.instruction.text)):
            return self._park(place, request, begun)
        settled = self._model.settle(request, begun)
        if isinstance(settled, Plan):
            return settled
        found = parameters_of(settled)
        if isinstance(found, Declined):
            return declined(self, found.words, begun, intent=settled.linked.choice.intent, raw=settled.written.text)
        linked, used = settled.linked, settled.used
        return Plan(
            thoughts=thoughts_of(
                linked.reading,
                [does(found)],
                settled.situation,
                assumed=[sentence for step in linked.choice.steps for sentence in step.assumed],
                because=[one.because for one in used],
            ),
            policy=found,
            intent=linked.choice.intent,
            settings=(("target_speed_mps", found.target_speed_mps), *(pair for one in used for pair in one.settings)),
            planner=self.id,
            model=self.model,
            latency_s=time.perf_counter() - begun,
            usage=usage_of(settled.written),
            raw=settled.written.text,
        )

    def _park(self, place: str, request: PlanRequest, begun: float) -> Plan:
        look = LOOK_AHEAD_PARKING
        speed = round(min(PARKING_MPS, request.limits.most_mps(request.context.situation.speed_limit_mps)), 2)
        found = Parameters(speed, look.distance_m, look.ratio_s, 0, place)
        return Plan(
            thoughts=Thoughts(f"You want to park. I {does(found)}."),
            policy=found,
            intent="park",
            settings=(("target_speed_mps", found.target_speed_mps),),
            planner=self.id,
            model=self.model,
            latency_s=time.perf_counter() - begun,
        )


def parameters_of(settled: Settled) -> Parameters | Declined:
    """What was settled as parameters, or why it is no matter of parameters."""
    steps = settled.linked.choice.steps
    if len(steps) > 1 and any(step.lanes_moved for step in steps[1:]):
        return Declined(_ONE_BY_ONE)  # which of them comes first is lost in one set of numbers
    for step in steps:
        kind = step.intent.partition(".")[0]
        if kind in _ELSEWHERE:
            return Declined(_ELSEWHERE[kind])
    if settled.situation.lane_index == 0 and _lane(steps) < 0:
        return Declined("We are in the leftmost lane; with these parameters I pass others on the left only.")
    turn = next((step.intent.partition(".")[2] for step in steps if step.intent.startswith("turn.")), "")
    look = LOOK_AHEAD[manner_of(settled.linked.choice.intent, gentle=any(one.gentle for one in settled.used))]
    speed = _speed(steps, settled.situation.speed_mps)
    return Parameters(speed, look.distance_m, look.ratio_s, _lane(steps), turn)


def _speed(steps: tuple[Chosen, ...], now_mps: float) -> float:
    speed = now_mps
    for step in steps:
        if step.intent.partition(".")[0] in _STANDING:
            speed = 0.0
        speed = dict(step.settings).get("target_speed_mps", speed)
    return round(speed, 2)


def _lane(steps: tuple[Chosen, ...]) -> Literal[-1, 0, 1]:
    if any(step.intent.startswith("overtake") for step in steps):  # which may end in the lane it began in
        return 1 if any(step.intent == "overtake.right" for step in steps) else -1
    moved = sum(step.lanes_moved for step in steps)
    return 1 if moved > 0 else -1 if moved < 0 else 0


_LANE_WORDS: Final = {-1: ", change one lane to the left", 0: ", keep my lane", 1: ", change one lane to the right"}


_WAY_WORDS: Final = {
    "left": ", turn left",
    "right": ", turn right",
    "straight": ", go straight on",
    "nearest": ", take the nearest free spot",
    "stadium": ", take the free spot nearest to the stadium",
    "exit": ", take the free spot nearest to the exit",
}


def does(parameters: Parameters) -> str:
    """What parameters make the car do, as a clause after "I"."""
    speed = parameters.target_speed_mps
    pace = "stop" if speed == 0.0 else f"set the target speed to {speed_words(speed)}"
    way = _WAY_WORDS.get(parameters.route, f", take the way to {parameters.route}") if parameters.route else ""
    return (
        f"{pace}{_LANE_WORDS[parameters.lane]}{way}, and look ahead {number(parameters.look_ahead_ratio)} s "
        f"along my path, {number(parameters.look_ahead_m)} m at least"
    )
