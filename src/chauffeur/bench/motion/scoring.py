"""Command alignment (paper Eq. 27), scenario alignment, and the driving score (Eq. 26) with weights of our own.

The paper prints neither the ranges of Eq. 27 nor the weights of Eq. 26; ours are in `data/motion/styles.json` and
below. Each sub-score of a drive is Eq. 19 for the time to collision and Eq. 20 for the rest, against fixed gains in the
same scene; one that does not apply leaves its weight to the others.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import fmean, pvariance
from typing import Final

from chauffeur.bench.personalization.scoring import ScoreWeights
from chauffeur.concept import ActionMatrix, Frame, Observation, ScenarioError, VehicleState
from chauffeur.geometry import Box, overlap
from chauffeur.safety.gain_box import gain_box, values_of

SCORE_VERSION: Final = "motion-score-v1"
LATENCY_S: Final = 1.98
"""Latency held against: the slowest of the paper's on-board model (Tab. XI)."""

_CLOSING_MPS: Final = 0.1
_LOOK_S: Final = 10.0
_EVERY_S: Final = 0.02

WEIGHTS: Final[Mapping[str, Mapping[str, float]]] = {
    "acceleration": {
        "ttc": 0.15, "speed_variance_x": 0.10, "speed_variance_y": 0.05, "acceleration_x": 0.10, "jerk_x": 0.15,
        "acceleration_y": 0.05, "jerk_y": 0.05, "latency": 0.10, "command": 0.15, "scenario": 0.10,
    },
    "lane_change": {
        "ttc": 0.15, "speed_variance_x": 0.05, "speed_variance_y": 0.10, "acceleration_x": 0.05, "jerk_x": 0.05,
        "acceleration_y": 0.10, "jerk_y": 0.15, "latency": 0.10, "command": 0.15, "scenario": 0.10,
    },
    "left_turn": {
        "ttc": 0.05, "speed_variance_x": 0.05, "speed_variance_y": 0.10, "acceleration_x": 0.05, "jerk_x": 0.05,
        "acceleration_y": 0.15, "jerk_y": 0.20, "latency": 0.10, "command": 0.15, "scenario": 0.10,
    },
}  # fmt: skip
"""Longitudinal measures weigh more in the acceleration, lateral ones in the turn, as the paper says of its own."""


@dataclass(frozen=True, slots=True)
class MotionStatistics:
    """Measures of a drive; x is along the car, y across it (Tab. XI).

    Attributes:
        min_ttc_s: Smallest time to collision on present courses, up to 10 s; None where all missed each other.
        speed_variance_x, speed_variance_y: m2/s2.
        acceleration_x, acceleration_y: Mean of the size, m/s2.
        jerk_x, jerk_y: Mean of the size, m/s3.
    """

    min_ttc_s: float | None
    speed_variance_x: float
    speed_variance_y: float
    acceleration_x: float
    acceleration_y: float
    jerk_x: float
    jerk_y: float


def measured(frames: Sequence[Frame], dt_s: float) -> MotionStatistics:
    """Measure a drive. Raises ScenarioError: it has fewer than four control periods."""
    if len(frames) < 4:
        raise ScenarioError(
            "A drive of less than four control periods cannot be measured.", hint="Let it drive longer."
        )
    shots = [frame.observation for frame in frames]
    egos = [shot.ego for shot in shots]
    across = [
        (-math.sin(a.heading_rad) * (b.x_m - a.x_m) + math.cos(a.heading_rad) * (b.y_m - a.y_m)) / dt_s
        for a, b in pairwise(egos)
    ]
    along = [ego.acceleration_mps2 for ego in egos]
    sideways = [ego.speed_mps * ego.yaw_rate_radps for ego in egos]
    return MotionStatistics(
        min_ttc_s=min((ttc for shot in shots if (ttc := _ttc_s(shot)) is not None), default=None),
        speed_variance_x=pvariance([ego.speed_mps for ego in egos]),
        speed_variance_y=pvariance(across),
        acceleration_x=fmean(map(abs, along)),
        acceleration_y=fmean(map(abs, sideways)),
        jerk_x=_jerk(along, dt_s),
        jerk_y=_jerk(sideways, dt_s),
    )


