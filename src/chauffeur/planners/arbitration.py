"""Questions before a drive, each answered by a yes: numbers that cannot be read, things that the words deny,
a stop in the lane, a crawl among faster traffic.

Of a thing that was said and taken back the last counts.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal, Self

from chauffeur.concept import Instruction, Limits, Plan, PlanRequest, Situation
from chauffeur.language.corrections import last_said
from chauffeur.language.denials import denied_words
from chauffeur.language.slips import slip_in
from chauffeur.language.tokens import tokens_of
from chauffeur.language.weather import said_weather
from chauffeur.planners.base import Planner, declined
from chauffeur.safety.dangers import danger

if TYPE_CHECKING:
    from chauffeur.planners.onboard.options import Chosen

SURE: Final = 0.95
"""From this probability of its least sure choice the network's reading needs no second one that agrees. Chosen with
the wishes of `bench passengers` in sight: their figures are no held-out check (see benchmarks/RESULTS.md)."""

SLOW_SHARE: Final = 0.5
"""Of the traffic's speed; whoever drives slower than that among others is asked whether they mean it."""
_TRAFFIC_MPS: Final = 14.0
"""Only from this speed of the traffic, about 50 km/h: in a lot, or up to a stop sign, a low speed endangers nobody."""
_CREEP_MPS: Final = 5.0
"""Below this speed of the traffic a stop endangers nobody: a parking lot, a jam."""

UNSURE_WORDS: Final = "I am not sure what you want."
_STANDS: Final = "We would stand in the way of others."
_CRAWLS: Final = "That is less than half the speed of the traffic here."

_PASSING: Final = frozenset({"overtake", "overtaking", "pass", "passing"})
_SLOWING: Final = frozenset({"slow", "slower", "brake", "braking", "decelerate"})
_HASTENING: Final = frozenset({"fast", "faster", "accelerate", "quicker"})
_STOPPING: Final = frozenset({"stop", "stopping", "halt", "park"})
_KEEP_LANE: Final = ("Stay in this lane.", "stay in this lane")
_KEEP_BEHIND: Final = ("Do not overtake.", "stay behind the car ahead")
_LETTING: Final = frozenset({"let", "letting", "allow", "merge", "cut", "squeeze"})
_KEEP_GAP: Final = ("Keep the present gap.", "keep the gap to the car ahead as it is")
_KEEP_SPEED: Final = ("Keep the present speed.", "keep the present speed")
_NOTHING: Final = ("", "")
_DENIALS: Final[tuple[tuple[str, frozenset[str], tuple[str, str]], ...]] = (
    ("turn.left", frozenset({"left"}), _NOTHING),
    ("turn.right", frozenset({"right"}), _NOTHING),
    ("turn.straight", frozenset({"straight"}), _NOTHING),
    ("lane.left", frozenset({"left"}), _KEEP_LANE),
    ("lane.right", frozenset({"right"}), _KEEP_LANE),
    ("overtake", _PASSING, _KEEP_BEHIND),
    ("pull_over", frozenset({"pull"}) | _STOPPING, _KEEP_SPEED),
    ("stop", frozenset({"pull"}) | _STOPPING, _KEEP_SPEED),
    ("yield", _LETTING, _KEEP_GAP),
    ("gap.increase", _LETTING, _KEEP_GAP),
    ("speed.decrease", _SLOWING, _KEEP_SPEED),
    ("speed.increase", _HASTENING, _KEEP_SPEED),
)
"""Kind of thing to do, the words that deny it, and what is offered instead: the wish, and how it is asked about."""
_DENIED: Final = "You say what you do not want, and I would have done just that."

PACES: Final = {"hurry": 1, "sporty": 1, "relax": -1, "careful": -1, "comfort": -1, "eco": -1}
"""Moods that quicken (1) or calm (-1) the drive."""


def within_mood(speed_mps: float, pace: int, now_mps: float, most_mps: float) -> float:
    """A set-point for a mood, m/s: one for a calmer drive is never above the present speed, one for a quicker drive
    never below, but for the limits."""
    if pace < 0:
        return min(speed_mps, now_mps)
    return max(speed_mps, min(now_mps, most_mps)) if pace > 0 else speed_mps


def intent_pace(intent: str) -> int:
    """The pace that the tag of a wish without a number asks for."""
    kinds = {"speed.increase": 1, "speed.decrease": -1, **{f"style.{mood}": sign for mood, sign in PACES.items()}}
    return one_sign(kinds.get(part, 0) for part in intent.split("+"))


