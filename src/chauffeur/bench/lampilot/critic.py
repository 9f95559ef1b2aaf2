"""Critics of a drive: a person at the terminal, or the benchmark's evaluator, whose verdict is put into words.

The evaluator's critic knows the task and what could be seen of the drive, and nothing else: no cause inside the
simulator, and nothing of what would have happened. Wherever a result rests on it, that is said (`CRITIC_LABELS`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from chauffeur.bench.lampilot.seen import STANDING_MPS, SeenCommands, watch
from chauffeur.driving.planning import declined
from chauffeur.driving.recording import RecordedTrip
from chauffeur.memory.policies_entry import Judge
from chauffeur.worlds.highway.dblv1 import Item


@dataclass(frozen=True, slots=True)
class Attempt:
    """One program for an item, and what came of it.

    Attributes:
        item: The item.
        number: From 1.
        recorded: Plan, verdicts and drive.
        success: Whether the benchmark's evaluator calls the task done, without a collision.
        offered: Names of the repository's programs that the model was offered.
    """

    item: Item
    number: int
    recorded: RecordedTrip
    success: bool
    offered: tuple[str, ...] = ()

    @property
    def must_refuse(self) -> bool:
        """True if the right answer to this item's wish is to decline it."""
        return self.item.scenario.goal.get("type") == "RefuseEval"

    @property
    def refusal(self) -> str:
        """Reason it was not driven; empty when it was."""
        return declined(self.recorded.trip.plan, self.recorded.trip.verdicts)


@dataclass(frozen=True, slots=True)
class CriticJudgement:
    """A critic's decision.

    Attributes:
        kind: `keep` the program, `critique` it, `skip` the item, or `stop` coaching.
        words: What goes back to the model.
        by_checks: Whether these are the checks' own words, which the critic passes on.
    """

    kind: Literal["keep", "critique", "skip", "stop"]
    words: str = ""
    by_checks: bool = False


class Critic(Protocol):
    """Judges attempts."""

    @property
    def judge_id(self) -> Judge:
        """Identity of the critic; stands in every program it lets pass, and in every result of those."""
        ...

    def judge(self, attempt: Attempt) -> CriticJudgement:
        """Its judgement of one attempt."""
        ...


class EvaluatorCritic:
    """The benchmark's evaluator in words. It is not a person."""

    judge_id: Judge = "evaluator"

    def judge(self, attempt: Attempt) -> CriticJudgement:
        """Keep what the evaluator calls done; else what was wrong."""
        if attempt.success:
            return CriticJudgement("keep")
        if attempt.must_refuse:
            if attempt.recorded.trip.plan.refusal:
                return CriticJudgement("skip", "The wish was rightly declined; there is no program to keep.")
            return CriticJudgement("critique", "This wish must not be driven. Decline it, and say why in one sentence.")
        return CriticJudgement("critique", evaluator_words(attempt))


class PersonCritic:
    """A person who watched the drive.

    They answer `success` (done as asked: keep the program), `commit` (keep it, whatever the evaluator thinks), `skip`,
    `quit`, or say in words what was wrong. An empty answer passes on what the checks said of a program they refused.
    """

    judge_id: Judge = "person"

    def __init__(self, ask: Callable[[str], str | None]) -> None:
        """Take the way to ask: given a question, it returns the answer, or None when nobody answers any more."""
        self._ask = ask

    def judge(self, attempt: Attempt) -> CriticJudgement:
        """Ask until there is an answer that can be used."""
        question = "How was it? success, commit, skip, quit, or say what was wrong"
        while True:
            said = self._ask(question)
            if said is None:
                return CriticJudgement("stop")
            answer = " ".join(said.split())
            match answer.casefold().rstrip(".!"):
                case "quit" | "exit":
                    return CriticJudgement("stop")
                case "skip":
                    return CriticJudgement("skip")
                case "success" | "commit" as wanted:
                    problem = _not_to_be_kept(attempt, wanted)
                    if not problem:
                        return CriticJudgement("keep")
                    question = problem
                case "" if attempt.refusal:
                    return CriticJudgement("critique", f"The program was not driven: {attempt.refusal}", by_checks=True)
                case "":
                    question = "Say it in words, or: success, commit, skip, quit"
                case _:
                    return CriticJudgement("critique", answer)


