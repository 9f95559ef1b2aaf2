"""`minimum-speed-v1`: no policy crawls or stands in a lane in which others drive fast.

On a highway the least speed is 60 km/h, the speed below which German law keeps vehicles off motorways (StVO section 18;
US freeways post 40 to 45 mph, 64 to 72 km/h), but no more than 60 % of the limit of a slower road, and no more than the
slowest of the traffic ahead drives: a queue is followed at its own speed. It holds for every policy and every person.
Only what leads to the shoulder may come to a stand, there; the minimal-risk manoeuvre is no planner's and is not asked.

What is read before driving are constants and the ranges a program can be followed to; what a program works out while
it drives is brought up to the least speed by `safety.bounds`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from chauffeur.concept import Limits, Observation, Parameters, Plan, Program, Verdict
from chauffeur.concept.units import MPS_PER_KMH
from chauffeur.programs.errors import ProgramSyntaxError
from chauffeur.programs.verify import Circumstances, verify
from chauffeur.safety.bounds import least_speed_mps, shoulder_at_right
from chauffeur.safety.constant_calls import read_program
from chauffeur.safety.words import speed_words

MINIMUM_SPEED_CHECK: Final = "minimum-speed-v1"

_ROUNDING: Final = 0.02
"""Planners write speeds in hundredths of m/s or whole km/h."""


def check_minimum_speed(plan: Plan, observation: Observation, limits: Limits) -> Verdict:
    """Judge whether no set-point that can be read from the plan is far below traffic on a highway."""
    least = least_speed_mps(observation, limits)
    if least is None or plan.policy is None:
        return Verdict(
            MINIMUM_SPEED_CHECK, True, "No minimum speed holds here." if least is None else "There is no policy.",
            not_compared="no-rule-here" if least is None else "no-policy",
        )  # fmt: skip
    found = list(_set_points(plan, observation))
    if not found:
        return Verdict(MINIMUM_SPEED_CHECK, True, "No set-point can be read.", not_compared="unreadable")
    slow = [(speed, line) for speed, line in found if speed < least - _ROUNDING]
    if not slow:
        return Verdict(MINIMUM_SPEED_CHECK, True, f"No set-point is below the least speed of {speed_words(least)}.")
    speed, line = min(slow, key=lambda one: one[0])
    verb = "stand" if speed <= 0.5 else f"drive at {speed_words(speed)}"
    reason = (
        f"To {verb} in a lane of a highway is dangerous: others drive far faster. At least {speed_words(least)} here."
    )
    remedy = f"Ask for {math.ceil(least / MPS_PER_KMH - _ROUNDING):d} km/h or more"
    remedy += (
        ", or to pull over on the shoulder." if shoulder_at_right(observation) else "; to stop at once, say “Stop!”"
    )
    return Verdict(MINIMUM_SPEED_CHECK, False, reason, line, remedy)


def _set_points(plan: Plan, observation: Observation) -> Iterator[tuple[float, int | None]]:
    """Every target speed that can be read, with its line; of a program that makes for the shoulder, none."""
    match plan.policy:
        case Parameters(target_speed_mps=speed):
            yield speed, None
        case Program(source=source, library=library):
            reading = read_program(source)
            rightward = any(
                use.name == "set_target_lane" and use.lane_offset in (1, None)
                for use in (*reading.uses, *read_program(library).uses)
            )
            if rightward and shoulder_at_right(observation):
                return  # where it slows down is seen while driving
            yield from _reached(source, library, observation)
        case _:
            pass
    yield from ((value, None) for name, value in plan.settings if name == "target_speed_mps")


def _reached(source: str, library: str, observation: Observation) -> Iterator[tuple[float, int | None]]:
    """The highest speed that each call of a program can ask for."""
    try:
        report = verify(source, library, Circumstances.of(observation))
    except ProgramSyntaxError:
        return
    for site in report.calls:
        if site.name == "set_target_speed" and site.arguments and site.arguments[0].value.may_be_number:
            yield site.arguments[0].value.hi, None if site.in_library else site.line
