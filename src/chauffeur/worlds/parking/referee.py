"""Judge of a parking trip: success is to stand in the spot that was meant, between its lines."""

from __future__ import annotations

import math

from chauffeur.concept import Metric
from chauffeur.geometry import wrap_to_pi
from chauffeur.worlds.parking.lot import Spot
from chauffeur.worlds.parking.world import ParkingWorld
from chauffeur.worlds.skeleton import PlaceJudge


class ParkingReferee(PlaceJudge):
    """Looks at a lot after each control period."""

    def __init__(self, world: ParkingWorld, spot: Spot) -> None:
        """Args: the world, just reset; the spot that is meant."""
        self._world = world
        self._spot = spot
        self._parked: str | None = None

    def observe(self) -> None:
        """Look at the instant after a control period."""
        self._parked = self._world.parked()

    @property
    def over(self) -> bool:
        """True if the car has parked, wherever."""
        return self._parked is not None

    @property
    def success(self) -> bool:
        """True if it has parked where it was meant to."""
        return self._parked == self._spot.name

    def metrics(self) -> tuple[Metric, ...]:
        """Offsets from the middle of the spot across and along it, heading error, and time."""
        observation, box = self._world.observe(), self._spot.box
        along, across = box.place_of(observation.ego.x_m, observation.ego.y_m)
        turned = abs(wrap_to_pi(observation.ego.heading_rad - box.heading_rad))
        return (
            Metric("parking-success-v1", float(self.success), "points"),
            Metric("parking-across-v1", abs(across), "m", applies=self.success),
            Metric("parking-along-v1", abs(along), "m", applies=self.success),
            Metric("parking-straight-v1", math.degrees(turned), "deg", applies=self.success),
            Metric("parking-time-v1", observation.time_s, "s", applies=self.success),
        )
