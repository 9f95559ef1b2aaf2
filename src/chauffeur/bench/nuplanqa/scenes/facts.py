"""What is true of a scene and can be seen in its pictures: a class for every family of questions that can be asked.

A question is left out where its answer cannot be seen, or where two of its options could be called right.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from chauffeur.bench.nuplanqa.scenes.staging import EGO_ID, EGO_SIZE, SIZES, StagedMover, StagedScene
from chauffeur.concept.scene import Observation

VehicleObservation = Collection[int | str]
"""Ids of the road users and traffic lights that can be made out in at least one picture of the present instant."""

FAMILIES: Final[Mapping[str, str]] = {
    "light": "Traffic Light",
    "sky": "Weather/Lighting Conditions",
    "lanes": "Road Type/Conditions",
    "layout": "Road Type/Conditions",
    "ahead": "Surrounding Objects",
    "beside": "Surrounding Objects",
    "behind": "Surrounding Objects",
    "density": "Traffic Flow",
    "gap": "Traffic Flow",
    "key": "Key Objects",
    "manoeuvre": "Ego-Vehicle Maneuver",
    "situation": "Situation Assessment",
    "action": "Action Recommendation",
}
"""Families of questions, and the subtask each belongs to."""

_FRONT_M: Final = EGO_SIZE[0] / 2.0
_CHANGE_M: Final = 2.0
_SAME_M: Final = 0.8
"""Change of the gap over the clip from which it is told to open or close, and below which to stay."""


@dataclass(frozen=True, slots=True)
class Fact:
    """The right class of a family in a scene.

    Attributes:
        family: One of FAMILIES.
        side: What a question with a gap in it is about: `left` or `right`; empty for the others.
        value: The class; its words are in the family's bank.
    """

    family: str
    side: str
    value: str


def facts_of(scene: StagedScene, seen: VehicleObservation) -> Iterator[Fact]:
    """What can be asked about a scene."""
    for family, value in _plain(scene, seen):
        if value:
            yield Fact(family, "", value)
    for side, mover, lane in (("left", scene.left, -1), ("right", scene.right, 1)):
        own = round(-scene.ego.offset_m / 3.6 - 0.5)
        if 0 <= own + lane < scene.plan.lanes and _clear(mover, seen):
            yield Fact("beside", side, _kind(mover))


def _plain(scene: StagedScene, seen: VehicleObservation) -> Iterator[tuple[str, str]]:
    lead, light, walker = scene.lead, scene.light, scene.walker
    light_seen = light is None or "own" in seen
    lead_seen, walker_seen = _clear(lead, seen), _clear(walker, seen)
    yield "light", (light or "none") if light_seen else ""
    yield "sky", scene.sky
    yield "lanes", "" if scene.sky == "snowy day" else str(scene.plan.lanes)  # snow hides the markings
    yield "layout", _layout(scene)
    yield "ahead", _kind(lead) if lead_seen else ""
    yield "behind", _kind(scene.behind) if _clear(scene.behind, seen) else ""
    yield "density", _density(scene, seen)
    yield "gap", _gap(scene) if lead_seen else ""
    if not (light_seen and lead_seen and walker_seen):
        return
    yield "key", _key(scene)
    yield "manoeuvre", _towards(scene)
    yield "situation", _situation(scene)
    yield "action", _action(scene)


def _clear(mover: StagedMover | None, seen: VehicleObservation) -> bool:
    """Whether somebody is seen, or is not there."""
    return mover is None or mover.id in seen


def _kind(mover: StagedMover | None) -> str:
    return "nobody" if mover is None else mover.kind


def _layout(scene: StagedScene) -> str:
    plan = scene.plan
    if plan.junction_m is not None:
        return "junction"
    return "straight" if plan.curvature_per_m == 0.0 else "left" if plan.curvature_per_m > 0.0 else "right"


def _density(scene: StagedScene, seen: VehicleObservation) -> str:
    """How many vehicles are wholly ahead of the ego's front; not asked where one is half beside it."""
    ours = [one for one in scene.others if one.kind != "pedestrian" and one.offset_m < 0.0]
    ahead = [one for one in ours if one.station_m - SIZES[one.kind][0] / 2.0 > _FRONT_M]
    beside = [one for one in ours if one not in ahead and one.station_m + SIZES[one.kind][0] / 2.0 > _FRONT_M + 1.0]
    if beside or any(one.id not in seen for one in ahead):
        return ""
    return ("nobody", "one", "two", "more")[min(len(ahead), 3)]