def _not_to_be_kept(attempt: Attempt, wanted: str) -> str:
    """Reason an attempt cannot be kept on this word, as the next question; empty when it can."""
    if attempt.refusal:
        return "Nothing was driven, so there is nothing to keep. Say what to do better, or: skip, quit"
    if attempt.recorded.trip.outcome in ("collision", "off_road"):
        return "A program that crashed or left the road is not kept. Say what to do better, or: skip, quit"
    if wanted == "success" and not attempt.success:
        return "The evaluator does not call it done. Write commit to keep it all the same, or say what was wrong"
    return ""


def evaluator_words(attempt: Attempt) -> str:
    """Faults of an attempt, as the evaluator saw it."""
    trip = attempt.recorded.trip
    if trip.plan.refusal:
        return f"The wish was declined ({trip.plan.refusal}), but it can be tried here. Write a program."
    if attempt.refusal:
        return f"The program was not driven, because the checks refused it: {attempt.refusal}"
    seen = watch(attempt.recorded)
    if seen is None:
        return f"Nothing was driven. {trip.causes.detail}".strip()
    return " ".join(_sentences(attempt, seen))


def _sentences(attempt: Attempt, seen: SeenCommands) -> Iterator[str]:
    trip = attempt.recorded.trip
    if trip.causes.policy_failed:
        yield f"The program failed while it ran, and the autopilot drove on without it: {trip.causes.detail}"
    if seen.hit:
        yield f"The car crashed after {seen.duration_s:.1f} s, at {seen.speeds_mps[-1]:.1f} m/s, into {seen.hit}."
    elif trip.outcome == "off_road":
        where = "it came to the end of the road" if seen.road_ended else "it drove off its lane"
        yield f"The car left the road after {seen.duration_s:.1f} s: {where}."
    elif trip.outcome == "timeout":
        yield f"Road or time ran out after {seen.duration_s:.1f} s, and the task was not done."
    else:
        yield f"{seen.duration_s:.1f} s passed and the task was not done."
    goal = attempt.item.scenario.goal
    words = _GOALS.get(str(goal.get("type")))
    if words is not None:
        yield from words(goal, seen)
    if seen.ended_s is not None and seen.ended_s < seen.duration_s - 1.0:
        yield f"The program ended after {seen.ended_s:.1f} s; from then on the car only kept its last wishes."
    yield from _manner(seen)


def _speed(goal: dict[str, Any], seen: SeenCommands) -> Iterator[str]:
    target = float(goal["speed"]) if "speed" in goal else seen.speeds_mps[0] + float(goal["rel_speed"])
    last = seen.speeds_mps[-1]
    yield (
        f"The speed asked for is {target:.1f} m/s; the car never held it within 1 m/s for more than 5 s. It drove "
        f"between {min(seen.speeds_mps):.1f} and {max(seen.speeds_mps):.1f} m/s and was at {last:.1f} m/s in the end."
    )
    if seen.last_lead_mps is not None and seen.last_lead_mps < target - 1.0 and last < target - 1.0:
        yield f"A slower car, {seen.last_gap_m:.0f} m ahead at {seen.last_lead_mps:.1f} m/s, held it up in the end."


