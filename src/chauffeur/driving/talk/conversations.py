"""Wishes as conversations: what was said, thought, judged, driven and felt, gathered from what the drive tells."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from typing import Final

from chauffeur.concept import Feedback, History, HistoryItem, Parameters, Plan, Policy, Program, Verdict
from chauffeur.concept.units import people_speed
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.judge.account import unused_of
from chauffeur.driving.live.messages import Report
from chauffeur.driving.live.supervisor import Interaction
from chauffeur.driving.talk.messages import Conversation, HowWasIt, StageTimes, VerdictShown
from chauffeur.driving.talk.wish_queue import Words
from chauffeur.geometry.road_graph import TURNS
from chauffeur.programs.loops import has_end

FELT_AFTER_S: Final = 3.0
"""A wish that was driven for less, in the car's time, cannot have been felt: nobody is asked about it."""
MOST_SAID_SHOWN: Final = 40
"""What a plan said last; every screen is told a conversation anew whenever something is added to it."""

_EARLIER: Final = "(What was said earlier is not shown.)"
_LANES: Final = {-1: "one to the left", 0: "the present one", 1: "one to the right"}


@dataclass(slots=True)
class _Wish:
    """A conversation, and what is needed to go on with it."""

    shown: Conversation
    words: Words
    asked_s: float
    planned_s: float | None = None
    started_s: float | None = None
    felt_from_s: float | None = None
    trip: int = 0
    plan: Plan | None = None
    asked_how: bool = False


class Conversations:
    """All conversations of a session, by their wish."""

    def __init__(
        self,
        dt_s: float,
        clock: Callable[[], float],
    ) -> None:
        """None yet.

        Args:
            dt_s: Control period in the car's time.
            clock: Monotonic time, s.
        """
        self._dt_s, self._clock = dt_s, clock
        self._wishes: dict[str, _Wish] = {}
        self._trip, self._now_s = 0, 0.0

    def __iter__(self) -> Iterator[Conversation]:
        return (each.shown for each in self._wishes.values())

    def __getitem__(self, wish: str) -> Conversation:
        return self._wishes[wish].shown

    def __contains__(self, wish: str) -> bool:
        return wish in self._wishes

    @property
    def last_felt(self) -> str:
        """The newest wish that was driven; empty where none was."""
        return next((name for name in reversed(self._wishes) if self._wishes[name].felt_from_s is not None), "")

    def newest(self, wish: str) -> bool:
        """Whether no wish came after this one but such as ended before they were driven."""
        later = list(self._wishes.values())[list(self._wishes).index(wish) + 1 :]
        return all(each.shown.stage == "closed" and each.started_s is None for each in later)

    def asked(self, wish: str, words: Words) -> Conversation:
        """A wish was handed on."""
        shown = Conversation(wish, words.text, words.spoken, follows=words.follows)
        stages = StageTimes(wait_s=words.wait_s, recognise_s=words.recognise_s)
        self._wishes[wish] = _Wish(replace(shown, stages=stages), words, self._clock())
        return self[wish]

    def change(self, wish: str, **changes: object) -> Conversation:
        """Something besides the events of a wish, such as `opinion` or `remembered`."""
        each = self._wishes[wish]
        each.shown = replace(each.shown, **changes)  # pyright: ignore[reportArgumentType]
        return each.shown

    def event(self, event: DriveEvent, interaction: Interaction | None) -> Conversation | None:
        """What became of a wish; None where it is about none of this session."""
        each = self._wishes.get(event.wish)
        if each is None or interaction is None:
            return None
        shown, now_s = each.shown, self._clock()
        stages = shown.stages
        match event.kind:
            case "planning":
                turn = interaction.request.turn
                shown = replace(shown, stage="asked", why="" if turn == 1 else f"Asked once more ({turn - 1}).")
            case "planned":
                each.planned_s = now_s
                stages = replace(stages, plan_s=now_s - each.asked_s)
                shown = replace(shown, stage=interaction.stage, thoughts=shown.thoughts or event.text, why="")
            case "started":
                each.started_s = now_s
                stages = replace(stages, check_s=None if each.planned_s is None else now_s - each.planned_s)
                each.felt_from_s, each.trip = event.tick * self._dt_s, event.trip
                shown = replace(shown, stage="driven", why="")
            case "resumed":
                shown = replace(shown, stage="driven", why=event.text)
            case "waits":
                shown = replace(shown, waits=event.text)
            case "said":
                shown = replace(shown, said=_most((*shown.said, event.text)))
            case _:
                shown = replace(shown, why=event.text)
        if event.final:
            unused = () if each.plan is None else unused_of(shown.text, each.plan)
            left_out = f"I did not use: {', '.join(f'“{part}”' for part in unused)}." if unused else ""
            why = " ".join(text for text in (event.text, left_out) if text)
            shown = replace(shown, stage="closed", waits="", outcome=event.kind, result=event.result or "", why=why)
        each.shown = replace(shown, stages=stages)
        return each.shown

    def recalled(self, wish: str, history: History) -> None:
        """What of the person's history a plan is made with; shown with the plan, which follows."""
        if wish in self:
            self.change(wish, recalled=recalled_of(history.items))

    def plan(self, wish: str, plan: Plan) -> Conversation | None:
        """What was planned; None where the wish is none of this session."""
        if wish not in self:
            return None
        self._wishes[wish].plan = plan
        kind, source = ("", "") if plan.policy is None else (plan.policy.kind, source_of(plan.policy))
        ends = plan.policy is not None and may_end(plan.policy)
        return self.change(wish, thoughts=plan.thoughts.text, policy=kind, source=source, verdicts=(), ends=ends)

    def verdicts(self, interaction: Interaction) -> Conversation | None:
        """V, as far as it was told; None where the wish is none of this session."""
        wish = interaction.request.wish
        return self.change(wish, verdicts=tuple(map(_shown, interaction.verdicts))) if wish in self else None

    def report(self, report: Report) -> Conversation | None:
        """A control period: the first one that follows a wish is where its set-point changed."""
        self._trip, self._now_s = report.trip, report.tick * self._dt_s
        each = self._wishes.get(report.plan)
        if each is None or each.started_s is None or each.shown.stages.set_point_s is not None:
            return None
        if report.level not in ("follow", "hold"):
            return None
        now_s = self._clock()
        stages = replace(each.shown.stages, set_point_s=now_s - each.started_s, total_s=now_s - each.words.ended_s)
        each.shown = replace(each.shown, stages=stages)
        return each.shown

    def to_ask_about(self, patience_s: float) -> HowWasIt | None:
        """The question about a wish that was felt, if one is due.

        Args:
            patience_s: So long a wish is driven, in the car's time, before the person is asked how it is.
        """
        newest = self._wishes.get(self.last_felt)
        if newest is None or newest.asked_how or newest.felt_from_s is None:
            return None
        felt_s = self._now_s - newest.felt_from_s
        if newest.trip != self._trip:  # another road has begun, and nobody felt the end of this one
            newest.asked_how = self._trip > newest.trip
        elif felt_s >= patience_s or (newest.shown.stage == "closed" and felt_s >= FELT_AFTER_S):
            newest.asked_how = True
            if not newest.shown.opinion:
                return HowWasIt(newest.shown.wish, newest.shown.text)
        return None


