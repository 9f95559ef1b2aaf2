"""The two rulers of LaMPilot-Bench: how the signals of a drive become points.

`origin` is what LaMPilot's code computes, the ruler of all published rows. `paper` is paper Eq. 1-8 as printed. They
differ in more than rounding (docs/rulers.md lists every place), so a table is under one of them, and its
id says which.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from chauffeur.concept import STOPPED_MPS, ConfigError, Metric

Row = dict[str, Any]

TTC_SAFE_S = 2.0
SPEED_STD_FULL_MPS = 10.0
"""sigma_safe of paper Eq. 6; the paper gives no number, this is LaMPilot's."""
TIME_LIMIT_S = 60.0
"""T_limit of paper Eq. 7; the paper gives no number, this is LaMPilot's."""
WEIGHTS = {"ttc": 0.5, "speed_variance": 0.3, "time_efficiency": 0.2}
COLLISION_WEIGHT = 500.0
ANY_STOP_M = math.inf
"""How far before its sign a stop serves it: LaMPilot lets a car go on from wherever it stands."""


@dataclass(frozen=True, slots=True)
class Ruler:
    """One way to score.

    Attributes:
        id: Versioned; changes whenever the same signals could give other points.
        title: For people.
        ttc: Signal that the TTC score reads.
        ttc_floor: Least TTC score.
        floored: Whether the other two scores stop at 0.
        off_road_collides: Whether leaving the road is a collision.
        collision_weight: Points taken off the driving score per collision and item.
        within_limit: Whether a success must come within the time limit and without collision.
    """

    id: str
    title: str
    ttc: str
    ttc_floor: float
    floored: bool
    off_road_collides: bool
    collision_weight: float
    within_limit: bool


ORIGIN = Ruler("lampilot-origin-v1", "LaMPilot's code", "ttc_along_s", -100.0, False, True, COLLISION_WEIGHT, False)
PAPER = Ruler("lampilot-paper-v1", "paper Eq. 1-8 as printed", "ttc_plane_s", 0.0, True, False, 0.0, True)
RULERS = {"origin": ORIGIN.id, "paper": PAPER.id}
_BY_ID = {ruler.id: ruler for ruler in (ORIGIN, PAPER)}


def ruler_named(name: str) -> Ruler:
    """Ruler by short name or id. Raises ConfigError for an unknown one."""
    ruler = _BY_ID.get(RULERS.get(name, name))
    if ruler is None:
        raise ConfigError(f"Unknown ruler {name!r}.", hint=f"Use one of: {', '.join(RULERS)}.")
    return ruler


def points(rollout: Row, ruler_id: str) -> Row:
    """A drive under a ruler.

    Args:
        rollout: A row with `success` (LaMPilot's flag, False for a policy that failed) and `signals` (None if nothing
            was driven).
        ruler_id: Id or short name of the ruler.

    Returns:
        `success`, `collision`, the parts `ttc`, `speed_variance`, `time_efficiency` (None where they do not apply:
        nothing was driven), `score`, and what no ruler counts: `lane_ttc_s`, `stop`, `fault`.
    """
    ruler = ruler_named(ruler_id)
    signals: Row | None = rollout.get("signals")
    if signals is None:
        parts: Row = {"ttc": None, "speed_variance": None, "time_efficiency": None}
        beside: Row = {"lane_ttc_s": None, "stop": "", "fault": ""}
        return {"metrics": ruler.id, "success": False, "collision": False, **parts, "score": 0.0, **beside}
    success = bool(rollout["success"])
    duration_s = signals["steps"] / 10
    if ruler.within_limit:
        success = success and not signals["crashed"] and duration_s <= TIME_LIMIT_S
    parts = {
        "ttc": _ttc_points(signals[ruler.ttc], ruler),
        "speed_variance": _floor(100.0 * (1.0 - signals["speed_std_mps"] / SPEED_STD_FULL_MPS), ruler),
        "time_efficiency": _floor(100.0 * (1.0 - duration_s / TIME_LIMIT_S), ruler),
    }
    stop_speed = signals["stop_speed_mps"]
    return {
        "metrics": ruler.id,
        "success": success,
        "collision": bool(signals["crashed"] or (ruler.off_road_collides and signals["off_road"])),
        **parts,
        "score": max(0.0, sum(parts[name] * weight for name, weight in WEIGHTS.items())) if success else 0.0,
        "lane_ttc_s": signals["ttc_lane_s"],
        "stop": "" if stop_speed is None else "stopped" if stop_speed < STOPPED_MPS else "rolled",
        "fault": signals["fault"],
    }


def _ttc_points(least_s: float | None, ruler: Ruler) -> float:
    """100 without a conflict closer than 2 s, else 100 - 1/TTC, not below the ruler's floor (paper Eq. 3)."""
    if least_s is None or least_s > TTC_SAFE_S:
        return 100.0
    return max(100.0 - 1.0 / least_s, ruler.ttc_floor)


def _floor(value: float, ruler: Ruler) -> float:
    return max(0.0, value) if ruler.floored else value


def metrics_of(rollout: Row, ruler: Ruler = ORIGIN) -> tuple[Metric, ...]:
    """A drive's points as metrics of a trip; the three parts apply to successes only, as LaMPilot averages them."""
    scored = points(rollout, ruler.id)
    prefix, version = ruler.id.rsplit("-", 1)
    prefix = "lampilot" if ruler is ORIGIN else prefix
    parts = (("ttc", "ttc"), ("speed_variance", "speed-variance"), ("time_efficiency", "time-efficiency"))
    found = [
        Metric(f"{prefix}-{name}-{version}", scored[key] or 0.0, "points", scored["success"]) for key, name in parts
    ]
    return (*found, Metric(f"{prefix}-score-{version}", scored["score"], "points"))


def driving_score(completion: float, mean_score_of_successes: float, collision: float, ruler: Ruler = ORIGIN) -> float:
    """Aggregate: completion x mean score of successes - weight x collision rate; rates in 0..1.

    The paper prints no aggregate; under `paper` it is the mean score over all items, those not completed counting 0.
    """
    return completion * mean_score_of_successes - ruler.collision_weight * collision
