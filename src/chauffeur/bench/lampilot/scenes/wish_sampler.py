"""Wishes of the original's kinds, drawn to fit the first instant of a drawn road.

A wish makes sense where it is said: there is a lead vehicle, a gap to close, a speed that is not driven already.
Where none does, the draw is given up with a reason.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from chauffeur.bench.lampilot.scenes.sampling import whole
from chauffeur.bench.lampilot.scenes.wishes import UNITS, Named, SceneWish
from chauffeur.concept import Lead, Observation
from chauffeur.driving.judge.goals import SIGHT_M

Generator = np.random.Generator

CAR_M = 5.0
LEAST_GAP_M = 12.0
"""Least gap wished, centre to centre: 7 m between bumpers. LaMPilot's own go below 0."""
TOLERANCE = 0.3
"""Band of LaMPilot's distance goal, as a share of the goal."""
FARTHEST_GAP_M = 75.0
"""Greatest gap wished: its band ends within sight."""
MOST_CHANGE_M = 35.0
"""Greatest change of a gap wished at once."""
OVER_SIGN_MPS = 5.0
"""Most a speed wished may exceed the sign. A free road starts at the sign, so every wish for more speed exceeds it;
LaMPilot's own go to 7 m/s."""
SLOWEST_MPS = 8.0
EXITS: dict[str, tuple[str, str, int]] = {
    "left": ("il1", "o1", 0),
    "straight": ("il2", "o2", 0),
    "right": ("il3", "o3", 0),
}
"""Lane by which the ego leaves LaMPilot's intersection."""


@dataclass(frozen=True, slots=True)
class Unfit:
    """Reason why a drawn road does not suit its kind, short enough for counting."""

    why: str


Drawer = Callable[[str, Observation, Generator], SceneWish | Unfit]


def _side_of(kind: str) -> str:
    return "right" if "right" in kind else "left"


def lead_of(start: Observation) -> Lead | Unfit:
    """The vehicle ahead within 100 m, or why there is none to speak of."""
    if start.front is None or start.front.distance_m >= SIGHT_M:
        return Unfit("nobody within 100 m ahead")
    if start.front.distance_m < CAR_M + 2.5:
        return Unfit("the vehicle ahead is on our bumper")
    return start.front


def sign_mps(start: Observation) -> float:
    """Speed limit of the ego's lane, m/s."""
    assert start.ego.lane is not None
    return start.road[start.ego.lane].speed_limit_mps


def _unit_of(kind: str) -> str:
    """Unit a kind's name ends with; the original's where it names none."""
    for unit, facts in UNITS.items():
        if facts.short and kind.endswith(f"_{facts.short}"):
            return unit
    return "m/s" if "speed" in kind else "m"


def between(rng: Generator, low_si: float, high_si: float, unit: str) -> Named | Unfit:
    """A whole number of a unit between two SI values; round ones where the unit is small (65 mph, 120 ft)."""
    size = UNITS[unit].si
    step = 5 if unit in ("km/h", "mph", "ft", "yd") and (high_si - low_si) / size > 10 else 1
    low, high = math.ceil(low_si / size / step), math.floor(high_si / size / step)
    if low > high:
        return Unfit("no number fits the gap or speed at the start")
    return Named(step * whole(rng, low, high), unit)


def distance_wish(kind: str, start: Observation, rng: Generator) -> SceneWish | Unfit:
    """A gap to be closed or opened, to a number of metres or by it; or why no such wish fits."""
    lead = lead_of(start)
    if isinstance(lead, Unfit):
        return lead
    now, closer, relative = lead.distance_m, kind.startswith("dec"), "_rel_" in kind
    # At the start the car stands outside the band it is to reach: a car that ignores the wish does not fulfil it.
    if closer:
        low, high = LEAST_GAP_M, now / (1 + TOLERANCE) - 0.5
    else:
        low, high = now / (1 - TOLERANCE) + 0.5, FARTHEST_GAP_M
    if closer and lead.speed_mps > sign_mps(start) - max(1.0, (now - low) / 30.0):
        return Unfit("the vehicle ahead drives at the limit: one cannot close up lawfully")
    unit = _unit_of(kind)
    if relative:
        least, most = (now - high, now - low) if closer else (low - now, high - now)
        named = between(rng, least, min(most, MOST_CHANGE_M), unit)
    else:
        named = between(rng, low, high, unit)
    if isinstance(named, Unfit):
        return named
    value = (-named.si if closer else named.si) if relative else named.si
    goal = {"type": "ACCEvalbyDistance", "rel_distance" if relative else "distance": plain(value)}
    return replace(one_goal(kind, goal, d=named), change=-1 if closer else 1)


