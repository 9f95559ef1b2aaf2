"""Names and numbers as people read them: speeds with both units, outcomes and scores in words."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from typing import Final, Literal

from chauffeur.concept import Causes, Command, Feedback, Intervention, Metric, Outcome, Verdict
from chauffeur.concept.units import kmh
from chauffeur.safety.alignment import ALIGNMENT_CHECK, DRIVEN_CHECK

Tone = Literal["good", "bad", "neutral"]

SIMULATED = "Simulated drive (highway-env physics)"
_OTHER_PHYSICS = {"parking": "Simulated drive (kinematic bicycle model)"}


def simulated(world: str) -> str:
    """What every picture of a simulated drive says of itself.

    Args:
        world: Kind of world as its scenario names it.
    """
    return _OTHER_PHYSICS.get(world, SIMULATED)


_OUTCOMES: dict[Outcome, tuple[str, Tone]] = {
    "success": ("Done as asked", "good"),
    "failure": ("Not done as asked", "bad"),
    "collision": ("Collision", "bad"),
    "off_road": ("Left the road", "bad"),
    "timeout": ("Ran out of time or road", "bad"),
    "ended": ("Drive ended", "neutral"),
    "refused": ("Refused", "neutral"),
    "not_driven": ("Not driven", "neutral"),
}

_VERSION = re.compile(r"-v\d+$")

_METRICS = {
    "ttc": "Time-to-collision score",
    "speed-variance": "Smooth-speed score",
    "time-efficiency": "Time-efficiency score",
    "score": "Driving score",
}

_SUFFIXES = (
    ("_mps2", "m/s²"),
    ("_mps", "m/s"),
    ("_rad", "rad"),
    ("_m", "m"),
    ("_s", "s"),
)


def outcome_words(outcome: Outcome) -> tuple[str, Tone]:
    """An outcome as a short label and whether it is good news."""
    return _OUTCOMES[outcome]


_RULES: Final = {
    "gap": "distance ahead",
    "lane": "lane not free",
    "speed": "speed limit",
    "stop": "stop line",
    "yield": "right of way",
    "clear": "clearing the crossing",
    "brake": "braking too hard",
    "reverse": "standing, not reversing",
    "finite": "no number",
}
"""The shield's rules in a few words."""


_SAME_MPS2: Final = 0.05
_SAME_RAD: Final = 0.002
"""Smaller changes of a command are not told beside a greater one."""

_DOUBTS: Final = {
    ALIGNMENT_CHECK: "The explanation does not fit the program",
    DRIVEN_CHECK: "The drive did not go as explained",
}


def cause_words(causes: Causes) -> tuple[str, ...]:
    """Every cause that holds, in words; empty when nothing went wrong."""
    words = [
        text
        for holds, text in (
            (causes.policy_failed, "The program was rejected, or failed while it ran."),
            (causes.infra_failed, "Endpoint, sandbox or machine failed; this says nothing about the plan."),
            (causes.refused, "The wish was declined."),
            (causes.fallback_used, "The autopilot drove on without the program."),
        )
        if holds
    ]
    if causes.detail:
        words.append(causes.detail)
    return tuple(words)


def shield_words(interventions: Sequence[Intervention]) -> str:
    """How often the run-time shield changed a command, and why; empty when it never did."""
    if not interventions:
        return ""
    if len(interventions) == 1:
        return f"The shield changed a command once: {rule_words(interventions[0].rule)}."
    counts = Counter(change.rule for change in interventions)
    why = ", ".join(f"{rule_words(rule)} {count}" for rule, count in counts.most_common())
    return f"The shield changed a command {len(interventions)} times: {why}."


def rule_words(rule: str) -> str:
    """A rule of the shield in a few words."""
    return _RULES.get(rule, rule)


def change_words(before: Command, after: Command) -> str:
    """What became of a command: `+1.5 → −3.2 m/s²`, and the steering where that was changed."""
    parts: list[str] = []
    steered = abs(after.steering_rad - before.steering_rad) >= _SAME_RAD
    if steered:
        parts.append(f"steering {_steering(before)} → {_steering(after)}")
    if not steered or abs(after.acceleration_mps2 - before.acceleration_mps2) >= _SAME_MPS2:
        asked, done = (_signed(one.acceleration_mps2) for one in (before, after))
        parts.append(f"{asked} → {done} m/s²")
    return ", ".join(parts)


def _signed(value: float) -> str:
    text = f"{value:+.1f}"
    return "0.0" if float(text) == 0.0 else text.replace("-", "\N{MINUS SIGN}")


def _steering(command: Command) -> str:
    degrees = f"{abs(math.degrees(command.steering_rad)):.1f}°"
    if float(degrees[:-1]) == 0.0:
        return "0.0°"
    return f"{degrees} {'right' if command.steering_rad > 0.0 else 'left'}"


def doubt_words(check: str) -> str:
    """What it means that a check which only informs did not pass."""
    return _DOUBTS.get(check, f"{check} did not pass")


def unexplained(verdicts: Sequence[Verdict]) -> bool:
    """Whether the person was told something that is not so."""
    return any(one.alignment is not None and not one.alignment.aligned for one in verdicts)


def metric_name(metric_id: str) -> str:
    """A versioned metric id as a name: `lampilot-ttc-v1` is the time-to-collision score."""
    name = _VERSION.sub("", metric_id).removeprefix("lampilot-")
    return _METRICS.get(name) or name.replace("-", " ").capitalize()


def metric_value(metric: Metric) -> str:
    """Value with its unit, or that it does not apply."""
    if not metric.applies:
        return "does not apply"
    return speed(metric.value) if metric.unit == "m/s" else f"{metric.value:.1f} {metric.unit}".rstrip()


def speed(speed_mps: float) -> str:
    """A speed in both units: `28.0 m/s (101 km/h)`."""
    return f"{speed_mps:.1f} m/s ({kmh(speed_mps):.0f} km/h)"


def setting(name: str, value: float) -> tuple[str, str]:
    """A named number as (label, value with unit), read off the name's unit suffix."""
    for suffix, unit in _SUFFIXES:
        if name.endswith(suffix):
            label = name.removesuffix(suffix).replace("_", " ")
            return label, speed(value) if unit == "m/s" else f"{value:g} {unit}"
    return name.replace("_", " "), f"{value:g}"


def feedback_words(feedback: Feedback) -> str:
    """What a person's feedback was taken to mean, e.g. `wants a larger gap`."""
    meanings = (
        (feedback.speed, "wants it slower", "wants it faster"),
        (feedback.gap, "wants a larger gap", "wants a smaller gap"),
        (feedback.comfort, "wants it smoother", "wants it brisker"),
        (feedback.approval, "disliked it", "liked it"),
    )
    said = [less if sign < 0 else more for sign, less, more in meanings if sign]
    return ", ".join(said) or "no change wanted"


def seed_words(seed: int) -> str:
    """A seed at a readable length; the origin's run to 43 digits."""
    text = str(seed)
    return text if len(text) <= 12 else f"{text[:4]}...{text[-4:]}"
