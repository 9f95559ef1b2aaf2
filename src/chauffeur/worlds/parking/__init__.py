"""A parking lot: one-way aisles, slanted spots, parked cars, a car on its way out, people on foot."""

from chauffeur.geometry import Box, overlap
from chauffeur.worlds.parking.driver import ParkingDriver
from chauffeur.worlds.parking.lot import Lot, Spot
from chauffeur.worlds.parking.perception import ParkingPerception
from chauffeur.worlds.parking.places import PLACES
from chauffeur.worlds.parking.referee import ParkingReferee
from chauffeur.worlds.parking.scenarios import BUILT_IN
from chauffeur.worlds.parking.world import ParkingWorld
from chauffeur.worlds.path_follower import Chassis, Follower, Look

__all__ = [
    "BUILT_IN",
    "PLACES",
    "Box",
    "Chassis",
    "Follower",
    "Look",
    "Lot",
    "ParkingDriver",
    "ParkingPerception",
    "ParkingReferee",
    "ParkingWorld",
    "Spot",
    "overlap",
]
