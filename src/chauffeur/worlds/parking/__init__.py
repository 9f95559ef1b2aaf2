"""A parking lot: one-way aisles, slanted spots, parked cars, a car on its way out, people on foot."""

from chauffeur.geometry import overlap
from chauffeur.worlds.parking.places import PLACES
from chauffeur.worlds.parking.referee import ParkingReferee
from chauffeur.worlds.parking.scenarios import BUILT_IN
from chauffeur.worlds.parking.world import ParkingWorld

__all__ = [
    "BUILT_IN",
    "PLACES",
    "ParkingReferee",
    "ParkingWorld",
    "overlap",
]
