"""What a world says it can do, so that nobody has to know it by its name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

PolicyKind = Literal["program", "parameters", "trajectory", "action_matrix"]


@dataclass(frozen=True, slots=True)
class Capabilities:
    """What differs from world to world. What differs from road to road is asked of the road graph.

    Attributes:
        roads: What `Observation.kind` may be: the words that its situation is described in.
        policies: Kinds of policy that lead to what trips in it are for, the most apt first.
        lane_changes: Whether it has lanes abreast to change between.
        turns: Whether it has junctions where ways part.
        stop_signs: Whether it has signs to stop at.
        places: Whether a trip may lead to a place by its name: a spot of a lot.
        horizon_s: When a trip has gone on for too long, simulated time.
    """

    roads: tuple[str, ...]
    policies: tuple[PolicyKind, ...]
    lane_changes: bool = False
    turns: bool = False
    stop_signs: bool = False
    places: bool = False
    horizon_s: float = 60.0
