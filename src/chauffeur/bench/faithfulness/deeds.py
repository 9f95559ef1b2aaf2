"""Actual deeds of a planned program, in the form that the benchmark's own grammar tells it from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.bench.faithfulness.plans import PlannedCase, PlanStart
from chauffeur.planners.onboard.options import Chosen

What = Literal[
    "speed", "cap", "gap", "headway", "lane", "lanes", "edge", "overtake", "turn", "pull over", "stop", "stay", "keep",
    "limit", "style",
]  # fmt: skip

_LEAST_GAP_M: Final = 6.0


@dataclass(frozen=True, slots=True)
class PlannedDeed:
    """One thing a program does.

    Attributes:
        what: What it is.
        side: `left`, `right`, `straight` or empty.
        sign: -1 less, +1 more than now, 0 neither.
        value: m/s or m or s.
        returns: Of an overtaking: whether it ends in the lane it began in.
        checked: Whether it waits until the way is free.
        count: Lanes.
    """

    what: What
    side: str = ""
    sign: int = 0
    value: float | None = None
    returns: bool = False
    checked: bool = False
    count: int = 1


def deeds_of(planned: PlannedCase) -> tuple[PlannedDeed, ...]:
    """Deeds of each step, the numbers of the first ones carried on to the later ones."""
    speed = planned.start.situation.speed_mps
    found: list[PlannedDeed] = []
    for step in planned.steps:
        found.append(_deed(step, planned.start, speed))
        if not step.intent.startswith("overtake"):  # it ends at the speed it began with
            speed = dict(step.settings).get("target_speed_mps", speed)
    return tuple(found)


def tellable(deeds: Sequence[PlannedDeed], known: frozenset[str]) -> bool:
    """True if all deeds are of known kinds, and none is a gap that leaves no room between the cars."""
    return all(deed.what in known and (deed.what != "gap" or (deed.value or 0.0) > _LEAST_GAP_M) for deed in deeds)


def _deed(step: Chosen, start: PlanStart, speed: float) -> PlannedDeed:
    kind, _, rest = step.filled.id.partition(".")
    settings = dict(step.settings)
    side = next((word for word in ("left", "right", "straight") if word in rest), "")
    target = settings.get("target_speed_mps")
    match kind:
        case "speed" if rest == "cap":
            return PlannedDeed("cap", value=target)
        case "speed" if rest == "limit":
            return PlannedDeed("limit", value=target)
        case "speed":
            off = (target or 0.0) - speed
            return PlannedDeed("speed", sign=0 if abs(off) < 0.5 else 1 if off > 0 else -1, value=target)
        case "gap" if "gap_m" in settings:
            now = start.situation.front.distance_m if start.situation.front is not None else 0.0
            off = settings["gap_m"] - now
            return PlannedDeed("gap", sign=0 if abs(off) < 1.0 else 1 if off > 0 else -1, value=settings["gap_m"])
        case "gap":
            return PlannedDeed("headway", value=settings.get("time_headway_s"))
        case "lane" if rest == "keep":
            return PlannedDeed("stay")
        case "lane" if "most" in rest:
            return PlannedDeed("edge", side=side, checked=True)
        case "lane" if "several" in rest:
            return PlannedDeed("lanes", side=side, checked=True, count=abs(step.lanes_moved))
        case "lane":
            return PlannedDeed("lane", side=side, checked=True)
        case "overtake":
            return PlannedDeed("overtake", side=side, returns="return" in rest, checked=True)
        case "turn" | "crossing":
            return PlannedDeed("turn", side=side, checked=True)
        case "pull_over":
            return PlannedDeed("pull over", side="right", checked=True)
        case "stop":
            return PlannedDeed("stop")
        case "style":
            return PlannedDeed("style", value=target, sign=_sign((target or speed) - speed))
        case _:
            return PlannedDeed("keep")


def _sign(off: float) -> int:
    return 0 if abs(off) < 0.5 else 1 if off > 0 else -1
