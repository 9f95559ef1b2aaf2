"""The on-board model's reading of a wish as parameters: the same understanding, guard and history as its programs.

Parameters say a speed, a lane and how closely the path is followed; the gap is kept by the vehicle's own cruise
control. A wish for something else is declined in words, and so is one that takes several steps in time.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final, Literal

from chauffeur.concept import History, Limits, Parameters, Plan, PlanRequest, Situation, Thoughts
from chauffeur.language import measured
from chauffeur.language.meaning.reader import read
from chauffeur.language.text_classifier import load_sorter, negated
from chauffeur.memory.conflicts import conflicts_in
from chauffeur.planners.arbitration import (
    SURE,
    Wish,
    asked,
    intent_pace,
    unanswered,
    undenied,
    wary_of,
    within_mood,
)
from chauffeur.planners.base import declined, planned
from chauffeur.planners.onboard.dialect import DialectStep
from chauffeur.planners.onboard.doubts import foreign
from chauffeur.planners.onboard.exemplars.library import number
from chauffeur.planners.onboard.language_model import LanguageModelPlanner, Settled, usage_of
from chauffeur.planners.onboard.options import Chosen, Declined, speed_words
from chauffeur.planners.onboard.personal import Leaning
from chauffeur.planners.onboard.thoughts import thoughts_of
from chauffeur.planners.onboard.town import TownStep, snippets, steps_of, town_destination
from chauffeur.planners.talk2drive.habits import SIGN_SETTING, kind_of, pace_of, speed_for
from chauffeur.planners.talk2drive.hints import HINT_KINDS, WEIGHTS, Hint, goes_with, hint_of
from chauffeur.planners.talk2drive.lanes import eased_mps, fitting_mps, mood_lane, passing_mps, unsaid_turn
from chauffeur.planners.talk2drive.outright import Outright
from chauffeur.planners.talk2drive.style import (
    BRISK_SHARE,
    LOOK_AHEAD,
    LOOK_AHEAD_PARKING,
    PARKING_MPS,
    LookAhead,
    manner_of,
    named_spot,
    place_of,
)
from chauffeur.planners.weather_doubts import never_faster
from chauffeur.safety.dangers import danger
from chauffeur.worlds.town.recipes import PLACE_KINDS

_STANDING: Final = frozenset({"stop", "pull_over"})
_ELSEWHERE: Final[dict[str, str]] = {
    "gap": "With these parameters the cruise control keeps the gap; I can drive slower or faster instead.",
    "yield": "With these parameters I cannot make room for others; I can slow down if you want.",
    "pull_over": "With these parameters I cannot pull over; I can slow down or stop.",
}
"""What cannot be said in parameters, by the first part of its intent."""
_WHERE_TO: Final = "I am not sure what you want. Shall I turn at the junction, and to which side?"
_OFF_TOPIC: Final = "I only drive"
"""Words with which the model declines what is no wish about driving."""
_GIVES_WAY_SHARE: Final = 0.8
"""Of the present speed, as for a careful drive."""
_SURE: Final = 0.35
"""From this share words are taken for what they were sorted as, if they were read otherwise."""
_PLAINLY: Final = 0.98
_SURER: Final = 0.6
"""The same where the model surely (from 0.98) read something that no hint is sorted as, and for something brisk where
it took the words for what must not be done."""
_PASSING: Final = frozenset({"overtake", "overtaking", "pass", "passing", "past"})
"""Who is told not to do this, and read that, does not."""
_BRISK: Final = ("pass", "hurry", "faster", "go")
_NOT_FOR_ME: Final = "I only drive, and I take it that this was not meant for me; say it again if I am wrong."
_WORDS: Final[dict[str, str]] = {
    "pass": "Overtake the car ahead.",
    "stay": "Stay behind the car ahead.",
    "right": "Change to the right lane.",
    "hurry": "I'm in a hurry.",
    "calm": "Drive calmly, please.",
}
"""What a hint asks for, in words that are read as any others."""
_TAKEN: Final[dict[str, str]] = {
    "pass": "I take it that the car ahead is too slow for you.",
    "stay": "I take it that nobody need be passed.",
    "right": "I take it that you would rather be in the right lane.",
    "hurry": "I take it that you are in a hurry.",
    "calm": "I take it that you would like a calm drive.",
    "go": "I take it that you want to get across.",
    "yield": "I take it that others are to go first.",
    "faster": "I take it that this is too slow for you.",
    "slower": "I take it that this is too fast for you.",
}
_ANY_SPOT: Final = "nearest"
"""Read where nothing of the words says which spot."""
_PACES: Final = ("speed.increase", "speed.decrease")
_PACE_OF_HINT: Final = {"pass": 1, "hurry": 1, "faster": 1, "go": 1, "calm": -1, "slower": -1, "yield": -1}
_SIDE_OF_HINT: Final = {"right": "right", "pass": "left"}
"""Where a hint leads, and at what pace: words that say the same do not contradict it."""
_WARY_SHARE: Final = 0.5
"""Of the limit; who drives slower than that may speed up so far, whatever they say of the road."""
_AT_ONCE: Final = "With these parameters I can only do things at once. Tell me when it is time."
_LONGEST_GAP_M: Final = 150.0
"""No gap to keep is longer: so far ahead a vehicle counts as one to follow."""
_ONE_BY_ONE: Final = "With these parameters I can do one thing at a time. What shall I do first?"


class EmbeddedParameters:
    """Plans parameters with the language model of the package."""

    def __init__(self, model: LanguageModelPlanner) -> None:
        self._model = model
        load_sorter(WEIGHTS)  # with the model, not with the first wish

    @property
    def id(self) -> str:
        """Registry name."""
        return "talk2drive"

    @property
    def model(self) -> str:
        """Version of the model that reads the words."""
        return self._model.model

    @never_faster
    async def plan(self, request: PlanRequest) -> Plan:
        """One plan; what is not understood, not possible or no matter of parameters is declined in words."""
        begun = time.perf_counter()
        plan = undenied(self, _heeding(self._understood(request, begun), request), request, begun)
        return replace(plan, planner=self.id)  # what the model's own reading declines is signed by it

    def _understood(self, request: PlanRequest, begun: float) -> Plan:
        said, situation = request.instruction.text, request.context.situation
        if foreign(said) or danger(said):  # which the model's own reading refuses, whatever of it was taken back
            return self._as_read(self._model.settle(_compared(request), begun), request, begun)
        ready = Wish.of(self, request.instruction, begun)
        if ready.declined is not None:
            return ready.declined
        wish = ready.instruction.text
        request = replace(request, instruction=ready.instruction)
        outright = Outright.of(read(wish))
        if outright.asks:
            return declined(self, _NOT_FOR_ME, begun, intent="refuse")
        if situation.world == "town":
            steps = steps_of(wish, snippets()) or ()
            if place := town_destination(wish) or _got_out_at(steps):
                return self._take_to(place, request, begun)
            if later := _later(steps):
                return declined(self, later, begun)
            if plainly := _plain_words(steps):  # on other roads "turn right" may be a change of the lane
                request = replace(request, instruction=replace(request.instruction, text=plainly))
        settled = self._model.settle(_compared(request), begun)
        if isinstance(settled, Plan) and settled.alarm == "stop":
            return settled  # no hint outweighs it
        reads = () if isinstance(settled, Plan) else tuple(map(kind_of, settled.linked.choice.intent.split("+")))
        known = situation.world in HINT_KINDS
        hint = hint_of(wish, situation, request.history, reads[0] if reads else "") if known else None
        if situation.world == "parking" and (spot := _spot_read(wish, settled, hint)):
            return self._park(spot, request, begun)
        if hint is not None and self._overrules(hint, settled, reads, wish, situation.world, outright):
            return self._or_asked(self._as_meant(hint, request, begun), hint, request, begun)
        alike = hint is not None and any(goes_with(read, hint.kind) for read in reads)
        return self._as_read(settled, request, begun) if alike else self._asked_first(settled, request, begun)

    def _asked_first(self, settled: Settled | Plan, request: PlanRequest, begun: float) -> Plan:
        """The wish as its words were read, or the question whether they were read rightly."""
        plan = self._as_read(settled, request, begun)
        if isinstance(settled, Plan) or plan.policy is None:
            return plan
        asks = settled.question(request)
        if not asks:
            return plan
        question = asked(self, asks, begun, offer=settled.wish, raw=plan.raw)
        return undenied(self, question, request, begun, meant=settled.linked.choice.intent)

    def _or_asked(self, plan: Plan, hint: Hint, request: PlanRequest, begun: float) -> Plan:
        """The plan for a hint, or, if that is not sure, the question whether it is meant."""
        if plan.policy is None or hint.outright or hint.because or hint.share >= _SURER or hint.kind not in _TAKEN:
            return plan
        question = unanswered(request.instruction, f"{_TAKEN[hint.kind]} Is that right?")
        return asked(self, question, begun, offer=request.instruction.text) if question else plan

    def _overrules(
        self, hint: Hint, settled: Settled | Plan, reads: Sequence[str], wish: str, world: str, outright: Outright
    ) -> bool:
        """True if what words hint at counts for more than how they were read."""
        amounts = measured(wish)
        if hint.kind == "else" or _asks_an_amount(amounts, settled, world):
            return False
        side, pace = _SIDE_OF_HINT.get(hint.kind, ""), _PACE_OF_HINT.get(hint.kind, 0)
        if not hint.outright and outright.contradicts(side=side, pace=pace):
            return False
        if isinstance(settled, Plan):
            sure = _SURER if _forbidden(settled) and hint.kind in _BRISK else _SURE
            return hint.kind != "none" and hint.share >= sure
        if not hint.outright and settled.written.sure >= SURE and settled.witnessed and outright.plain:
            return any(goes_with(read, hint.kind) for read in reads) and hint.kind == "go"
        if any(dimension == "time" for dimension, _ in amounts) and any(map(_in_time, settled.steps)):
            return False
        if any(goes_with(read, hint.kind) for read in reads):
            return hint.kind == "go"  # read alike, it is still to be driven without dawdling
        if hint.kind == "pass" and not hint.outright and "stay" in reads and _PASSING & negated(wish):
            return False
        plainly = not any(reads) and settled.written.sure >= _PLAINLY  # a turn, a stop, the left lane
        return hint.share >= (_SURER if plainly else _SURE)

    def _as_meant(self, hint: Hint, request: PlanRequest, begun: float) -> Plan:
        """The plan for a hint."""
        if hint.kind == "none":
            return declined(self, _NOT_FOR_ME, begun, intent="refuse")
        if place := hint.kind.partition("park.")[2]:
            plan = self._park(place, request, begun)
        elif hint.kind == "go":
            plan = self._go(request, begun)
        elif hint.kind == "yield":
            plan = self._give_way(request, begun)
        elif hint.kind in ("faster", "slower"):
            plan = self._changed(1 if hint.kind == "faster" else -1, request, begun)
        else:
            asked = replace(request, instruction=replace(request.instruction, text=_WORDS[hint.kind]))
            plan = self._as_read(self._model.settle(_compared(asked), begun, shown=False), asked, begun)
        because = " ".join(part for part in (hint.because, _TAKEN.get(hint.kind, "")) if part)
        return replace(plan, thoughts=Thoughts(f"{because} {plan.thoughts.text}".strip()))

    def _as_read(self, settled: Settled | Plan, request: PlanRequest, begun: float) -> Plan:
        """The wish as its words were read, with the speed this person likes for such wishes."""
        if isinstance(settled, Plan):
            return settled
        wish, situation = request.instruction.text, request.context.situation
        linked, used = settled.linked, settled.used
        intent = linked.choice.intent
        if situation.world == "parking" and _parks(intent):
            return self._park(place_of(wish) or "nearest", request, begun)
        if unsaid_turn(wish, intent):
            return declined(self, _WHERE_TO, begun, intent="ask", raw=settled.written.text)
        found = parameters_of(settled, request.limits)
        if situation.world == "intersection" and intent == "yield":
            return self._give_way(request, begun)
        if isinstance(found, Declined):
            return declined(self, found.words, begun, intent=intent, raw=settled.written.text)
        found, why = _at_pace(found, intent, request)
        thoughts = thoughts_of(linked.meanings, linked.choice, settled.situation, used, does=does(found))
        words = " ".join((*why, thoughts, *_overruled(request.history, used)))
        plan = self._plan(found, words, intent, request, begun, used)
        return replace(plan, usage=usage_of(settled.written), raw=settled.written.text)

    def _go(self, request: PlanRequest, begun: float) -> Plan:
        """Over a crossing without dawdling; the stop at the sign is the car's own."""
        situation = request.context.situation
        sign = situation.speed_limit_mps
        speed = min(BRISK_SHARE * sign, request.limits.most_mps(sign))
        return self._paced(_parameters(speed, LOOK_AHEAD["usual"], "straight"), "turn.straight", request, begun)

    def _give_way(self, request: PlanRequest, begun: float) -> Plan:
        """Towards a crossing where others go first: the car gives way by itself, so it is the approach that counts."""
        speed = _GIVES_WAY_SHARE * request.context.situation.speed_mps
        wants = "You want others to go first."
        return self._paced(_parameters(speed, LOOK_AHEAD["gentle"], "straight"), "yield", request, begun, wants)

    def _changed(self, sign: int, request: PlanRequest, begun: float) -> Plan:
        """A complaint on the pace: another speed in the same lane."""
        situation = request.context.situation
        speed = eased_mps(sign, situation, request.limits)
        if situation.world == "parking":
            found = _parameters(speed, LOOK_AHEAD_PARKING)
        else:
            look = LOOK_AHEAD["gentle" if sign < 0 else "usual"]
            found = _parameters(speed, look, "straight" if situation.world == "intersection" else "")
        return self._paced(found, "speed.decrease" if sign < 0 else "speed.increase", request, begun)

    def _park(self, place: str, request: PlanRequest, begun: float) -> Plan:
        speed = min(PARKING_MPS, request.limits.most_mps(request.context.situation.speed_limit_mps))
        found = _parameters(speed, LOOK_AHEAD_PARKING, place)
        return self._paced(found, "park", request, begun, "You want to park.")

    def _take_to(self, place: str, request: PlanRequest, begun: float) -> Plan:
        """To a place of a town. Whether it has such a place, the town says; the car keeps to its limits by itself."""
        limit = request.context.situation.speed_limit_mps
        found = _parameters(min(limit, request.limits.most_mps(limit)), LOOK_AHEAD["usual"], place)
        return self._plan(found, f"You want to go to {_the(place)}. I {does(found)}.", "go_to", request, begun)

    def _paced(self, found: Parameters, intent: str, request: PlanRequest, begun: float, wants: str = "") -> Plan:
        """A plan by rule, at the speed this person likes for such wishes."""
        found, why = _at_pace(found, intent, request)
        words = " ".join(part for part in (*why, wants, f"I {does(found)}.") if part)
        return self._plan(found, words, intent, request, begun)

    def _plan(
        self,
        found: Parameters,
        words: str,
        intent: str,
        request: PlanRequest,
        begun: float,
        used: Sequence[Leaning] = (),
    ) -> Plan:
        settings = _settings(found, request.context.situation, used)
        return planned(self, words, found, begun, intent=intent, settings=settings)


