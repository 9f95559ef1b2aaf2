"""Where trips begin: what every process of a drive is told, so that all of them know the same road."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from chauffeur.concept import Limits, Scenario

MOST_TRIP_S: Final = 60.0


@dataclass(frozen=True, slots=True)
class Start:
    """A trip.

    Attributes:
        scenario: Where.
        seed: Of its traffic.
        limits: No plan may cross them.
        most_s: Bound of the trip in vehicle time.
    """

    scenario: Scenario
    seed: int
    limits: Limits = field(default_factory=Limits)
    most_s: float = MOST_TRIP_S