def wary_of(text: str, intent: str) -> bool:
    """True if a passenger in a hurry says in the same breath that the road is slippery or the sight bad.

    Args:
        text: Their words.
        intent: Tag of their reading; only a mood counts, an outright wish for more speed is followed.
    """
    return "style." in intent and intent_pace(intent) > 0 and said_weather(text) != "none"


def unanswered(instruction: Instruction, question: str) -> str:
    """The question; empty where the person has answered it with yes, and in a benchmark, where nobody can."""
    return "" if instruction.source == "benchmark" or question == instruction.confirmed else question


def slow_words(steps: Iterable[Chosen], situation: Situation, limits: Limits) -> str:
    """Reason why a plan endangers following traffic: it stops in the lane, or crawls; empty if it does neither."""
    for step in steps:
        if step.intent.startswith("pull_over"):
            continue  # to a stand, but not in anybody's way
        target = 0.0 if step.intent == "stop" else dict(step.settings).get("target_speed_mps")
        if target is not None and (why := slow_speed_words(target, situation, limits)):
            return why
    return ""


def slow_speed_words(target_mps: float, situation: Situation, limits: Limits) -> str:
    """The same for one set-point; who may not drive as fast as the traffic is not asked about that."""
    front = 0.0 if situation.front is None else situation.front.speed_mps
    most_mps = min(situation.speed_limit_mps, limits.most_mps(situation.speed_limit_mps))
    traffic_mps = min(most_mps, max(situation.speed_mps, front))
    if target_mps == 0.0:
        return _STANDS if traffic_mps > _CREEP_MPS else ""
    crawls = traffic_mps >= _TRAFFIC_MPS and target_mps < SLOW_SHARE * traffic_mps
    return _CRAWLS if crawls else ""


@dataclass(frozen=True, slots=True)
class Wish:
    """Words made ready for a planner.

    Attributes:
        instruction: With what is left once the person has corrected themselves.
        declined: The plan that declines what is unsafe or asks about a number; None where the words may be read.
    """

    instruction: Instruction
    declined: Plan | None = None

    @classmethod
    def of(cls, planner: Planner, instruction: Instruction, begun: float) -> Self:
        """Decline what would hurt somebody, whatever of it was taken back, and see that every number is one."""
        if reason := danger(instruction.text):
            return cls(instruction, declined(planner, reason, begun, intent="refuse"))
        text = last_said(instruction.text)
        slip = slip_in(text)
        if slip is not None:
            return cls(instruction, asked(planner, slip.question, begun, offer=slip.corrected))
        return cls(replace(instruction, text=text))


def asked(planner: Planner, question: str, begun: float, *, offer: str = "", raw: str = "") -> Plan:
    """A plan that drives nothing yet and asks; `offer` is the wish that a yes stands for."""
    plan = declined(planner, question, begun, intent="ask", raw=raw)
    return replace(plan, offer=offer)


def denied_intent(text: str, intent: str) -> tuple[str, str] | None:
    """Offer for a thing to do that the words deny: (wish, how it is asked about); None if they deny none.

    What is said both with and without a negation ("not the left lane, the left turn") counts as wanted.

    Args:
        text: The wish.
        intent: Tag of what would be driven, `+` between steps.
    """
    denied, tokens = denied_words(text), tokens_of(text)
    for part in intent.split("+"):
        for kind, words, instead in _DENIALS:
            named = words & denied
            if named and part.startswith(kind) and all(tokens.count(word) == 1 for word in named):
                return instead
    return None


def undenied(planner: Planner, plan: Plan, request: PlanRequest, begun: float, *, meant: str = "") -> Plan:
    """The plan, or, where it does what the words deny ("don't slow down"), the question what to do instead.

    Args:
        planner: Whose plan it is.
        plan: As it was made.
        request: The words.
        begun: When planning began, by `time.perf_counter`.
        meant: Of a plan that asks: intent of what a yes would drive.
    """
    intent = plan.intent if plan.policy is not None else meant
    if not intent or (instead := denied_intent(request.instruction.text, intent)) is None:
        return plan
    offer, words = instead
    question = f"{_DENIED} Shall I {words}?" if words else f"{_DENIED} What shall I do instead?"
    return asked(planner, question, begun, offer=offer, raw=plan.raw)


def one_sign(changes: Iterable[int]) -> Literal[-1, 0, 1]:
    """The sign that all changes share, zeros apart; 0 where they differ or there is none."""
    found = {change for change in changes if change}
    return 0 if len(found) != 1 else 1 if found.pop() > 0 else -1
