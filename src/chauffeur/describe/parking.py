"""Situation descriptor of parking lots: how fast, how many spots are free, who is ahead."""

from __future__ import annotations

import math
from dataclasses import replace

from chauffeur.concept import Context, Observation, ParkingLot, ParkingSpot, VehicleState
from chauffeur.describe.road import front_in_sight, situation_of, speed_sentence


def describe_parking(observation: Observation) -> Context:
    """C of an observation of a parking lot.

    Raises:
        ScenarioError: The ego is on no lane of the lot.
    """
    situation = situation_of(observation)
    front = front_in_sight(observation)
    ahead = (
        "Nobody is ahead of me in my aisle."
        if front is None
        else f"The car ahead of me is {front.distance_m:.1f} m away and drives at {front.speed_mps:.1f} m/s."
    )
    lot = None if observation.lot is None else _seen_from(observation.ego, observation.lot)
    sentences = [
        speed_sentence(observation),
        f"I am in a parking lot, where {situation.speed_limit_mps:.1f} m/s are allowed.",
        ahead,
        "I can park in the nearest free spot, near the stadium, near the exit, or in a spot by its name, such as A3.",
    ]
    return Context(" ".join(sentences), situation, lot)


def _seen_from(ego: VehicleState, lot: ParkingLot) -> ParkingLot:
    """A lot of the world frame in the ego's."""
    c, s = math.cos(ego.heading_rad), math.sin(ego.heading_rad)

    def at(x_m: float, y_m: float) -> tuple[float, float]:
        dx, dy = x_m - ego.x_m, y_m - ego.y_m
        return c * dx + s * dy, c * dy - s * dx

    spots: list[ParkingSpot] = []
    for spot in lot.spots:
        x, y = at(spot.x_m, spot.y_m)
        spots.append(replace(spot, x_m=x, y_m=y, heading_rad=spot.heading_rad - ego.heading_rad))
    return ParkingLot(tuple(spots), tuple((name, *at(x, y)) for name, x, y in lot.landmarks))
