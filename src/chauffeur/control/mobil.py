"""MOBIL: when a lane change pays and is safe.

Source: Kesting, Treiber, Helbing, "General lane-changing model MOBIL for car-following models", TRR 1999, 2007.
Default parameters are those of LaMPilot's MOBIL baseline.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class MobilParameters:
    """MOBIL parameters.

    Attributes:
        politeness: Weight p of the new follower's loss.
        safe_deceleration_mps2: Largest braking b_safe that may be imposed on the new follower.
        threshold_mps2: Gain a_thr below which changing is not worth it.
    """

    politeness: float = 0.2
    safe_deceleration_mps2: float = 10.0
    threshold_mps2: float = 0.1


@dataclass(frozen=True, slots=True)
class LaneChangeOutlook:
    """Accelerations, m/s2, of the two vehicles concerned, now and after the change.

    The follower's are None where the target lane has no vehicle behind.
    """

    own_now: float
    own_after: float
    follower_now: float | None
    follower_after: float | None


def should_change(outlook: LaneChangeOutlook, parameters: MobilParameters) -> bool:
    """True if the change is safe for the new follower and worth it."""
    loss = 0.0
    if outlook.follower_now is not None and outlook.follower_after is not None:
        if outlook.follower_after <= -parameters.safe_deceleration_mps2:
            return False
        loss = outlook.follower_now - outlook.follower_after
    gain = outlook.own_after - outlook.own_now
    return gain > parameters.politeness * loss + parameters.threshold_mps2