def _spot_read(wish: str, settled: Settled | Plan, hint: Hint | None) -> str:
    """The spot of the lot that a wish means, unless it is read as something else to do there; empty for none."""
    if spot := named_spot(wish):
        return spot
    reads = settled.intent != "refuse" if isinstance(settled, Plan) else _parks(settled.linked.choice.intent)
    place = place_of(wish) if reads else ""
    meant = "" if hint is None else hint.kind.partition("park.")[2]
    return meant or place if place == _ANY_SPOT else place


def _compared(request: PlanRequest) -> PlanRequest:
    """The same request with only those trips that memory found alike, which are what the model is shown."""
    return replace(request, history=History(tuple(item for item in request.history.items if item.similarity >= 0.0)))


def _the(place: str) -> str:
    """A place in a sentence: the kinds of our own towns take an article, names do not."""
    return f"the {place}" if place.replace(" ", "_") in PLACE_KINDS else place


def _parameters(speed_mps: float, look: LookAhead, route: str = "") -> Parameters:
    return Parameters(round(speed_mps, 2), look.distance_m, look.ratio_s, 0, route)


def _asks_an_amount(amounts: Sequence[tuple[str, float]], settled: Settled | Plan, world: str) -> bool:
    """True if words name a speed, or a distance that may be one to keep: our exit two miles on is none."""
    if any(dimension == "speed" for dimension, _ in amounts):
        return True
    if world == "parking" or not any(kind == "distance" and value <= _LONGEST_GAP_M for kind, value in amounts):
        return False
    return isinstance(settled, Plan) or any(step.intent.startswith("gap") for step in settled.linked.choice.steps)


