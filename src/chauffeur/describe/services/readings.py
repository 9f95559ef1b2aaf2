"""What a service told: a value with unit, source, age and confidence; or why it is not known."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

from chauffeur.concept import ConfigError

T_co = TypeVar("T_co", covariant=True)

EARTH_M: Final = 6_371_008.8
"""Mean radius of the earth (IUGG)."""
M_PER_DEG: Final = EARTH_M * math.pi / 180.0
"""Length of a degree of latitude."""
MAX_LATITUDE_DEG: Final = 85.0
"""Nearer to the poles there are no roads, and a degree of longitude has no length to speak of."""


@dataclass(frozen=True, slots=True)
class Position:
    """Where the car is on the earth (WGS 84).

    Attributes:
        latitude_deg: Northern latitude.
        longitude_deg: Eastern longitude.
        heading_deg: Compass heading of the car, 0 is north and 90 is east; None where it is not known.
        accuracy_m: Standard deviation of the position.
    """

    latitude_deg: float
    longitude_deg: float
    heading_deg: float | None = None
    accuracy_m: float = 5.0

    def __post_init__(self) -> None:
        if not (abs(self.latitude_deg) <= 90.0 and abs(self.longitude_deg) <= 180.0):
            raise ConfigError(
                f"{self.latitude_deg:g},{self.longitude_deg:g} is not a position.",
                hint="Give latitude (-90 to 90) and longitude (-180 to 180) in degrees, e.g. 48.137,11.575.",
            )
        if self.heading_deg is not None and not math.isfinite(self.heading_deg):
            raise ConfigError(f"{self.heading_deg} is not a heading.", hint="Give degrees: 0 is north, 90 is east.")
        if not 0.0 < self.accuracy_m < 1_000.0:
            raise ConfigError(
                f"An accuracy of {self.accuracy_m:g} m cannot be used.", hint="Give metres, above 0 and below 1000."
            )

    def rounded(self, decimals: int) -> tuple[float, float]:
        """(latitude, longitude) with so many decimals: three are steps of about 100 m."""
        return round(self.latitude_deg, decimals) + 0.0, round(self.longitude_deg, decimals) + 0.0


def distance_m(one: Position, other: Position) -> float:
    """Great-circle distance (haversine)."""
    lat, other_lat = math.radians(one.latitude_deg), math.radians(other.latitude_deg)
    across = math.sin(math.radians(other.longitude_deg - one.longitude_deg) / 2.0) ** 2
    chord = math.sin((other_lat - lat) / 2.0) ** 2 + math.cos(lat) * math.cos(other_lat) * across
    return 2.0 * EARTH_M * math.asin(min(1.0, math.sqrt(chord)))


@dataclass(frozen=True, slots=True)
class ServiceReading(Generic[T_co]):
    """A value that somebody told.

    Attributes:
        value: What was told; its own names say the units where it has several numbers.
        unit: Unit of a value that is one number, else empty.
        source: Who told it.
        age_s: How long ago it was so; None where nobody said.
        confidence: 0 to 1.
        note: Why it is older or less sure than it should be, in our words; empty when nothing is wrong.
    """

    value: T_co
    unit: str
    source: str
    age_s: float | None
    confidence: float
    note: str = ""


@dataclass(frozen=True, slots=True)
class Unknown:
    """A value that is not known.

    Attributes:
        reason: Why, in our words: nothing that a service wrote stands in it.
    """

    reason: str