def _shown(verdict: Verdict) -> VerdictShown:
    compared = verdict.not_compared is None
    return VerdictShown(verdict.check, verdict.passed, verdict.reason, not verdict.vetoes, verdict.proven, compared)


def _most(said: tuple[str, ...]) -> tuple[str, ...]:
    """The newest texts, behind a note where there were more."""
    if len(said) <= MOST_SAID_SHOWN:
        return said
    return (_EARLIER, *said[1 - MOST_SAID_SHOWN :])


def may_end(policy: Policy) -> bool:
    """Whether a policy may end by itself: parameters do where they lead to a place."""
    match policy:
        case Program(source=source):
            try:
                return has_end(ast.parse(source))
            except SyntaxError:  # it is refused by a check
                return False
        case Parameters(route=route):
            return bool(route) and route not in TURNS
        case _:
            return True


def source_of(policy: Policy) -> str:
    """P as text: a program with the helper functions it runs through, parameters one a line."""
    match policy:
        case Program():
            return policy.text
        case Parameters():
            speed = policy.target_speed_mps
            lines = [
                f"target speed: {people_speed(speed, at_most=True)}",
                f"look ahead: {policy.look_ahead_ratio:g} s, {policy.look_ahead_m:g} m at least",
                f"lane: {_LANES[policy.lane]}",
                *([f"way: {policy.route}"] if policy.route else []),
            ]
            return "\n".join(lines)
        case _:
            return "\n".join(f"{name}: {value}" for name, value in asdict(policy).items() if name != "kind")


def recalled_of(items: tuple[HistoryItem, ...]) -> tuple[str, ...]:
    """What of the person's history the planner was shown, and where two opinions contradict each other."""
    lines = [_recalled(item) for item in items]
    said = [(item.when, each) for item in items for each in item.feedback]
    said.sort(key=lambda one: one[0])
    for topic in ("speed", "gap", "comfort"):
        lines += _conflict(topic, [(when, each) for when, each in said if _sign(each, topic)])
    return tuple(lines)


def _recalled(item: HistoryItem) -> str:
    opinion = "; ".join(f"“{each.text}”" for each in item.feedback)
    return f"{item.when[:10]}: “{item.instruction}”" + (f", you said {opinion}" if opinion else "")


def _conflict(topic: str, said: list[tuple[str, Feedback]]) -> Iterator[str]:
    if not said:
        return
    (_, newest) = said[-1]
    older = next(((when, each) for when, each in reversed(said) if _sign(each, topic) != _sign(newest, topic)), None)
    if older is not None:
        yield (
            f"You said “{older[1].text}” on {older[0][:10]} and “{newest.text}” on {said[-1][0][:10]}: "
            "the later one holds."
        )


def _sign(feedback: Feedback, topic: str) -> int:
    return {"speed": feedback.speed, "gap": feedback.gap, "comfort": feedback.comfort}[topic]