def _gap(scene: StagedScene) -> str:
    """How the gap to the lead vehicle has changed over the clip; of a standing ego it tells nothing."""
    if scene.motion == "still":
        return ""
    if scene.lead is None:
        return "nobody"
    change = _distance_m(scene.now, scene.lead.id) - _distance_m(scene.instants[0], scene.lead.id)
    if abs(change) < _SAME_M:
        return "same"
    return "" if abs(change) < _CHANGE_M else "opens" if change > 0.0 else "closes"


def _distance_m(instant: Observation, who: int) -> float:
    one = next(one for one in instant.others if one.id == who)
    return math.hypot(one.x_m - instant.ego.x_m, one.y_m - instant.ego.y_m)


def _reasons(scene: StagedScene) -> list[str]:
    """What the ego has to heed."""
    found: list[str] = []
    if scene.walker is not None:
        found.append("walker left" if scene.walker.across_mps < 0.0 else "walker right")
    if scene.light in ("red", "yellow"):
        found.append("light")
    if scene.lead is not None:
        found.append("lead")
    return found


def _key(scene: StagedScene) -> str:
    """People on the road before lights, lights before vehicles; asked where no two compete."""
    found = _reasons(scene)
    if len(found) > 1:
        return ""
    return found[0] if found else "nothing"


def _towards(scene: StagedScene) -> str:
    found = _reasons(scene)
    if len(found) > 1 or (found == ["lead"] and scene.plan.junction_m is not None):
        return ""
    if found:
        return found[0].partition(" ")[0]
    return "green" if scene.light == "green" else "junction" if scene.plan.junction_m is not None else "free"


def _situation(scene: StagedScene) -> str:
    kind, found = scene.plan.kind, _reasons(scene)
    if len(found) > 1:
        return ""
    if kind == "crossing":
        if scene.lead is not None:
            return ""
        return {"red": "crossing red", "green": "crossing green", None: "crossing open"}.get(scene.light, "")
    reason = found[0].partition(" ")[0] if found else "free"
    return f"{kind} {reason}"


def _action(scene: StagedScene) -> str:
    """What a careful driver does next; of a standing ego nothing is asked."""
    found = _reasons(scene)
    if scene.motion == "still" or len(found) > 1:
        return ""
    if not found:
        return "on"
    reason = found[0].partition(" ")[0]
    if reason != "lead":
        return reason
    if _gap(scene) != "closes":
        return ""
    own = round(-scene.ego.offset_m / 3.6 - 0.5)
    return "pass" if own > 0 and scene.left is None else "slow"


def sighted(scene: StagedScene, reach_m: float = 70.0, hidden: float = 0.6) -> frozenset[int | str]:
    """Who can be made out by geometry alone, where nothing is rendered: near enough, and not behind somebody nearer.

    Args:
        scene: The scene.
        reach_m: What is farther is not made out.
        hidden: Share of a road user's angle that a nearer one may cover.
    """
    now = scene.now
    arcs: list[tuple[float, float, float, int]] = []
    for one in now.others:
        dx, dy = one.x_m - now.ego.x_m, one.y_m - now.ego.y_m
        distance = math.hypot(dx, dy)
        size = max(one.width_m, abs(one.length_m * math.sin(math.atan2(dy, dx) - one.heading_rad)))
        arcs.append((distance, math.atan2(dy, dx), math.atan2(size / 2.0, max(distance, 0.5)), one.id))
    arcs.sort()
    seen: set[int | str] = set()
    for place, (distance, bearing, half, who) in enumerate(arcs):
        covered = 0.0
        for _, other, its_half, _ in arcs[:place]:
            apart = abs(math.remainder(bearing - other, math.tau))
            covered = max(covered, min(half + its_half - apart, 2.0 * min(half, its_half)))
        if distance <= reach_m and covered <= hidden * 2.0 * half and who != EGO_ID:
            seen.add(who)
    for signal in now.signals:
        (x0, y0), (x1, y1) = signal.stop_line_m
        if math.hypot((x0 + x1) / 2.0 - now.ego.x_m, (y0 + y1) / 2.0 - now.ego.y_m) <= reach_m:
            seen.add(signal.id)
    return frozenset(seen)
