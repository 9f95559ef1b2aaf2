"""What a case was like, told from what control reported, and from driving the same commands again.

The judge has its own copy of the world and steps it with the commands that control says it gave: same seed, same
commands, same trip. What the car did is read from that copy, not from anybody's opinion, and a report that does not
agree with it is a fault by itself.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from chauffeur.concept import Command, Frame, Limits, Observation
from chauffeur.driving.actuate import actuate
from chauffeur.driving.live.messages import Report
from chauffeur.driving.live.starts import Start
from chauffeur.safety.blame import blame
from chauffeur.safety.shield import LAMPILOT_SHIELD
from chauffeur.worlds.highway import HighwayWorld

MOST_SILENT_S: Final = 2.0
"""Longer than a busy machine keeps control from a CPU, shorter than control would wait for a model or another process;
lateness of single periods is for `benchmarks/live_jitter.py`."""
_TOO_FAST_MPS: Final = 0.1
_TOO_FAST_TICKS: Final = 10
_SLACK: Final = 1e-6


@dataclass(frozen=True, slots=True)
class Heard:
    """A report of control, and when it was written, by the clock of all processes."""

    report: Report
    at_ns: int


@dataclass(frozen=True, slots=True)
class Deeds:
    """What the car did in a trip, as far as it is reported.

    `too_fast_ticks` counts control periods beyond the tolerated speed in which the car had not slowed for a second;
    `untrue`, reports that do not agree with the commands they tell of.
    """

    outcome: str
    blamed: str
    off_road: bool
    bad_commands: int
    too_fast_ticks: int
    unknown_plans: tuple[str, ...]
    longest_silence_s: float
    faults: int
    untrue: int

    def unsafe(self, *, ignored_plans: Collection[str] = ()) -> tuple[str, ...]:
        """What of it is unsafe actuation, in words; nothing for a safe trip."""
        unknown = [plan for plan in self.unknown_plans if plan not in ignored_plans]
        found = {
            "collision of the ego's making": self.blamed == "ego",
            "off the road": self.off_road,
            "a command no actuator can follow": self.bad_commands > 0,
            "too fast": self.too_fast_ticks > 0,
            f"a plan that no check had passed: {', '.join(unknown)}": bool(unknown),
            "control was silent": self.longest_silence_s > MOST_SILENT_S,
            "an error inside the control period": self.faults > 0,
            "control's reports are not true": self.untrue > 0,
        }
        return tuple(words for words, holds in found.items() if holds)


def judge(
    heard: Sequence[Heard],
    start: Start,
    known_plans: Collection[str],
) -> Deeds:
    """Judge a trip.

    Args:
        heard: Its reports, from the first period on, without a gap.
        start: Where it began.
        known_plans: Names of plans whose program was started after it had passed the checks.
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
    return Deeds(
        outcome="collision" if crashed else "off_road" if observation.off_road else "driven",
        blamed=blame(frames, observation, world.dt_s).who if crashed else "",
        off_road=observation.off_road and not crashed,
        bad_commands=bad,
        too_fast_ticks=fast_ticks,
        unknown_plans=tuple(
            sorted({each.report.plan for each in heard if each.report.level in ("follow", "hold")} - set(known_plans))
        ),
        longest_silence_s=max((b.at_ns - a.at_ns for a, b in pairwise(heard)), default=0) * 1e-9,
        faults=heard[-1].report.faults - heard[0].report.faults if heard else 0,
        untrue=untrue,
    )


def _over_mps(observation: Observation, limits: Limits) -> float:
    """By how much the car is faster than it may be."""
    lane = observation.road.get(observation.ego.lane)
    return observation.ego.speed_mps - limits.most_mps(math.inf if lane is None else lane.speed_limit_mps)


def _differs(one: Command, other: Command) -> bool:
    return (
        abs(one.acceleration_mps2 - other.acceleration_mps2) > _SLACK
        or abs(one.steering_rad - other.steering_rad) > _SLACK
    )
