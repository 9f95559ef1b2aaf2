"""A command and the street ahead to a `Trajectory`: the masked-diffusion model writes its waypoints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from chauffeur.concept import Limits, Street, StreetWay, Trajectory
from chauffeur.geometry import Polyline
from chauffeur.planners.vilad.driving import (
    NONE,
    PERIOD_S,
    REACH_M,
    TEMPLATE,
    DriveGoal,
    asked_of_drive,
    features,
    goal,
    shifted_m,
    verified_drive,
    waypoints_of,
)
from chauffeur.planners.vilad.engine import ViladEngine
from chauffeur.planners.vilad.unmasking import Decided, Unmasking, unmask

Array = np.ndarray[Any, Any]

HOW_DRIVEN: Final = Unmasking(steps=10, tau=0.8)
"""Nineteen decisions, two a step at least; what is more certain than 0.8 is decided at once."""
DENSE_S: Final = 0.5
"""Period of the trajectory: the curve through the waypoints, as densely as a bend needs."""
_ALIGN_M: Final = 10.0
"""Way over which the car comes back to the middle of the lane that it starts beside."""


class WrittenDrive(NamedTuple):
    """The network's answer to a command.

    Attributes:
        values: Values of the template's slots, as they are driven.
        decided: How they were decided.
        raw: The pattern as the network wrote it, before it was verified.
        agreed: Whether it was driven as the network wrote it.
    """

    values: Mapping[str, str | int]
    decided: Decided
    raw: str
    agreed: bool


def write_drive(engine: ViladEngine, text: str, street: Street, how: Unmasking = HOW_DRIVEN) -> WrittenDrive:
    """Decide a drive: Algorithm 2, then what is driven is made to agree with what was understood."""
    scene = features(street)
    predict = engine.predict(text, scene)
    raw = unmask(predict, TEMPLATE.canvas, TEMPLATE.allowed(len(scene)), how)
    decided = verified_drive(predict, street, raw)
    TEMPLATE.validate(decided.row, candidates=len(scene))
    return WrittenDrive(TEMPLATE.decode(decided.row), decided, TEMPLATE.text(raw.row), decided is raw)


def trajectory_of(street: Street, values: Mapping[str, str | int], limits: Limits, limit_mps: float) -> Trajectory:
    """The trajectory of an answer, in the ego frame.

    Waypoints are places along a way; the car is where a smooth curve through them is at each moment, no faster than
    the limits allow.

    Args:
        street: What the answer points at.
        values: The answer; its way is one of the street's.
        limits: Bounds of the plan.
        limit_mps: Speed limit of the road.
    """
    way = street.ways[int(values["way"]) - 1]
    along, aside = waypoints_of(values)
    at = np.arange(len(along) + 1) * PERIOD_S
    knots = np.concatenate([[0.0], along])
    most = limits.most_mps(limit_mps)
    stretch = max(1.0, float(np.diff(knots).max()) / (PERIOD_S * most))
    times = np.arange(DENSE_S, at[-1] * stretch + DENSE_S / 2, DENSE_S)
    stations = _curve(at * stretch, knots, street.speed_mps / stretch, times)
    stations = np.minimum(np.maximum.accumulate(stations), along[-1])
    over = shifted_m(stations, float(along[-1]), aside)
    if aside and way.kerb_m is not None:
        over *= way.kerb_m / aside
    stands = np.flatnonzero(stations >= along[-1] - 1e-3)
    last = len(stations) if not len(stands) else min(len(stations), int(stands[0]) + 2)
    points = _placed(way, stations[:last], over[:last])
    return Trajectory(tuple((round(float(x), 3), round(float(y), 3)) for x, y in points), DENSE_S)


def _curve(at: Array, knots: Array, speed: float, times: Array) -> Array:
    """Monotone cubic interpolation (Fritsch and Carlson 1980) that starts at a speed and ends at a stand."""
    step, rise = np.diff(at), np.diff(knots) / np.diff(at)
    slope = np.zeros(len(at))
    slope[0] = min(speed, 3.0 * rise[0])
    for i in range(1, len(at) - 1):
        if rise[i - 1] > 0.0 and rise[i] > 0.0:
            w0, w1 = 2.0 * step[i] + step[i - 1], step[i] + 2.0 * step[i - 1]
            slope[i] = (w0 + w1) / (w0 / rise[i - 1] + w1 / rise[i])
    place = np.clip(np.searchsorted(at, times, side="right") - 1, 0, len(step) - 1)
    u = np.clip((times - at[place]) / step[place], 0.0, 1.0)
    h00, h10 = (1.0 + 2.0 * u) * (1.0 - u) ** 2, u * (1.0 - u) ** 2
    h01, h11 = u**2 * (3.0 - 2.0 * u), u**2 * (u - 1.0)
    return (
        h00 * knots[place]
        + h10 * step[place] * slope[place]
        + h01 * knots[place + 1]
        + h11 * step[place] * slope[place + 1]
    )


def _placed(way: StreetWay, stations: Array, over_m: Array) -> Array:
    """Points (n, 2) in the ego frame beside a way; from where the car is now over to the way's own middle."""
    line = Polyline.of(way.path_m)
    x, y, heading = line.poses(np.minimum(stations, line.length_m))
    x0, y0 = way.path_m[0]
    beside = -math.sin(float(heading[0])) * x0 + math.cos(float(heading[0])) * y0
    share = np.clip(stations / _ALIGN_M, 0.0, 1.0)
    right = over_m + beside * (1.0 - share**2 * (3.0 - 2.0 * share))
    return np.stack([x + np.sin(heading) * right, y - np.cos(heading) * right], axis=1)


