"""Resolves the spot that is meant: by its name, or as near as can be to the car, to the stadium, or to the exit."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

from chauffeur.concept import ScenarioError
from chauffeur.geometry import Box, Pose
from chauffeur.worlds.parking.lot import Lot, Spot
from chauffeur.worlds.parking.routes import way_to_spot

PLACES: Final = ("nearest", "stadium", "exit")
"""Talk2Drive's three parking goals; a spot's own name is one as well."""
_STRAIGHT_RAD: Final = math.radians(5.0)
_STANDING_MPS: Final = 0.05


def spot_for(lot: Lot, free: Iterable[str], place: str, rear: Pose, wheelbase_m: float) -> Spot:
    """The free spot that is meant.

    Args:
        lot: The ground.
        free: Names of spots nobody stands in.
        place: One of `PLACES`, or the name of a spot.
        rear: The car's rear axle.
        wheelbase_m: The car's.

    Raises:
        ScenarioError: No such place, the spot is taken, or no way leads there from here.
    """
    names = frozenset(free)
    ways = {name: way for name in sorted(names) if (way := way_to_spot(lot, lot.spots[name], rear, wheelbase_m))}
    reachable = [lot.spots[name] for name in ways]
    word = place.strip()
    named = lot.spots.get(word.upper())
    if named is None and word.lower() not in PLACES:
        raise ScenarioError(
            f"There is no place {place!r} in this lot.",
            hint=f"Say {', '.join(PLACES)}, or a spot from A1 to {max(lot.spots)}.",
        )
    if named is not None and named.name not in names:
        raise ScenarioError(f"Spot {named.name} is taken.", hint=f"Free: {', '.join(sorted(names)) or 'none'}.")
    if not reachable or (named is not None and named.name not in ways):
        raise ScenarioError(
            f"No way leads from here to {place!r}: the lot is one-way.", hint="Ask for the exit, or for another spot."
        )
    if named is not None:
        return named
    if word.lower() == "stadium":
        return min(reachable, key=lambda spot: math.dist((spot.box.x_m, spot.box.y_m), lot.gate_m))
    if word.lower() == "exit":
        exit_x, exit_y = lot.exit_m
        return min(reachable, key=lambda spot: spot.box.x_m - exit_x + spot.box.y_m - exit_y)
    return min(reachable, key=lambda spot: ways[spot.name].path.length_m)


def parked_in(lot: Lot, car: Box, speed_mps: float) -> Spot | None:
    """The spot a car is parked in: it stands, all of it is between the lines, and it is straight within 5 degrees."""
    if abs(speed_mps) > _STANDING_MPS:
        return None
    for spot in lot.spots.values():
        if spot.box.holds(car.x_m, car.y_m):
            straight = abs(math.sin(car.heading_rad - spot.box.heading_rad)) <= math.sin(_STRAIGHT_RAD)
            return spot if straight and spot.box.contains(car) else None
    return None
