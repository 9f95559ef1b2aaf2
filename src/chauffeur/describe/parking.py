"""Situation descriptor of parking lots: how fast, how many spots are free, who is ahead."""

from __future__ import annotations

from chauffeur.concept import Context, Snapshot
from chauffeur.describe.road import front_in_sight, situation_of, speed_sentence


def describe_parking(snapshot: Snapshot) -> Context:
    """C of a snapshot of a parking lot.

    Raises:
        ScenarioError: The ego is on no lane of the lot.
    """
    situation = situation_of(snapshot)
    front = front_in_sight(snapshot)
    ahead = (
        "Nobody is ahead of me in my aisle."
        if front is None
        else f"The car ahead of me is {front.distance_m:.1f} m away and drives at {front.speed_mps:.1f} m/s."
    )
    sentences = [
        speed_sentence(snapshot),
        f"I am in a parking lot, where {situation.speed_limit_mps:.1f} m/s are allowed.",
        ahead,
        "I can park in the nearest free spot, near the stadium, near the exit, or in a spot by its name, such as A3.",
    ]
    return Context(text=" ".join(sentences), situation=situation)
