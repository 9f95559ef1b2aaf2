"""Amenities of a lot: kinds of bays, roofs, and the places people walk to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from chauffeur.concept import ParkingLot, ParkingSpot, ScenarioError
from chauffeur.worlds.parking.lot import Lot, Spot, way_id

Bay = Literal["ev", "accessible", "family"]
Place = Literal["lift", "stairs", "machine"]


def amenities(
    lot: Lot,
    taken: frozenset[str],
    bays: Mapping[str, Bay],
    covered: frozenset[str],
    places: Mapping[Place, tuple[float, float]],
) -> ParkingLot:
    """The lot as somebody who looks for a spot sees it, in the world frame.

    Args:
        lot: The ground.
        taken: Names of the spots somebody stands in.
        bays: Spots that are kept for somebody.
        covered: Letters of the rows under a roof.
        places: Where people go, besides gate, exit and entrance: m to the east and to the south.

    Raises:
        ScenarioError: A bay or a row that the lot does not have.
    """
    rows = {name[0] for name in lot.spots}
    unknown = [name for name in bays if name not in lot.spots] + sorted(covered - rows)
    if unknown:
        raise ScenarioError(
            f"The lot has no {', '.join(unknown)}.", hint=f"Spots go from {min(lot.spots)} to {max(lot.spots)}."
        )
    entrance = lot.road[way_id("entrance", "n1")].centre.points_m[0]
    landmarks = {"gate": lot.gate_m, "exit": lot.exit_m, "entrance": entrance}
    return ParkingLot(
        tuple(_spot(lot, spot, taken, bays, covered) for spot in lot.spots.values()),
        (
            *((name, x, y) for name, (x, y) in landmarks.items()),
            *((name, east, -south) for name, (east, south) in places.items()),
        ),
    )


def _spot(lot: Lot, spot: Spot, taken: frozenset[str], bays: Mapping[str, Bay], covered: frozenset[str]) -> ParkingSpot:
    row, number = spot.name[0], int(spot.name[1:])
    beside = [f"{row}{number + step}" for step in (-1, 1)]
    box = spot.box
    return ParkingSpot(
        spot.name,
        box.x_m,
        box.y_m,
        box.heading_rad,
        spot.name not in taken,
        bays.get(spot.name, "plain"),
        row in covered,
        sum(name in taken for name in beside),
        any(name not in lot.spots for name in beside),
    )
