"""Names and numbers as people read them: speeds whole and in one unit, results and scores in words."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, Final, Literal

from chauffeur.concept import (
    Causes,
    Command,
    Feedback,
    Intervention,
    JudgedBy,
    Mark,
    Metric,
    Outcome,
    PartResult,
    Result,
    Trip,
    Verdict,
    WishPart,
    result_of,
)
from chauffeur.concept.units import MPS_PER_KMH, SpeedUnit, people_speed
from chauffeur.driving.divergence import Parting
from chauffeur.driving.judge.account import understood_of
from chauffeur.driving.judge.trace import STANDS_MPS
from chauffeur.safety.faithfulness import DRIVEN_CHECK, FAITHFULNESS_CHECK

Tone = Literal["good", "bad", "neutral"]

SIMULATED = "Simulated drive (highway-env physics)"
_OTHER_PHYSICS = {
    "parking": "Simulated drive (kinematic bicycle model)",
    "track": "Simulated drive (CommonRoad vehicle models)",
    "town": "Simulated drive (SUMO traffic, kinematic ego; not CARLA)",
    "carla": "Simulated drive (CARLA)",
}


def simulated(world: str) -> str:
    """What every picture of a simulated drive says of itself.

    Args:
        world: Kind of world as its scenario names it.
    """
    return _OTHER_PHYSICS.get(world, SIMULATED)


_SIGNS: Final[dict[Result, str]] = {
    Result.DONE: "✓",
    Result.PARTLY_DONE: "~",
    Result.NOT_DONE: "✕",
    Result.ASKED_BACK: "?",
    Result.DECLINED: "–",
    Result.FAILED: "✕",
}
_ENDED: Final[dict[Outcome, str]] = {
    "collision": "it ended in a collision",
    "off_road": "the car left the road",
    "timeout": "time or road ran out",
}
"""Ends of a drive that its parts do not tell."""
_NOT_DONE: Final[frozenset[Outcome]] = frozenset({"failure", "timeout", "not_driven"})
_SAID_BACK: Final[dict[Result, str]] = {
    Result.DONE: "I answered",
    Result.ASKED_BACK: "I asked back",
    Result.DECLINED: "I declined",
    Result.FAILED: "no plan could be used",
}
"""What became of a wish of which nothing was driven, before the reason."""
RESULT_TONES: Final[dict[Result, Tone]] = {
    Result.DONE: "good",
    Result.PARTLY_DONE: "neutral",
    Result.NOT_DONE: "bad",
    Result.ASKED_BACK: "neutral",
    Result.DECLINED: "neutral",
    Result.FAILED: "bad",
}
_JUDGED_BY: Final[dict[JudgedBy, str]] = {
    "reading": "Judged by geometry, for what the words were read to mean; a planner may go by the same reading.",
    "labels": "Judged by geometry, for what people say the words mean.",
    "words": "Judged by your words, which rules read that see no plan.",
    "plan": "Judged by what the planner says it does, where the words read alone say less: judge and planner share it.",
    "goal": "Judged by the scenario's own goal.",
    "place": "Judged by the place: the planner chose it, the world's geometry says whether the car is there.",
}

_VERSION = re.compile(r"-v\d+$")

_METRICS = {
    "ttc": "Time-to-collision score",
    "speed-variance": "Smooth-speed score",
    "time-efficiency": "Time-efficiency score",
    "score": "Driving score",
    "asked-speed": "Planned speed",
    "asked-gap": "Planned gap",
    "end-speed": "Speed at the end",
    "end-gap": "Gap at the end",
    "end-lane": "Lanes to the right at the end",
    "held": "Held as asked for",
}

_SUFFIXES = (
    ("_mps2", "m/s²"),
    ("_mps", "m/s"),
    ("_rad", "rad"),
    ("_m", "m"),
    ("_s", "s"),
)


MARKS: Final[dict[Mark, str]] = {"passed": "✓", "open": "~", "differs": "≠", "failed": "✕", "not_compared": "–"}
"""Signs of verdicts; which one a verdict gets is its own to say."""
MARK_STYLES: Final[dict[Mark, str]] = {
    "passed": "green",
    "open": "yellow",
    "differs": "bold yellow",
    "failed": "bold red",
    "not_compared": "dim",
}

_MPH: Final = re.compile(r"\b(?:mph|miles? (?:per|an) hour)\b", re.IGNORECASE)
_KMH: Final = re.compile(r"\b(?:km\s?/?\s?h|kph|kilomet(?:er|re)s? (?:per|an) hour)\b", re.IGNORECASE)
_IN_KMH: Final = re.compile(r"(?<![\w.])(\d{1,4}(?:\.\d{1,9})?) km/h(?: \(\d{1,4} mph\))?")
_SPEED: Final = re.compile(r"(?<![\w.])(\d{1,4}(?:\.\d{1,9})?) m/s(?![²2^\w/])(?: \([^()\n]{1,40}\))?")
_LENGTH: Final = re.compile(r"(?<![\w.])(\d{1,5}\.\d{1,9}) m(?![\w/])")


def pace_of(wish: str, before: SpeedUnit = "km/h") -> SpeedUnit:
    """The unit of speed for a person, by the words of their wish; the one before where they name none."""
    return "mph" if _MPH.search(wish) else "km/h" if _KMH.search(wish) else before


def passenger_units(text: str, unit: SpeedUnit = "km/h") -> str:
    """A text with its speeds in the person's unit and its metres whole; what stood in brackets behind was that, too."""
    told = _SPEED.sub(lambda match: people_speed(float(match[1]), unit), text)
    told = _IN_KMH.sub(lambda match: people_speed(float(match[1]) * MPS_PER_KMH, unit), told)
    return _LENGTH.sub(lambda match: f"{float(match[1]):.0f} m", told)