def _jerk(values: Sequence[float], dt_s: float) -> float:
    return fmean(abs(after - before) / dt_s for before, after in pairwise(values))


def _ttc_s(shot: Observation) -> float | None:
    """Time until the ego would touch somebody if both kept speed and heading, s; None where they miss each other.

    Courses are compared rather than lanes: a car that changes lanes is in its old one when it has long steered clear.
    """
    return min((t for other in shot.others if (t := _meet_s(shot.ego, other)) is not None), default=None)


def _meet_s(ego: VehicleState, other: VehicleState) -> float | None:
    reach = math.hypot(ego.length_m, ego.width_m) / 2.0 + math.hypot(other.length_m, other.width_m) / 2.0
    vx = other.speed_mps * math.cos(other.heading_rad) - ego.speed_mps * math.cos(ego.heading_rad)
    vy = other.speed_mps * math.sin(other.heading_rad) - ego.speed_mps * math.sin(ego.heading_rad)
    closing = math.hypot(vx, vy)
    if closing < _CLOSING_MPS:
        return None
    far = math.dist((ego.x_m, ego.y_m), (other.x_m, other.y_m))
    first, own = max(0.0, far - reach) / closing, ego.box
    for i in range(math.ceil(_LOOK_S / _EVERY_S)):
        t = first + i * _EVERY_S
        if t > _LOOK_S or t * closing > far + reach:
            return None
        if overlap(own, Box(other.x_m + vx * t, other.y_m + vy * t, other.heading_rad, other.length_m, other.width_m)):
            return t
    return None


def parameter_score(value: float, least: float, lower: float, upper: float, most: float) -> float:
    """Eq. 27 for one parameter: 100 within the style's range, falling to 0 at the ends of the overall one.

    Ends belong to the range, and where a style's range begins or ends with the overall one, nothing lies beyond.
    """
    if lower <= value <= upper:
        return 100.0
    if least <= value < lower:
        return 100.0 * (value - least) / (lower - least)
    if upper < value <= most:
        return 100.0 * (most - value) / (most - upper)
    return 0.0


def command_alignment(policy: ActionMatrix, ranges: Mapping[str, tuple[float, float]]) -> float:
    """Eq. 27 averaged over the six parameters, against the ranges of the style that was meant; points."""
    box = gain_box()
    scores: list[float] = []
    for name, value in values_of(policy).items():
        shown = name.capitalize()
        low, high = box.low[shown], box.high[shown]
        lower, upper = (min(max(end, low), high) for end in ranges[name])
        scores.append(parameter_score(value, low, lower, upper, high))
    return fmean(scores)


def driving_score(
    manoeuvre: str,
    drive: MotionStatistics,
    baseline: MotionStatistics,
    latency_s: float | None,
    command: float,
    scenario: float | None,
) -> float:
    """Eq. 26, points.

    Args:
        manoeuvre: Which weights.
        drive: What was measured.
        baseline: The same with fixed gains in the same scene.
        latency_s: Wish in, gains out; None where nothing is computed.
        command: Command alignment.
        scenario: Scenario alignment of this drive; None in sunshine.
    """
    table = ScoreWeights()
    parts: dict[str, float | None] = {
        "ttc": None
        if drive.min_ttc_s is None and baseline.min_ttc_s is None
        else 100.0
        if drive.min_ttc_s is None or drive.min_ttc_s >= table.critical_ttc_s
        else 0.0,
        "latency": 100.0 if latency_s is None else 100.0 - table.sensitivity * latency_s / LATENCY_S,
        "command": command,
        "scenario": scenario,
    }
    for name in (
        "speed_variance_x", "speed_variance_y", "acceleration_x", "acceleration_y", "jerk_x", "jerk_y",
    ):  # fmt: skip
        against = float(getattr(baseline, name))
        parts[name] = 100.0 - table.sensitivity * float(getattr(drive, name)) / against if against > 0.0 else None
    weights = WEIGHTS[manoeuvre]
    held = [(weights[name], min(max(part, 0.0), 100.0)) for name, part in parts.items() if part is not None]
    return sum(weight * part for weight, part in held) / sum(weight for weight, _ in held)
