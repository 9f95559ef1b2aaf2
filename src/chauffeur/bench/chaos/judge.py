"""What a case was like, told from what control reported, and from driving the same commands again.

The judge has its own copy of the world and steps it with the commands that control says it gave: same seed, same
commands, same trip. What the car did is read from that copy, not from anybody's opinion, and a report that does not
agree with it is a fault by itself.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any, Final

from chauffeur.bench.chaos.outside import HeardOutside
from chauffeur.bench.chaos.witness import Stall, stood_ns
from chauffeur.concept import Command, Frame, Limits, Observation
from chauffeur.drive.actuate import actuate
from chauffeur.drive.live.fallback_levels import FALLBACK_LEVELS
from chauffeur.drive.live.starts import Start
from chauffeur.safety.blame import blame
from chauffeur.safety.shield import LAMPILOT_SHIELD
from chauffeur.worlds.highway import HighwayWorld

MOST_SILENT: Final = 4.0
"""Control may be silent for three periods, and one more that is under way."""
_TOO_FAST_MPS: Final = 0.1
_TOO_FAST_TICKS: Final = 10
_SLACK: Final = 1e-6


@dataclass(frozen=True, slots=True)
class Deeds:
    """What the car did in a trip, as far as it is reported.

    Attributes:
        outcome: How the trip ended, by the judge's own copy of the world.
        blamed: Who caused a collision; empty without one.
        off_road: Whether the car left the road.
        bad_commands: Commands that were no numbers, or beyond what the actuator can do.
        too_fast_ticks: Control periods in which the car was beyond the tolerated speed and had not become slower for a
            second.
        unknown_plans: Names of plans that were followed although no check had passed them.
        longest_silence: Of control, in control periods.
        unexplained_silence: The same without the time in which a witness saw the machine stand still.
        missed: Control periods never begun.
        faults: Errors inside the control period.
        untrue: Reports that do not agree with the commands they tell of.
        interventions: Control periods in which the shield changed the command.
    """

    outcome: str
    blamed: str
    off_road: bool
    bad_commands: int
    too_fast_ticks: int
    unknown_plans: tuple[str, ...]
    longest_silence: float
    unexplained_silence: float
    missed: int
    faults: int
    untrue: int
    interventions: int

    def unsafe(self, *, ignored_plans: Collection[str] = ()) -> tuple[str, ...]:
        """What of it is unsafe actuation, in words; nothing for a safe trip."""
        unknown = [plan for plan in self.unknown_plans if plan not in ignored_plans]
        found = {
            "collision of the ego's making": self.blamed == "ego",
            "off the road": self.off_road,
            "a command no actuator can follow": self.bad_commands > 0,
            "too fast": self.too_fast_ticks > 0,
            f"a plan that no check had passed: {', '.join(unknown)}": bool(unknown),
            "control was silent": self.unexplained_silence > MOST_SILENT,
            "control's reports are not true": self.untrue > 0,
        }
        return tuple(words for words, holds in found.items() if holds)

    def row(self) -> dict[str, Any]:
        """As JSON values."""
        return asdict(self)


def judge(
    heard: Sequence[HeardOutside],
    start: Start,
    known_plans: Collection[str],
    period_s: float,
    stalls: Sequence[Stall] = (),
) -> Deeds:
    """Judge a trip.

    Args:
        heard: Its reports, from the first period on, without a gap.
        start: Where it began.
        known_plans: Names of plans whose program was started after it had passed the checks.
        period_s: Control period by the clock.
        stalls: When the machine itself stood still, as a witness saw it.
    """
    world = HighwayWorld()
    observation = world.reset(start.scenario, start.seed)
    actuation = world.actuation
    frames: list[Frame] = []
    bad = untrue = fast_ticks = 0
    over: list[float] = []
    for each in heard:
        report = each.report
        command = report.interventions[-1].after if report.interventions else report.requested
        numbers = (command.acceleration_mps2, command.steering_rad)
        done = (report.applied.acceleration_mps2, report.applied.steering_rad)
        if not all(map(math.isfinite, (*numbers, *done))):
            bad += 1
            continue
        braking = LAMPILOT_SHIELD.braking_mps2
        if (
            not -braking - _SLACK <= done[0] <= actuation.max_acceleration_mps2 + _SLACK
            or abs(done[1]) > actuation.max_steering_rad + _SLACK
        ):
            bad += 1
        over.append(_over_mps(observation, start.limits))
        recent = over[-_TOO_FAST_TICKS:]
        if len(recent) == _TOO_FAST_TICKS and min(recent) > _TOO_FAST_MPS and recent[-1] >= recent[0]:
            fast_ticks += 1
        if report.tick != observation.tick or abs(report.speed_mps - observation.ego.speed_mps) > _SLACK:
            untrue += 1
        applied = actuate(world, observation, command, None, None).applied
        untrue += _differs(applied, report.applied)
        frames.append(
            Frame(observation, report.setpoints, report.requested, applied, interventions=report.interventions)
        )
        observation = world.observe()
        if world.ended:
            break
    crashed = observation.ego.crashed
    missed = heard[-1].report.missed - heard[0].report.missed if heard else 0
    return Deeds(
        outcome="collision" if crashed else "off_road" if observation.off_road else "driven",
        blamed=blame(frames, observation, world.dt_s).who if crashed else "",
        off_road=observation.off_road and not crashed,
        bad_commands=bad,
        too_fast_ticks=fast_ticks,
        unknown_plans=tuple(
            sorted({each.report.plan for each in heard if each.report.level in ("follow", "hold")} - set(known_plans))
        ),
        longest_silence=round(_longest_silence_s(heard, ()) / period_s, 2),
        unexplained_silence=round(_longest_silence_s(heard, stalls) / period_s, 2),
        missed=missed,
        faults=heard[-1].report.faults - heard[0].report.faults if heard else 0,
        untrue=untrue,
        interventions=sum(bool(each.report.interventions) for each in heard),
    )


@dataclass(frozen=True, slots=True)
class Recovery:
    """How control came through a fault.

    Attributes:
        worst: Lowest fallback level after the fault.
        to_follow_s: From the fault to the first period that followed fresh wishes again, by the clock; 0 where they
            were followed throughout, None where they were not again in this trip.
        to_new_plan_s: From the fault to the first period that followed a plan made after it; None for none.
    """

    worst: str
    to_follow_s: float | None
    to_new_plan_s: float | None


def recovery(
    heard: Sequence[HeardOutside], later: Sequence[HeardOutside], fault_ns: int, later_plans: Collection[str]
) -> Recovery:
    """How control came through a fault.

    Args:
        heard: Reports of control, of the trip.
        later: Of the trips after it: a fault may outlast its own.
        fault_ns: When the fault struck.
        later_plans: Names of plans made for wishes that were asked after it.
    """
    after = [each for each in heard if each.at_ns >= fault_ns]
    worst = max((each.report.level for each in after), key=FALLBACK_LEVELS.index, default="follow")
    left = next((place for place, each in enumerate(after) if each.report.level != "follow"), None)
    back: float | None = 0.0
    if left is not None:
        again = (each for each in (*after[left:], *later) if each.report.level == "follow")
        back = next((_since_s(each, fault_ns) for each in again), None)
    new = (
        each
        for each in after
        if each.report.plan in later_plans and each.report.level == "follow" and each.report.state != "none"
    )
    return Recovery(worst, back, next((_since_s(each, fault_ns) for each in new), None))


def _since_s(heard: HeardOutside, then_ns: int) -> float:
    return round((heard.at_ns - then_ns) * 1e-9, 4)


def _over_mps(observation: Observation, limits: Limits) -> float:
    """By how much the car is faster than it may be."""
    lane = observation.road.get(observation.ego.lane)
    return observation.ego.speed_mps - limits.most_mps(math.inf if lane is None else lane.speed_limit_mps)


def _differs(one: Command, other: Command) -> bool:
    return (
        abs(one.acceleration_mps2 - other.acceleration_mps2) > _SLACK
        or abs(one.steering_rad - other.steering_rad) > _SLACK
    )


def _longest_silence_s(heard: Sequence[HeardOutside], stalls: Sequence[Stall]) -> float:
    gaps = (
        later.at_ns - earlier.at_ns - stood_ns(stalls, earlier.at_ns, later.at_ns) for earlier, later in pairwise(heard)
    )
    return max(gaps, default=0) * 1e-9
