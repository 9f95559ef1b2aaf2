"""Fallback set-points after a policy failure: the same for a program that died and for one not heard of."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from chauffeur.concept import LaneId, Setpoints

FALLBACK_HEADWAY_S: Final = 2.0
"""Time headway of the fallback: the two seconds of driving schools."""
MINIMAL_RISK_BRAKING_MPS2: Final = 4.0
"""How hard the minimal-risk manoeuvre brakes on a free road: the most of UN Regulation No. 157, 5.5.1."""


def keep_lane_and_gap(setpoints: Setpoints, speed_mps: float, lane: LaneId | None) -> Setpoints:
    """Stay in a lane, at a speed, with a generous gap; routes are kept.

    Args:
        setpoints: The last ones.
        speed_mps: Highest speed from now on.
        lane: The one the car is in.
    """
    return replace(
        setpoints,
        target_speed_mps=speed_mps,
        time_headway_s=max(FALLBACK_HEADWAY_S, setpoints.time_headway_s),
        target_lane=lane,
    )