def speed_wish(kind: str, start: Observation, rng: Generator) -> SceneWish | Unfit:
    """A speed to be driven, or more or less speed; or why no such wish fits."""
    now, slower, relative = start.ego.speed_mps, kind.startswith("dec"), "_rel_" in kind
    sign = sign_mps(start)
    low, high = (SLOWEST_MPS, now - 2.5) if slower else (now + 1.6, sign + OVER_SIGN_MPS)
    unit = _unit_of(kind)
    if relative:
        most = min(12.0, now - low)
        named = between(rng, 2.5, most, unit) if slower else between(rng, 2.0, high - now, unit)
    else:
        named = between(rng, low, high, unit)
    if isinstance(named, Unfit):
        return named
    target = named.si if not relative else now + (-named.si if slower else named.si)
    front = start.front
    if front is not None and front.distance_m < SIGHT_M and front.speed_mps < target + 1.0:
        return Unfit("behind somebody slower any speed wished counts as reached")
    value = (-named.si if slower else named.si) if relative else named.si
    goal = {"type": "ACCEvalbySpeed", "rel_speed" if relative else "speed": plain(value)}
    return replace(one_goal(kind, goal, v=named), change=-1 if slower else 1)


def lane_wish(kind: str, start: Observation, rng: Generator) -> SceneWish | Unfit:
    """The lane beside, on the side that the kind names."""
    del start, rng
    side = _side_of(kind)
    return one_goal(kind, {"type": "LaneChangeEval", "direction": side}, section="lane", side=side)


def overtake_wish(kind: str, start: Observation, rng: Generator) -> SceneWish | Unfit:
    """The vehicle ahead to be overtaken on the side that the kind names; or why it cannot be."""
    del rng
    lead = lead_of(start)
    if isinstance(lead, Unfit):
        return lead
    if lead.speed_mps > sign_mps(start) - 2.5:
        return Unfit("the vehicle ahead is too fast to be overtaken lawfully")
    side = _side_of(kind)
    return one_goal(kind, {"type": "OvertakeEval", "direction": side}, section="overtake", side=side)


def pull_over_wish(kind: str, start: Observation, rng: Generator) -> SceneWish | Unfit:
    """A halt on the emergency lane."""
    del kind, start, rng
    return one_goal("pull_over", {"type": "PullOverEval"})


def route_wish(kind: str, start: Observation, rng: Generator) -> SceneWish | Unfit:
    """The way over the intersection that the kind names."""
    del start, rng
    way = {"go_straight": "straight", "turn_left": "left", "turn_right": "right"}[kind]
    goal = {"type": "IntersectionEval", "direction": list(EXITS[way])}
    if way == "straight":
        return one_goal(kind, goal)
    return one_goal(kind, goal, section="turn", side=way)


def one_goal(kind: str, goal: dict[str, Any], section: str = "", **slots: str | Named) -> SceneWish:
    """A wish of one of the original's kinds: one goal, LaMPilot's own condition."""
    stem = kind
    for value in slots.values():
        if isinstance(value, Named):
            stem = f"{kind}{value.count}"
    name = section or kind.removesuffix(f"_{UNITS[_unit_of(kind)].short}")
    return SceneWish((name,), goal, goal, stem, tuple(slots.items()), means=(goal,))


def plain(value: float) -> float | int:
    """A number as a file writes it: whole ones without a point."""
    return int(value) if float(value).is_integer() else round(value, 6)
