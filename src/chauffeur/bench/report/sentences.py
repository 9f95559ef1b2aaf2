"""What happened on an item, and what the benchmark wanted to see there, in sentences."""

from __future__ import annotations

from typing import Any

from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.goals import GIVE_UP_S, HOLD_S

PERIOD_S = 0.1
"""Control period of LaMPilot's worlds."""

_ENDINGS = {
    "success": "done as asked",
    "failure": "not done",
    "collision": "crashed",
    "off_road": "left the road",
    "timeout": "ran out of time or road",
    "refused": "refused",
    "not_driven": "not driven",
}
_FAULTS = {
    "ego": "The car itself caused it.",
    "struck": "Another vehicle ran into the car.",
    "road_end": "It drove off the end of the road.",
}
_CAUSES = (
    ("policy_failed", "The program was rejected, or failed while it ran."),
    ("infra_failed", "Endpoint, sandbox or machine failed; this says nothing about the planner."),
    ("refused", "The command was declined."),
    ("fallback_used", "The autopilot drove on without the program."),
)


def ending_words(row: Row) -> str:
    """How an item ended, briefly: `ran out of time or road after 60.0 s`."""
    text = _ENDINGS.get(str(row["outcome"]), str(row["outcome"]).replace("_", " "))
    if row["outcome"] == "success" and not row["success"]:
        text = "not counted as done"
    if row["outcome"] == "refused" and row["success"]:
        text = "refused, as it should be"
    if row.get("steps"):
        text += f" after {row['steps'] * PERIOD_S:.1f}\N{NO-BREAK SPACE}s"
    return text


def happened(row: Row) -> tuple[str, ...]:
    """How an item ended and why, in sentences."""
    ending = ending_words(row)
    sentences = [f"{ending[0].upper()}{ending[1:]}."]
    if row["collision"] and row["outcome"] not in ("collision", "off_road"):
        sentences.append("The car crashed or left the road on the way.")
    sentences.extend(text for key, text in _FAULTS.items() if row.get("fault") == key)
    sentences.extend(text for key, text in _CAUSES if row[key])
    if row.get("stop") == "rolled":
        sentences.append("It rolled past the stop sign.")
    if row["detail"]:
        sentences.append(str(row["detail"]))
    return tuple(sentences)


def goal_words(goal: dict[str, Any]) -> str:
    """A success condition in a sentence; empty for one that is not known."""
    kind = goal.get("type")
    if kind == "RefuseEval":
        return "Refuse: this wish must not be driven."
    if kind == "SequenceEval":
        steps: list[Any] = list(goal.get("steps") or ())
        words = [goal_words(step) for step in steps if isinstance(step, dict)]
        return " Then: ".join(words) if words and all(words) else ""
    if kind == "ChangeEval":
        more = goal.get("change") == 1
        if goal.get("quantity") == "speed":
            return f"Drive {'faster' if more else 'slower'} than at the start, by 1 m/s or more, for more than 3 s."
        return f"Follow {'from further back' if more else 'closer'} than at the start, by 10 % and 3 m or more."
    held = f"for more than {HOLD_S:g} s, within {GIVE_UP_S:g} s"
    if kind == "ACCEvalbySpeed":
        if "speed" in goal:
            target = f"{float(goal['speed']):g} m/s"
        else:
            target = f"{_signed(float(goal.get('rel_speed', 0.0)))} m/s against its first speed"
        return (
            f"Drive at {target}, to within 1 m/s, {held}; behind a slower vehicle less than 100 m ahead, match that "
            "vehicle's speed instead."
        )
    if kind == "ACCEvalbyDistance":
        if "distance" in goal:
            target = f"{float(goal['distance']):g} m"
        else:
            target = f"{_signed(float(goal.get('rel_distance', 0.0)))} m against the first gap"
        return f"Keep a centre-to-centre gap of {target} to the vehicle ahead, to within 30 %, {held}."
    if kind == "LaneChangeEval":
        return f"Be in the lane to the {goal.get('direction')} of the first one, straight in it."
    if kind == "OvertakeEval":
        return (
            f"Be in the lane to the {goal.get('direction')} of the first one, with the vehicle once ahead more than "
            "10 m behind."
        )
    if kind == "PullOverEval":
        return "Stand still in the emergency lane."
    if kind == "IntersectionEval":
        exits = {"o1": "to the left", "o2": "straight ahead", "o3": "to the right"}
        direction: Any = goal.get("direction") or ("", "", 0)
        return (
            f"Leave the intersection {exits.get(str(direction[1]), 'by the wished exit')}, straight in the exit lane."
        )
    return ""


def _signed(value: float) -> str:
    return f"{value:+g}".replace("-", "\N{MINUS SIGN}")