def _distance(goal: dict[str, Any], seen: SeenCommands) -> Iterator[str]:
    if seen.first_gap_m is None:
        return
    target = float(goal["distance"]) if "distance" in goal else seen.first_gap_m + float(goal["rel_distance"])
    now = "there was no car ahead any more" if seen.last_gap_m is None else f"it was {seen.last_gap_m:.1f} m"
    yield (
        f"The distance asked for is {target:.1f} m, centre to centre; it was never held within 30 % for more than 5 s. "
        f"It was {seen.first_gap_m:.1f} m at the start, {seen.least_gap_m:.1f} m at the least, and in the end {now}."
    )
    if seen.moves:
        move = seen.moves[0]
        yield f"The car changed lane to the {move.side} after {move.time_s:.1f} s, away from that car."


def _lane_change(goal: dict[str, Any], seen: SeenCommands) -> Iterator[str]:
    side = str(goal["direction"])
    yield from _lane_words(side, seen) or (f"It was not yet settled in the {side} lane when it was over.",)


def _overtake(goal: dict[str, Any], seen: SeenCommands) -> Iterator[str]:
    side = str(goal["direction"])
    missing = _lane_words(side, seen)
    yield from missing
    if missing:
        return
    if seen.passed:
        yield f"It passed the car, but was not in the {side} lane with that car more than 10 m behind."
    else:
        yield f"It was in the {side} lane, but the car it should pass was never more than 10 m behind."
        fastest = max(seen.speeds_mps)
        yield f"It drove at most {fastest:.1f} m/s and was at {seen.speeds_mps[-1]:.1f} m/s in the end."


def _lane_words(side: str, seen: SeenCommands) -> tuple[str, ...]:
    """Sentences on why the ego was not in the lane beside its first one; empty when it was there in the end."""
    sign = 1 if side == "right" else -1
    if seen.side == sign:
        return ()
    if not seen.moves:
        return (f"The car never changed into the {side} lane.",)
    told = ", ".join(f"{move.side} after {move.time_s:.1f} s" for move in seen.moves[:4])
    return (f"The lane asked for is the one to the {side}. The car changed lane: {told}.",)


def _pull_over(goal: dict[str, Any], seen: SeenCommands) -> Iterator[str]:
    del goal
    if seen.emergency_s is None:
        yield "The car never reached the emergency lane, the rightmost one."
    elif seen.stopped_s is None:
        yield (
            f"The car was in the emergency lane after {seen.emergency_s:.1f} s but never stood there; it was at "
            f"{seen.speeds_mps[-1]:.1f} m/s in the end."
        )
    else:
        yield "The car stood, but not in the emergency lane."


_TURNS = {"o1": "left", "o2": "straight", "o3": "right"}


def _route(goal: dict[str, Any], seen: SeenCommands) -> Iterator[str]:
    wanted = _TURNS.get(str(goal["direction"][1]), "the way asked for")
    if not seen.turns:
        yield f"The program chose no route; the wish is to go {wanted}."
    elif seen.turns[-1] != wanted:
        yield f"The program chose the route {seen.turns[-1]}; the wish is to go {wanted}."
    if seen.speeds_mps[-1] < STANDING_MPS and not seen.hit:
        yield "The car still stood in the end, as if it waited at the stop sign without ever driving on."
    elif not seen.hit:
        yield f"It did not drive out of the intersection by the exit {wanted}."


_GOALS: dict[str, Callable[[dict[str, Any], SeenCommands], Iterator[str]]] = {
    "ACCEvalbySpeed": _speed,
    "ACCEvalbyDistance": _distance,
    "LaneChangeEval": _lane_change,
    "OvertakeEval": _overtake,
    "PullOverEval": _pull_over,
    "IntersectionEval": _route,
}

_HARSH_MPS = 6.0
_NEAR_M = 8.0


def _manner(seen: SeenCommands) -> Iterator[str]:
    if seen.spread_mps > _HARSH_MPS:
        yield f"It braked and accelerated hard: its speed varied by {seen.spread_mps:.0f} m/s."
    if seen.least_gap_m is not None and seen.least_gap_m < _NEAR_M and not seen.hit:
        yield f"It came as near as {seen.least_gap_m:.1f} m, centre to centre, to the car ahead."
