"""What stands between a plan and a real vehicle: whether it is a wish for this vehicle, then the papers' two checks.

The vehicle's interface checks every number once more (`worlds/ros/limits.py`), whatever was found here.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Final

from chauffeur.concept import Parameters, Plan, Verdict
from chauffeur.driving.emergency import stop_wanted
from chauffeur.driving.onroad.thoughts import in_own_words, speed_text
from chauffeur.driving.onroad.vehicle_observation import VehicleObservation
from chauffeur.language.emergency import Emergency, read_emergency
from chauffeur.safety.checks import DEFAULT_CHECKS, run_checks
from chauffeur.worlds.ros import VehicleLimits

VEHICLE_CHECK: Final = "vehicle-v1"

HUNDREDTH_MPS: Final = 0.01
"""Planners write speeds in hundredths: a limit of 20 km/h becomes 5.56 m/s, which is 20.02 km/h."""

_ELSEWHERE: Final = frozenset({"lane", "overtake", "turn", "gap", "follow", "yield", "pull_over", "park"})
"""First parts of intents that are the business of the vehicle's own planner."""

_UPWARDS: Final = frozenset({"speed.increase", "style.hurry", "style.sporty"})
_SLACK_MPS: Final = 0.05

_ENGAGING: Final = re.compile(r"\b(?:(?:dis|re)?engag(?:e|ed|ing)|drive[- ]by[- ]wire|autopilot on)\b", re.IGNORECASE)

ENGAGING_WORDS: Final = (
    "Handing the vehicle to its computer, and taking it back, is a person's act; no wish does it. "
    "On a ROS 1 vehicle a person types: chauffeur vehicle engage FILE."
)


def is_about_engaging(text: str) -> bool:
    """Whether a wish is about engaging the vehicle, which no wish can."""
    return _ENGAGING.search(text) is not None


def is_stop(text: str) -> bool:
    """Whether a wish needs no planner: the car is to stop at once."""
    return stop_wanted(read_emergency(text))


def answered_at_once(found: Emergency) -> str:
    """What is said to emergency words that ask nothing of this vehicle's planner; empty for a stop, and for words that
    ask for more."""
    if not found.alone or found.kind == "stop":
        return ""
    if found.kind == "no_stop":
        return "I ask for no stop. What was asked of the vehicle stays in force."
    return "I cannot call anybody, and where to stop is chosen by the vehicle. Shall it stop now? If so, say: “Stop!”"


def fitted(plan: Plan, limits: VehicleLimits, cap_mps: float) -> Plan:
    """The plan with its look-ahead within what the vehicle takes: planners do not know the vehicle. A speed stays as it
    is, unless it is above the cap by no more than the hundredths that planners write.

    Args:
        plan: As the planner gave it.
        limits: Of the vehicle's file.
        cap_mps: Highest speed the planner was told of.
    """
    policy = plan.policy
    if not isinstance(policy, Parameters):
        return plan
    parameters = replace(
        policy,
        target_speed_mps=_rounded(policy.target_speed_mps, cap_mps),
        look_ahead_m=_within(policy.look_ahead_m, limits.look_ahead_m),
        look_ahead_ratio=_within(policy.look_ahead_ratio, limits.look_ahead_ratio_s),
    )
    settings = tuple(
        (name, _rounded(value, cap_mps) if name == "target_speed_mps" else value) for name, value in plan.settings
    )
    return replace(in_own_words(plan, parameters), settings=settings)


def _rounded(speed_mps: float, cap_mps: float) -> float:
    return cap_mps if cap_mps < speed_mps <= cap_mps + HUNDREDTH_MPS else speed_mps


def _within(value: float, bounds: tuple[float, float]) -> float:
    return min(max(value, bounds[0]), bounds[1]) if math.isfinite(value) else value


def check_all(plan: Plan, seen: VehicleObservation, before: VehicleObservation) -> tuple[Verdict, ...]:
    """Every verdict on a plan, in order; the papers' checks are not asked about a plan that is none for this vehicle.

    Args:
        plan: As the planner gave it, with its look-ahead fitted.
        seen: The vehicle now.
        before: The vehicle when planning began.
    """
    own = check_vehicle(plan, seen)
    if own.stops:
        return (own,)
    return (own, *run_checks(plan, seen.bounds(before), seen.limits, DEFAULT_CHECKS))


def check_vehicle(plan: Plan, seen: VehicleObservation) -> Verdict:
    """Whether this is something that a vehicle behind an interface can be asked for."""
    first = plan.intent.partition("+")[0]
    elsewhere = any(part.partition(".")[0] in _ELSEWHERE for part in plan.intent.split("+"))
    policy = plan.policy
    if elsewhere or (isinstance(policy, Parameters) and (policy.lane != 0 or policy.route)):
        return _no(
            "Lanes, ways and gaps are chosen by the vehicle's own planner; it is asked for a highest speed and a "
            "look-ahead alone.",
            "Ask for a speed.",
        )
    if policy is None:
        return Verdict(VEHICLE_CHECK, True, "There is nothing to ask for.", not_compared="no-policy")
    if not isinstance(policy, Parameters):
        return _no(
            f"The planner gives a policy of the kind {policy.kind!r}; a vehicle takes parameters.",
            "Use the planner talk2drive.",
        )
    if math.isnan(seen.speed_mps) and not math.isfinite(policy.target_speed_mps):
        return _no(
            "How fast the vehicle drives is not known, so what is faster or slower is not either.",
            "Name a speed, e.g. 20 km/h.",
        )
    if first.startswith("speed.limit") and seen.sign_mps is None:
        return _no("The speed limit here is not known.", "Name a speed.")
    if first.startswith("speed.limit") and seen.sign_mps == math.inf:
        return _no("No speed limit is in force here.", "Name a speed.")
    if first in _UPWARDS and seen.asked is not None:
        allowed = seen.asked.target_speed_mps
        if policy.target_speed_mps < allowed - _SLACK_MPS:
            return _no(
                f"The vehicle may drive up to {speed_text(allowed)} already; what holds it back is its own planner, "
                "and that is not overruled.",
                f"Name a speed above {speed_text(allowed)} to raise what it may drive.",
            )
    return Verdict(VEHICLE_CHECK, True, "It is a speed and a look-ahead, which this vehicle can be asked for.")


def _no(reason: str, remedy: str) -> Verdict:
    return Verdict(VEHICLE_CHECK, False, reason, None, remedy)