def _parks(intent: str) -> bool:
    """True if a wish in a lot, read as `intent`, is rather one for a spot: it says nothing of how to drive there."""
    return not intent.startswith(("speed.", "style.", "stop"))


def _forbidden(declined: Plan) -> bool:
    """True if it was declined for what it asks for, not for want of understanding."""
    return declined.intent == "refuse" and not declined.refusal.startswith(_OFF_TOPIC)


def _at_pace(found: Parameters, intent: str, request: PlanRequest) -> tuple[Parameters, tuple[str, ...]]:
    """Parameters at the speed this person likes for such wishes, and why in words.

    A mood that calms goes above the present speed only for who found that too slow, one that quickens below it only for
    who found that too fast.
    """
    situation = request.context.situation
    sign, chosen = situation.speed_limit_mps, found.target_speed_mps
    most, mood = request.limits.most_mps(sign), intent_pace(intent)
    pace = pace_of(request.history, situation.world, intent, chosen / sign) if chosen > 0.0 and sign > 0.0 else None
    liked = None if pace is None else speed_for(pace, intent, situation.speed_mps, sign, most)
    speed = chosen if liked is None else liked
    if pace is not None and pace.share * sign <= chosen:
        speed = min(speed, chosen)  # also below the least speed
    if pace is None or pace.sign != -mood or not intent.startswith("style."):
        speed = within_mood(speed, mood, situation.speed_mps, most)
    why = (pace.because,) if pace is not None and pace.because and liked is not None and speed != chosen else ()
    return replace(found, target_speed_mps=round(speed, 2)), why


