"""The shield of paved ground, and which shield fits a world."""

from __future__ import annotations

from collections.abc import Callable

from chauffeur.concept import Command, Intervention, LaneId, Limits, Observation
from chauffeur.geometry import RoadGraph
from chauffeur.geometry.ground import Ground
from chauffeur.safety.shield.shield import FilterResult, Shield
from chauffeur.safety.shield.street import StreetShield
from chauffeur.worlds.base import World
from chauffeur.worlds.parking.lot import LIMIT_MPS
from chauffeur.worlds.parking.safety_filter import LotSafetyFilter
from chauffeur.worlds.places import PavedGround, StreetCar


class GroundShield(Shield):
    """The shield of a parking lot and a proving ground: the same last word, said by rules for paved ground.

    The shield of roads keeps a car in its lane and off others' by distances that no parking car has, and takes it for
    one whose axles are at its ends.
    """

    def __init__(
        self,
        world: PavedGround,
        dt_s: float,
        limits: Limits | None = None,
        limit_mps: Callable[[LaneId], float] | None = None,
    ) -> None:
        """Args: a world just reset; its control period; bounds no command may cross; speed limits (default a lot's)."""
        super().__init__(dt_s, limits)
        ground = Ground(RoadGraph((), paved=(world.ground,)))
        self._lot_filter = LotSafetyFilter(world.chassis, dt_s, world.steering_rate, ground)
        self._limit = limit_mps

    def filter(self, observation: Observation, command: Command, aim: LaneId | None = None) -> FilterResult:
        """The command, changed as little as needed."""
        del aim
        lane = observation.ego.lane
        sign = LIMIT_MPS if self._limit is None or lane is None else self._limit(lane)
        ruling = self._lot_filter.filter(observation, command, self._limits.most_mps(sign))
        if not ruling.rule:
            return FilterResult(ruling.command)
        return FilterResult(ruling.command, (Intervention(ruling.rule, ruling.reason, command, ruling.command),))


def shield_for(world: World, limits: Limits | None = None) -> Shield:
    """The shield that fits what a world, just reset, states: a car on streets, paved ground, or neither: roads."""
    if isinstance(world, StreetCar) and world.car is not None:
        return StreetShield(world.dt_s, limits, car=world.car)
    if isinstance(world, PavedGround):
        return GroundShield(world, world.dt_s, limits, world.perception().speed_limit)
    return Shield(world.dt_s, limits)
