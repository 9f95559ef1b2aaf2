"""Ground truth of a scene that its pictures show: a class for every family of questions that can be asked.

A question is left out where its answer cannot be seen, or where two of its options could be called right.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from chauffeur.bench.nuplanqa.scenes.scene import QaScene, QaUser
from chauffeur.concept.scene import Observation

Seen = Collection[int | str]
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

ASKED_M: Final = 45.0
"""A vehicle ahead at a greater distance is too small in the pictures to be asked about."""
_CHANGE_M: Final = 2.0
_SAME_M: Final = 0.8
"""Change of the gap over the clip from which it is told to open or close, and below which to stay."""
_TOLD_APART: Final = ("nobody", "car", "truck", "bus")
"""Classes beside or behind that are asked about."""
_FAST_UNCLEAR: Final = frozenset({"light", "lanes", "layout", "key", "manoeuvre", "situation", "action"})


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


def facts_of(scene: QaScene, seen: Seen, *, asked: bool = True) -> Iterator[Fact]:
    """Facts that can be asked about a scene; if not `asked`, also those that its speed gives away."""
    closed = scene.unclear | (_FAST_UNCLEAR if scene.fast and asked else frozenset())
    for family, value in _plain(scene, seen):
        if value and family not in closed:
            yield Fact(family, "", value)
    for side, user, lane in (("left", scene.left, -1), ("right", scene.right, 1)):
        if not 0 <= scene.own + lane < scene.lanes or f"beside {side}" in closed or not _clear(user, seen):
            continue
        if (kind := _kind(user)) in _TOLD_APART:
            yield Fact("beside", side, kind)


def _plain(scene: QaScene, seen: Seen) -> Iterator[tuple[str, str]]:
    lead, light, walker = scene.lead, scene.light, scene.walker
    light_seen = light is None or scene.light_id in seen
    lead_seen = "lead" not in scene.unclear and _clear(lead, seen) and (lead is None or lead.ahead_m <= ASKED_M)
    yield "light", (light or "none") if light_seen else ""
    yield "sky", scene.sky
    yield "lanes", "" if scene.sky == "snowy day" else str(scene.lanes)  # snow hides the markings
    yield "layout", scene.layout
    yield "ahead", _kind(lead) if lead_seen else ""
    behind = _kind(scene.behind)
    yield "behind", behind if _clear(scene.behind, seen) and behind in _TOLD_APART else ""
    yield "density", _density(scene, seen)
    yield "gap", _gap(scene) if lead_seen else ""
    if not (light_seen and lead_seen and _clear(walker, seen)):
        return
    yield "key", _key(scene)
    yield "manoeuvre", _towards(scene)
    yield "situation", _situation(scene)
    yield "action", _action(scene)


def _clear(user: QaUser | None, seen: Seen) -> bool:
    """True if a road user is seen, or there is none."""
    return user is None or user.id in seen


def _kind(user: QaUser | None) -> str:
    return "nobody" if user is None else user.kind


def _density(scene: QaScene, seen: Seen) -> str:
    """Number of vehicles ahead, as a class; not asked where one of them cannot be made out."""
    if any(one.id not in seen for one in scene.ahead):
        return ""
    return ("nobody", "one", "two", "more")[min(len(scene.ahead), 3)]


def _gap(scene: QaScene) -> str:
    """Change of the gap to the lead vehicle over the clip; of a standing ego it tells nothing."""
    if scene.motion == "still":
        return ""
    if scene.lead is None:
        return "nobody"
    now, before = (_distance_m(instant, scene.lead.id) for instant in (scene.now, scene.instants[0]))
    if now is None or before is None:
        return ""
    change = now - before
    if abs(change) < _SAME_M:
        return "same"
    return "" if abs(change) < _CHANGE_M else "opens" if change > 0.0 else "closes"


def _distance_m(instant: Observation, who: int) -> float | None:
    one = next((one for one in instant.others if one.id == who), None)
    return None if one is None else math.hypot(one.x_m - instant.ego.x_m, one.y_m - instant.ego.y_m)


def _reasons(scene: QaScene) -> list[str]:
    """Things the ego has to heed."""
    found: list[str] = []
    if scene.walker is not None:
        found.append(f"walker {scene.walker_from}")
    if scene.light in ("red", "yellow"):
        found.append("light")
    if scene.lead is not None:
        found.append("lead")
    return found


def _key(scene: QaScene) -> str:
    """People on the road before lights, lights before vehicles; asked where no two compete."""
    found = _reasons(scene)
    if len(found) > 1:
        return ""
    return found[0] if found else "nothing"


def _towards(scene: QaScene) -> str:
    found, junction = _reasons(scene), scene.layout == "junction"
    if len(found) > 1 or (found == ["lead"] and junction):
        return ""
    if found:
        return found[0].partition(" ")[0]
    return "green" if scene.light == "green" else "junction" if junction else "free"


def _situation(scene: QaScene) -> str:
    if scene.kind == "lot":
        return "lot"
    found = _reasons(scene)
    if len(found) > 1:
        return ""
    if scene.kind == "crossing":
        if scene.lead is not None or scene.walker is not None:
            return ""
        return {"red": "crossing red", "green": "crossing green", None: "crossing open"}.get(scene.light, "")
    reason = found[0].partition(" ")[0] if found else "free"
    return "" if reason == "light" or (scene.kind, reason) == ("highway", "walker") else f"{scene.kind} {reason}"


def _action(scene: QaScene) -> str:
    """Next action of a careful driver; of a standing ego nothing is asked."""
    found = _reasons(scene)
    if scene.motion == "still" or len(found) > 1:
        return ""
    if not found:
        return "on"
    reason = found[0].partition(" ")[0]
    if reason != "lead":
        return reason
    if _gap(scene) != "closes" or "beside left" in scene.unclear:
        return ""
    if scene.own == 0 or scene.left is not None:
        return "slow"
    return "" if scene.left_taken else "pass"


def sighted(scene: QaScene, reach_m: float = 70.0, hidden: float = 0.6) -> frozenset[int | str]:
    """Road users visible by geometry alone, where nothing is rendered: near enough and not occluded.

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
        if distance <= reach_m and covered <= hidden * 2.0 * half:
            seen.add(who)
    for signal in now.signals:
        (x0, y0), (x1, y1) = signal.stop_line_m
        if math.hypot((x0 + x1) / 2.0 - now.ego.x_m, (y0 + y1) / 2.0 - now.ego.y_m) <= reach_m:
            seen.add(signal.id)
    return frozenset(seen)