def _heeding(plan: Plan, request: PlanRequest) -> Plan:
    """A plan for a mood that quickens, where the person says that the road is bad: no faster than now, in this lane."""
    found, situation = plan.policy, request.context.situation
    if not isinstance(found, Parameters) or not wary_of(request.instruction.text, plan.intent):
        return plan
    speed = min(found.target_speed_mps, max(situation.speed_mps, _WARY_SHARE * situation.speed_limit_mps))
    heeding = replace(found, target_speed_mps=round(speed, 2), lane=0)
    words = f"You want to get there sooner. For what you say of the road I lose no time, but {does(heeding)}."
    settings = tuple(dict((*plan.settings, ("target_speed_mps", heeding.target_speed_mps))).items())
    return replace(plan, policy=heeding, thoughts=Thoughts(words), settings=settings)


def _settings(found: Parameters, situation: Situation, used: Sequence[Leaning]) -> tuple[tuple[str, float], ...]:
    own = (("target_speed_mps", found.target_speed_mps), (SIGN_SETTING, round(situation.speed_limit_mps, 3)))
    return (*own, *(pair for one in used for pair in one.settings))


def _overruled(history: History, used: Sequence[Leaning]) -> Iterator[str]:
    """Contradictions between the feedback that is followed and earlier feedback, with the dates of both."""
    for conflict in conflicts_in(history):
        if conflict.used.source == "feedback" and any(conflict.used.words in one.because for one in used):
            yield conflict.to_person()