def trip_words(trip: Trip, *, timed: bool = False) -> tuple[str, str, Tone]:
    """How a trip ended: mark, label and tone. No tick where something was not compared, or told and is not so.

    Args:
        trip: The trip.
        timed: Whether the label says after how long, where anything was driven.
    """
    result = result_of(trip)
    tone, label = RESULT_TONES[result], str(result).capitalize()
    compared = result is not Result.DONE or trip.outcome not in ("ended", "refused")
    if not compared:
        label, tone = label if trip.outcome == "refused" else f"{label}, not compared", "neutral"
    if timed and trip.duration_s:
        label = f"{label} after {trip.duration_s:.0f} s"
    if tone != "bad" and unexplained(trip.verdicts):
        return MARKS["differs"], f"{label}, not as explained", "neutral"
    sign = _SIGNS[result] if compared else MARKS["not_compared"]
    return sign, label, tone


def account_words(trip: Trip) -> str:
    """What was understood, done and not done, as the rest of a sentence that begins with the wish, in its units."""
    told = passenger_units("; ".join(part for part in _account(trip) if part), pace_of(trip.instruction.text))
    return f"; {told}{'' if told.endswith(('.', '?', '!')) else '.'}"


def _account(trip: Trip) -> Iterator[str]:
    if trip.outcome == "refused":
        yield f"{_SAID_BACK.get(result_of(trip), 'nothing was driven')}: {trip.plan.refusal or trip.causes.detail}"
        return
    named = understood_of(trip.plan)
    parts = [replace(one, words=one.words or ", then ".join(named)) for one in trip.parts]
    understood = [part.words for part in parts] or [*named]
    yield f"I understood: {', then '.join(understood)}" if any(understood) else ""
    done = [part.words for part in parts if part.result == "done"]
    if len(done) == len(parts) and (parts or trip.outcome == "success"):
        yield "done: all of it" if len(parts) > 1 else "done"
    else:
        yield f"done: {', '.join(done)}" if done else ""
        yield "not done" if not parts and trip.outcome in _NOT_DONE else ""
        yield f"not done: {why}" if (why := _short(parts, "not_done", "opposite")) else ""
    yield _ENDED.get(trip.outcome, "")
    yield f"not compared: {why}" if (why := _short(parts, "not_judged")) else ""
    if trip.outcome == "ended" and not parts:
        yield "not compared: nothing in this drive can be held against the words"
    if trip.unused:
        yield f"not used: {', '.join(f'“{words}”' for words in trip.unused)}"


def _short(parts: Sequence[WishPart], *results: PartResult) -> str:
    """Parts that ended so, each with why; empty where there is none."""
    found = (part for part in parts if part.result in results)
    return ", ".join(f"{part.words} ({part.why})" if part.why else part.words for part in found)


def judged_words(trip: Trip) -> str:
    """What the drive was held against, and what that shares with the planner; empty where with nothing."""
    return _JUDGED_BY[trip.judged_by] if trip.judged_by else ""


_CHECKS: Final = {
    "format": "driving language",
    "parameters": "numbers fit",
    "reach": "within limits",
    "alignment": "explanation",
    "alignment-driven": "drove as explained",
    "shield": "shield",
}


def not_compared_words(verdict: Verdict) -> str:
    """Why a check compared nothing: `not compared: there is no program to follow.`"""
    return f"not compared: {verdict.reason[:1].lower()}{verdict.reason[1:]}"


def not_compared_names(verdicts: Sequence[Verdict]) -> str:
    """The checks that compared nothing, by name; empty where all did."""
    return ", ".join(check_name(verdict.check) for verdict in verdicts if verdict.mark == "not_compared")


def check_name(check: str) -> str:
    """A versioned check id as a few words."""
    name = _VERSION.sub("", check)
    return _CHECKS.get(name, name.replace("-", " "))


