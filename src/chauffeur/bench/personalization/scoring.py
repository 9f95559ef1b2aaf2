"""Talk2Drive's driving score (paper Eq. 18 to 20, Tab. VIII): safety and comfort of a drive, against human drivers.

Each sub-score is 100 for a drive that has none of what it measures and falls with the drive's share of the baseline's
value; a smallest time to collision below 1.5 s scores 0 for safety. The paper prints neither the weights nor the
sensitivity; least squares over the twenty rows of Tab. VIII give, rounded, the values below, which reproduce every
printed score within 0.12: as near as the printed inputs, rounded themselves, allow. (The paper's text says that a time
to collision above the threshold scores zero; Eq. 19 and the table say 100.)
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import fmean, pvariance
from typing import Final

from chauffeur.concept import ScenarioError

SCORE_VERSION: Final = "talk2drive-score-v1"


@dataclass(frozen=True, slots=True)
class TripStatistics:
    """Measures of a drive.

    Attributes:
        min_ttc_s: Smallest time to collision; None where nobody was ever closed in on.
        speed_variance: Population variance of the speed, m2/s2.
        mean_abs_acceleration_mps2: Mean of |a|.
        mean_abs_jerk_mps3: Mean of |da/dt|.
    """

    min_ttc_s: float | None
    speed_variance: float
    mean_abs_acceleration_mps2: float
    mean_abs_jerk_mps3: float


@dataclass(frozen=True, slots=True)
class ScoreWeights:
    """Weights of the sub-scores (they sum to 1), sensitivity, and the critical time to collision.

    Only the products of weight and sensitivity can be recovered from the table; one sensitivity for all three is the
    assumption under which the weights sum to 1.
    """

    ttc: float = 0.30
    speed_variance: float = 0.20
    acceleration: float = 0.25
    jerk: float = 0.25
    sensitivity: float = 20.0
    critical_ttc_s: float = 1.5


@dataclass(frozen=True, slots=True)
class DrivingScore:
    """The score and its parts, each 100 at best; a part is negative when a drive is much rougher than the baseline."""

    total: float
    ttc: float
    speed_variance: float
    acceleration: float
    jerk: float


def driving_score(drive: TripStatistics, baseline: TripStatistics, weights: ScoreWeights | None = None) -> DrivingScore:
    """Score a drive (Eq. 18).

    Args:
        drive: What was measured of it.
        baseline: The same of human drivers who did the same thing (`overtake`, `yield`, ...).
        weights: Default those recovered from Tab. VIII.

    Raises:
        ScenarioError: The baseline has no variance, acceleration or jerk: nothing can be held against it.
    """
    table = ScoreWeights() if weights is None else weights
    safe = drive.min_ttc_s is None or drive.min_ttc_s >= table.critical_ttc_s
    parts = DrivingScore(
        total=0.0,
        ttc=100.0 if safe else 0.0,
        speed_variance=_share(drive.speed_variance, baseline.speed_variance, table, "speed variance"),
        acceleration=_share(
            drive.mean_abs_acceleration_mps2, baseline.mean_abs_acceleration_mps2, table, "acceleration"
        ),
        jerk=_share(drive.mean_abs_jerk_mps3, baseline.mean_abs_jerk_mps3, table, "jerk"),
    )
    total = (
        table.ttc * parts.ttc
        + table.speed_variance * parts.speed_variance
        + table.acceleration * parts.acceleration
        + table.jerk * parts.jerk
    )
    return DrivingScore(total, parts.ttc, parts.speed_variance, parts.acceleration, parts.jerk)


def _share(value: float, baseline: float, weights: ScoreWeights, what: str) -> float:
    """Eq. 20."""
    if not (math.isfinite(baseline) and baseline > 0.0):
        raise ScenarioError(
            f"The baseline's {what} is {baseline:g}: a score relative to it means nothing.",
            hint="Take a baseline drive in which the car moves.",
        )
    return 100.0 - weights.sensitivity * value / baseline


def statistics_of(
    speeds_mps: Sequence[float], accelerations_mps2: Sequence[float], ttc_s: Iterable[float | None], dt_s: float
) -> TripStatistics:
    """Measure a drive.

    Args:
        speeds_mps: Speed of the ego in each control period.
        accelerations_mps2: Acceleration that was really applied in each.
        ttc_s: Time to collision with whoever is ahead in each; None where the gap does not close.
        dt_s: Control period.

    Raises:
        ScenarioError: There are fewer than two periods.
    """
    if len(speeds_mps) < 2 or len(accelerations_mps2) < 2:
        raise ScenarioError("A drive of less than two control periods cannot be scored.", hint="Let it drive longer.")
    jerks = [abs(after - before) / dt_s for before, after in pairwise(accelerations_mps2)]
    return TripStatistics(
        min_ttc_s=min((each for each in ttc_s if each is not None), default=None),
        speed_variance=pvariance(speeds_mps),
        mean_abs_acceleration_mps2=fmean(map(abs, accelerations_mps2)),
        mean_abs_jerk_mps3=fmean(jerks),
    )