def parameters_of(settled: Settled, limits: Limits) -> Parameters | Declined:
    """The settled wish as parameters, or the reason why parameters cannot express it."""
    steps = settled.linked.choice.steps
    if any(_in_time(step) for step in settled.steps):
        return Declined(_AT_ONCE)
    if any(_sideways(step) for step in steps[1:]) and not _one_deed(steps):
        return Declined(_ONE_BY_ONE)  # which of them comes first is lost in one set of numbers
    for step in steps:
        kind = step.intent.partition(".")[0]
        if kind in _ELSEWHERE:
            return Declined(_ELSEWHERE[kind])
    if settled.situation.lane_index == 0 and _lane(steps) < 0:
        return Declined("We are in the leftmost lane; with these parameters I pass others on the left only.")
    turn = next((step.intent.partition(".")[2] for step in steps if step.intent.startswith("turn.")), "")
    look = LOOK_AHEAD[manner_of(settled.linked.choice.intent, gentle=any(one.gentle for one in settled.used))]
    intent, lane = settled.linked.choice.intent, _lane(steps)
    leaning = sum(one.speed_mps for one in settled.used)
    speed = fitting_mps(_speed(steps, settled.situation.speed_mps), intent, settled.situation, limits, leaning)
    mood = mood_lane(intent, settled.situation) if not lane else 0
    if mood < 0:
        speed = passing_mps(settled.situation, speed, leaning)
    return Parameters(round(speed, 2), look.distance_m, look.ratio_s, lane or mood, turn)