_TURNED: Final = {"left": "turn left", "right": "turn right", "straight": "go straight on"}
_MARKED: Final = {
    "crosswalk": "the crosswalk", "junction": "the junction", "cones": "the cones", "vehicle": "the parked car",
}  # fmt: skip
_PLACED: Final = {"before": "before", "after": "past", "beside": "beside"}
_PACED: Final = {"slow": "slowly", "brisk": "briskly"}


def understood_in_words(asked: Mapping[str, str]) -> str:
    """The criteria as an infinitive: "turn left and stop before the crosswalk"."""
    parts = [_TURNED[asked["turn"]]] if asked["turn"] != NONE else []
    if asked["halt"] != NONE:
        said = "pull over to the kerb" if asked["halt"] == "kerb" else "stop"
        if asked["mark"] != NONE:
            said += f" {_PLACED.get(asked['place'], 'before')} {_MARKED[asked['mark']]}"
        elif asked["metres"] != NONE:
            said += f" after {asked['metres']} metres"
        parts.append(said)
    words = " and ".join(parts) or "go on along the road"
    return f"{words}, {_PACED[asked['pace']]}" if asked["pace"] != NONE else words


def intent_of(asked: Mapping[str, str]) -> str:
    """Short tag of what was understood."""
    parts = [f"turn.{asked['turn']}"] if asked["turn"] in ("left", "right") else []
    parts += ["pull_over" if asked["halt"] == "kerb" else "stop"] if asked["halt"] != NONE else []
    return "+".join(parts) or "go"


def drive_words(street: Street, values: Mapping[str, str | int]) -> str:
    """R: what was understood, and what is driven for it."""
    asked = asked_of_drive(values)
    found = goal(street, asked)
    along, _ = waypoints_of(values)
    said = f"You want me to {understood_in_words(asked)}."
    if isinstance(found, DriveGoal) and not found.halts:
        return f"{said} I drive {along[-1]:.0f} m; nothing was said of what comes then, so I stop there."
    where = "at the kerb" if isinstance(found, DriveGoal) and found.kerb else "in the lane"
    return f"{said} I stop {where} after {along[-1]:.0f} m."


def refusal_of(street: Street, values: Mapping[str, str | int]) -> str:
    """The reason for driving nothing, a sentence."""
    asked = asked_of_drive(values)
    found = goal(street, asked)
    why = found if isinstance(found, str) else f"I find no way to do that within {REACH_M:.0f} m"
    return f"You want me to {understood_in_words(asked)}, but {why}."
