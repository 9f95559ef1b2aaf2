"""R for a real vehicle: what a planner says it does, without what it says of a road that nobody here sees."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Final

from chauffeur.concept import Parameters, Plan, Thoughts, Verdict
from chauffeur.concept.units import kmh
from chauffeur.planners.talk2drive.embedded import does

_ROAD: Final = re.compile(
    r"We drive \S{1,20} m/s where \S{1,20} m/s are allowed; [^.]{0,200}(?:\.\d[^.]{0,200}){0,8}\. ?"
)
"""The on-board model's sentence about the situation. It is made for worlds that show speed limit and traffic."""


def speed_text(speed_mps: float) -> str:
    """A speed in words: `8.0 m/s (28.8 km/h)`."""
    return f"{speed_mps:.1f} m/s ({kmh(speed_mps):.4g} km/h)"


def asks(parameters: Parameters) -> str:
    """What a vehicle is asked for, as a clause after "I"."""
    speed = parameters.target_speed_mps
    pace = "a speed of 0" if speed == 0.0 else f"at most {speed_text(speed)}"
    ahead = f"{parameters.look_ahead_ratio:g} s along its path, {parameters.look_ahead_m:g} m at least"
    return f"ask the vehicle's planner for {pace}, looking ahead {ahead}"


def in_own_words(plan: Plan, fitted: Parameters) -> Plan:
    """The plan with the parameters that are asked for, and with thoughts that say so.

    Args:
        plan: As the planner gave it, with parameters.
        fitted: Its parameters as the vehicle takes them.
    """
    assert isinstance(plan.policy, Parameters)
    text = plan.thoughts.text
    done = f"I {asks(fitted)}." if math.isfinite(fitted.target_speed_mps) else ""
    text = _ROAD.sub("", text.replace(f"I {does(plan.policy)}.", done))
    return replace(plan, policy=fitted, thoughts=Thoughts(text.strip()))


def refused_in_own_words(plan: Plan, verdict: Verdict) -> Plan:
    """A plan that declines for a reason that cannot be known here, with the verdict's reason instead."""
    return replace(plan, thoughts=Thoughts(verdict.reason), refusal=verdict.reason)