def end_words(trip: Trip) -> str:
    """What the drive came to, in numbers beside those that were asked for; empty where nothing was measured."""
    found = {metric.id: metric.value for metric in trip.metrics}
    unit = pace_of(trip.instruction.text)
    parts: list[str] = []
    if trip.outcome == "success" and any(tag.startswith("overtake") for tag in trip.plan.intent.split("+")):
        parts.append("past the vehicle ahead")
    if "end-lane-v1" in found:
        moved = round(found["end-lane-v1"])
        if moved:
            side = "left" if moved < 0 else "right"
            count = "one lane" if abs(moved) == 1 else f"{abs(moved)} lanes"
            parts.append(f"{count} to the {side} of where it began")
        elif _changes_lanes(trip.plan.intent):
            parts.append("back in the lane where it began")
    if "end-gap-v1" in found:
        parts.append(_beside("gap", found["end-gap-v1"], found.get("asked-gap-v1"), lambda gap: f"{gap:.0f} m"))
    if "end-speed-v1" in found:
        wanted = found.get("asked-speed-v1")
        stands = found["end-speed-v1"] < STANDS_MPS and not wanted
        speed = _beside("speed", found["end-speed-v1"], wanted, lambda speed: people_speed(speed, unit))
        parts.append("standing" if stands else speed)
    text = "" if parts == ["standing"] else ", ".join(parts)
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def _changes_lanes(intent: str) -> bool:
    return any(tag.startswith(("overtake", "lane.left", "lane.right")) for tag in intent.split("+"))


def _beside(name: str, value: float, asked: float | None, told: Callable[[float], str]) -> str:
    if asked is None:
        return f"{name} {told(value)}"
    return f"{name} {told(value)} ({told(asked)} planned)"


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
    FAITHFULNESS_CHECK: "The explanation does not fit the program",
    DRIVEN_CHECK: "The drive did not go as explained",
}


def cause_words(causes: Causes) -> tuple[str, ...]:
    """Every cause that holds, in words; empty when nothing went wrong."""
    words = [
        text
        for holds, text in (
            (causes.policy_failed, "The program was rejected, or failed while it ran."),
            (causes.infra_failed, "Endpoint, sandbox or machine failed; this says nothing about the plan."),
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
    return f"{degrees} {'left' if command.steering_rad > 0.0 else 'right'}"


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


def metric_value(metric: Metric, unit: SpeedUnit | None = None) -> str:
    """Value with its unit, a speed in the person's where one is given; or that it does not apply."""
    if not metric.applies:
        return "does not apply"
    return speed(metric.value, unit) if metric.unit == "m/s" else f"{metric.value:.1f} {metric.unit}".rstrip()


def speed(speed_mps: float, unit: SpeedUnit | None = None) -> str:
    """A speed in the person's unit; for engineers, without one, `28.0 m/s (101 km/h)`."""
    return people_speed(speed_mps, unit) if unit else f"{speed_mps:.1f} m/s ({people_speed(speed_mps)})"


def setting(name: str, value: float, unit: SpeedUnit | None = None) -> tuple[str, str]:
    """A named number as (label, value with unit), read off the name's unit suffix; a speed in the person's unit where
    one is given."""
    for suffix, measure in _SUFFIXES:
        if name.endswith(suffix):
            label = name.removesuffix(suffix).replace("_", " ")
            if measure == "m/s" and unit:
                return label, people_speed(value, unit, at_most=label.startswith("target"))
            return label, speed(value) if measure == "m/s" else f"{value:g} {measure}"
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


def parting_words(parting: Parting | None, unit: SpeedUnit) -> tuple[str, str]:
    """Where two drives part, as what is said of the first and of the second."""
    if parting is None:
        return "never", "never"
    if parting.name == "position":
        return f"at {parting.time_s:.1f} s", f"{parting.second:.1f} m away"
    if parting.name == "end":
        return f"ends at {parting.first:.1f} s", f"ends at {parting.second:.1f} s"
    first, second = (_part_words(parting.name, value, unit) for value in (parting.first, parting.second))
    return f"at {parting.time_s:.1f} s: {first}", second


def _part_words(name: str, value: Any, unit: SpeedUnit) -> str:
    """A set-point or a speed: `target speed 108 km/h`."""
    if value is None:
        return f"{name.removesuffix('_mps').replace('_', ' ')} as it is"
    if isinstance(value, float):
        return " ".join(setting("speed_mps" if name == "speed" else name, value, unit))
    return f"{name.replace('_', ' ')} {value}"


def seed_words(seed: int) -> str:
    """A seed at a readable length; the origin's run to 43 digits."""
    text = str(seed)
    return text if len(text) <= 12 else f"{text[:4]}...{text[-4:]}"
