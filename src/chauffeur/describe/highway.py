"""Situation descriptor of highway worlds: what a driver there would say of the road in two breaths."""

from __future__ import annotations

from chauffeur.concept import Context, Situation, Snapshot
from chauffeur.describe.road import (
    ego_lane,
    front_in_sight,
    front_sentence,
    limit_sentence,
    ordinal,
    own_direction,
    speed_sentence,
)


def describe_highway(snapshot: Snapshot) -> Context:
    """C of a highway snapshot.

    Only the ego's own lane is described beyond its speed: what drives in the other lanes a program has to ask the
    driving APIs for, as in the benchmark.

    Raises:
        ScenarioError: The ego is on no lane of the road.
    """
    lane = ego_lane(snapshot)
    lanes = own_direction(snapshot)
    index = lanes.index(lane)
    front = front_in_sight(snapshot)
    emergency = lanes[-1].emergency
    count = "1 lane" if len(lanes) == 1 else f"{len(lanes)} lanes"
    sentences = [
        speed_sentence(snapshot),
        f"I am on a highway with {count} in my direction, in the {ordinal(len(lanes) - index)} lane from the right.",
    ]
    if emergency:
        sentences.append("The right-most lane is an emergency lane.")
    sentences += [limit_sentence(lane), front_sentence(front)]
    return Context(
        text=" ".join(sentences),
        situation=Situation(
            world=snapshot.kind,
            speed_mps=snapshot.ego.speed_mps,
            speed_limit_mps=lane.speed_limit_mps,
            lane_count=len(lanes),
            lane_index=index,
            emergency_lane=emergency,
            front=front,
            stop_sign_m=snapshot.stop_sign_m,
        ),
    )
