"""Judges of a trip through a town: success is to be at the place that was meant, or to have gone the way that was."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from chauffeur.concept import LaneId, Metric, Outcome, ProgramState, Setpoints
from chauffeur.geometry import Turn, named_ways
from chauffeur.worlds.town.world import TownWorld

BEYOND_M: Final = 40.0
"""A way is taken when the car is so far behind the junction."""
STANDS_S: Final = 3.0
"""A car that was to stop has stopped after so long."""
ENDED_S: Final = 30.0
"""So long after its program ended a car may still take the way that it was set to take."""
_STANDING_MPS: Final = 0.1
_TAKES: Final = {"left": "turn left", "right": "turn right", "straight": "go straight on at a junction"}


class TownReferee:
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
        """Whether the car is there."""
        return self._arrived

    @property
    def success(self) -> bool:
        """Whether the car is there."""
        return self._arrived

    def outcome(self) -> Outcome:
        """What came of it, collisions apart."""
        return "success" if self._arrived else "timeout"

    def metrics(self) -> tuple[Metric, ...]:
        """Whether it arrived, how far it drove, and how long that took."""
        return (
            Metric("town-arrived-v1", float(self._arrived), "points"),
            Metric("town-driven-v1", self._driven_m, "m"),
            Metric("town-time-v1", self._world.observe().time_s, "s", applies=self._arrived),
        )


class WayReferee:
    """Looks at a town after each control period: whether the car took the ways it was to take, and stood at the end."""

    def __init__(self, world: TownWorld, turns: Sequence[Turn], stops: bool) -> None:
        """Args: the world, just reset; ways to be taken, one after the other; whether it is to stop after them."""
        self._world, self._left, self._stops = world, list(turns), stops
        self._before: LaneId | None = world.observe().ego.lane
        self._beyond_m = self._driven_m = self._stood_s = self._finished_s = 0.0
        self._told_to_stand = self._finished = False

    def follow(self, setpoints: Setpoints, state: ProgramState) -> None:
        """What the program asks for in this period, before `observe`: who stands at a red light has not stopped."""
        self._told_to_stand = setpoints.target_speed_mps is not None and setpoints.target_speed_mps <= 0.0
        self._finished = state == "finished"

    @property
    def shortfall(self) -> str:
        """What is missing, in words."""
        if self._left:
            return f"The car did not come to {_TAKES[self._left[0]]}."
        return "" if self.success else "The car did not come to a stop." if self._stops else ""

    def observe(self) -> None:
        """Look at the instant after a control period."""
        seen, dt_s = self._world.observe(), self._world.dt_s
        ego, road = seen.ego, seen.road
        self._driven_m += ego.speed_mps * dt_s
        self._beyond_m += ego.speed_mps * dt_s
        stands = self._told_to_stand and ego.speed_mps < _STANDING_MPS
        self._stood_s = self._stood_s + dt_s if stands else 0.0
        self._finished_s = self._finished_s + dt_s if self._finished else 0.0
        lane, before = road.get(ego.lane), road.get(self._before)
        if lane is None or lane is before:
            return
        if before is not None and lane.junction and not before.junction and self._left:
            ways = named_ways(road, before.id)
            way = next((turn for turn, those in ways.items() for one in those if lane.id in one.lanes), None)
            if way == self._left[0]:
                self._left.pop(0)
                self._beyond_m = 0.0
        self._before = lane.id

    @property
    def over(self) -> bool:
        """Whether all of it is done, or the program has ended without."""
        return self.success or self._finished_s > ENDED_S

    @property
    def success(self) -> bool:
        """Whether the ways are taken, and the car stands where it was to stop."""
        if self._left:
            return False
        return self._stood_s >= STANDS_S if self._stops else self._beyond_m > BEYOND_M

    def outcome(self) -> Outcome:
        """What came of it, collisions apart."""
        if self.success:
            return "success"
        return "failure" if self._finished_s > ENDED_S else "timeout"

    def metrics(self) -> tuple[Metric, ...]:
        """Whether it went the way that was meant, how far it drove, and how long that took."""
        return (
            Metric("town-way-v1", float(self.success), "points"),
            Metric("town-driven-v1", self._driven_m, "m"),
            Metric("town-time-v1", self._world.observe().time_s, "s", applies=self.success),
        )