def _in_time(step: DialectStep) -> bool:
    """True if it is to be done later, or depends on more than a free lane, which the car sees to by itself."""
    depends = step.condition is not None and not step.condition.name.startswith("clear_")
    return depends or step.wait_s is not None


def _got_out_at(steps: Sequence[TownStep]) -> str:
    """The place of a town to be let out at; empty for none."""
    return steps[0].place if len(steps) == 1 and steps[0].out else ""


def _later(steps: Sequence[TownStep]) -> str:
    """Reason why steps through a town do not fit parameters: several, or one for later. Empty if they do."""
    if len(steps) > 1:
        return _ONE_BY_ONE
    bound = any(step.place or step.nth > 1 or step.after_m is not None or step.before_junction for step in steps)
    return _AT_ONCE if bound else ""


def _plain_words(steps: Sequence[TownStep]) -> str:
    """A turn, or a stop to get out, in words that are read as nothing else; empty where it is neither."""
    if not steps:
        return ""
    if steps[0].out:
        return "Stop the car."
    return f"Turn {steps[0].turn} at the next junction." if steps[0].turn in ("left", "right") else ""


def _sideways(step: Chosen) -> bool:
    """True if it leaves the lane, if only for a while."""
    return step.lanes_moved != 0 or step.intent.startswith("overtake")


def _one_deed(steps: tuple[Chosen, ...]) -> bool:
    """True if it is a change of the lane, faster or slower, which may be done at the same time."""
    return len(steps) == 2 and steps[0].intent in _PACES


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
    """The effect of parameters, as a clause after "I"."""
    speed = parameters.target_speed_mps
    pace = "stop" if speed == 0.0 else f"set the target speed to {speed_words(speed)}"
    way = _WAY_WORDS.get(parameters.route, f", take the way to {_the(parameters.route)}") if parameters.route else ""
    return (
        f"{pace}{_LANE_WORDS[parameters.lane]}{way}, and look ahead {number(parameters.look_ahead_ratio)} s "
        f"along my path, {number(parameters.look_ahead_m)} m at least"
    )
