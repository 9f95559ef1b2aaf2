"""Whether a drive did what acts ask: one predicate an act, over the geometry of what was driven.

The judge shares nothing with what drives but the meaning of words (`concept.utterance`) and geometry: it looks for the
road users that a reference means by attributes of its own, in the instant at which it was said, or in the whole drive
where they came into sight later. A benchmark that staged them names them instead. It judges in hindsight: that a road
user "had gone" when the car turned means that it did not come onto the car's way after that.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol

from chauffeur.concept import PartResult
from chauffeur.concept.utterance import Act, Verb
from chauffeur.driving.judge import manoeuvres, setpoints, standing
from chauffeur.driving.judge.conditions import unknown
from chauffeur.driving.judge.trace import DriveTrace, Found, Referents, TracedDrive


class _Predicate(Protocol):
    def __call__(self, drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found: ...


_PREDICATES: Final[Mapping[Verb, _Predicate]] = {
    "turn": manoeuvres.turn, "straight": manoeuvres.turn, "u_turn": manoeuvres.u_turn, "lane": manoeuvres.lane,
    "keep": manoeuvres.keep, "pass": manoeuvres.overtake, "avoid": manoeuvres.overtake, "follow": manoeuvres.follow,
    "yield": manoeuvres.give_way, "stop": standing.stop, "park": standing.stop, "pull_over": standing.stop,
    "wait": standing.wait, "go": standing.go, "speed": setpoints.speed, "gap": setpoints.gap,
}  # fmt: skip
NOT_DRIVEN: Final[frozenset[Verb]] = frozenset({"none", "refuse"})
"""Verbs that ask for nothing to be driven."""
_GAPS: Final[frozenset[Verb]] = frozenset({"gap", "follow", "yield"})
_SPEEDS: Final[frozenset[Verb]] = frozenset(_PREDICATES) - {"gap", "follow"}
"""Acts that may write the plan's gap, and its target speed; of one number, the last act that sets it counts."""


@dataclass(frozen=True, slots=True)
class JudgedAct:
    """What became of an act.

    Attributes:
        act: The act.
        result: What became of it.
        why: What is missing, in words; empty where nothing is.
        planned: Whether a number of the plan's decided.
    """

    act: Act
    result: PartResult
    why: str = ""
    planned: bool = False


def wanted(acts: Sequence[Act]) -> tuple[Act, ...]:
    """The acts that a drive is to do, or not to do: no purposes of others, and nothing that is refused."""
    return tuple(one for one in acts if not one.purpose and one.act not in NOT_DRIVEN)


def can_be_judged(act: Act) -> bool:
    """Whether there is a predicate for an act."""
    return act.act in _PREDICATES


def judge(
    acts: Sequence[Act],
    trace: DriveTrace,
    referents: Referents | None = None,
    settings: Mapping[str, float] | None = None,
) -> tuple[JudgedAct, ...]:
    """What became of each act, in their order.

    Args:
        acts: What was asked for.
        trace: What was driven so far.
        referents: Whom references mean, where that is known; looked for by attributes otherwise.
        settings: Numbers that the plan sets: reached, too, where words name a change and no number.
    """
    found: list[JudgedAct] = []
    start, missed, asked = 0, False, wanted(acts)
    for k, act in enumerate(asked):
        if missed:
            found.append(JudgedAct(act, "not_done", "it was not come to"))
            continue
        drive = TracedDrive(trace, referents or {}, _numbers(asked[k:], settings or {}))
        result, end, why, planned = _became(drive, act, start, last=act is asked[-1])
        if result == "opposite" and act.negated and _does_the_other(drive, act, asked[k + 1 :], start):
            result, end, why = "done", start, ""
        found.append(JudgedAct(act, result, why, planned))
        missed = result in ("not_done", "opposite") and not act.negated
        start = max(start, end)
        if act.act == "turn" and act.negated and _is_next(asked[k + 1 : k + 2]):
            start = next((one.leaves for one in drive.passages if one.enters >= start), start)
    return tuple(found)


def _numbers(acts: Sequence[Act], settings: Mapping[str, float]) -> Mapping[str, float]:
    """The plan's numbers that go with the first of acts: what no later one sets anew."""
    act, later = acts[0].act, {one.act for one in acts[1:]}
    speed = act in _SPEEDS and not later & _SPEEDS
    gap = act in _GAPS and not later & _GAPS
    return {name: value for name, value in settings.items() if (speed if name == "target_speed_mps" else gap)}


def _became(drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found:
    does: Callable[..., Found] | None = _PREDICATES.get(act.act)
    if act.act == "speed" and act.style is not None and act.value is None:
        does = setpoints.style
    if does is None or not drive.all:
        return Found("not_judged", start, "no predicate knows this act")
    if act.negated:
        return _kept_from(drive, act, start)
    found = does(drive, act, start, last=last)
    if unknown(act.when) and found.result != "opposite":
        return Found("not_judged", found.end, "no predicate knows what it depends on")
    return found


def _is_next(acts: Sequence[Act]) -> bool:
    """Whether what follows is to be done at the junction after the one that was spoken of: "not here, the next one"."""
    return any(one.act == "turn" and one.place is not None and one.place.rel == "next" for one in acts)


def _does_the_other(drive: TracedDrive, act: Act, later: Sequence[Act], start: int) -> bool:
    """Whether what looks like a denied act is the one that is asked for instead: "not by that truck, ahead of it"."""
    others = (one for one in later if one.act == act.act and not one.negated and act.act != "turn")
    return any(_became(drive, one, start, last=False).result == "done" for one in others)


def _kept_from(drive: TracedDrive, act: Act, start: int) -> Found:
    """Of what is not to be done: that the whole drive does not do it."""
    if act.act == "turn":
        taken = [one for one in drive.passages if one.enters >= start]
        if any(one.way == act.side or (act.side is None and one.way != "straight") for one in taken[:1]):
            return Found("opposite", taken[0].leaves, "the car did it all the same")
        return Found("done", start) if taken else Found("not_done", start, "the car came to no junction")
    if act.act in ("straight", "go", "wait", "keep"):
        return Found("not_judged", start, "no predicate knows this")
    since = start
    if act.act == "follow" and not drive.road.uninterrupted:  # before a junction there is no other way to go
        since = next((one.leaves for one in drive.passages if one.enters >= start), len(drive.all) - 1)
    did = _became(drive, replace(act, negated=False), since, last=False)
    if did.result == "done":
        return Found("opposite", did.end, "the car did it all the same")
    if did.result == "not_judged":
        return did
    return standing.go(drive, Act("go"), start)._replace(
        end=start
    )  # it holds all along: what comes next begins at once
