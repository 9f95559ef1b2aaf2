"""Judge of a trip to a place in a town: success is to be there."""

from __future__ import annotations

from chauffeur.concept import Metric
from chauffeur.worlds.skeleton import PlaceJudge
from chauffeur.worlds.town.world import TownWorld


class TownReferee(PlaceJudge):
    """Looks at a town after each control period."""

    def __init__(self, world: TownWorld) -> None:
        """Args: the world, just reset, with somewhere to go."""
        self._world = world
        self._arrived = False
        self._driven_m = 0.0

    def observe(self) -> None:
        """Look at the instant after a control period."""
        self._arrived = self._world.arrived
        self._driven_m += self._world.observe().ego.speed_mps * self._world.dt_s

    @property
    def over(self) -> bool:
        """True if the car is there."""
        return self._arrived

    @property
    def success(self) -> bool:
        """True if the car is there."""
        return self._arrived

    def metrics(self) -> tuple[Metric, ...]:
        """Arrival, distance driven, and time taken."""
        return (
            Metric("town-arrived-v1", float(self._arrived), "points"),
            Metric("town-driven-v1", self._driven_m, "m"),
            Metric("town-time-v1", self._world.observe().time_s, "s", applies=self._arrived),
        )
