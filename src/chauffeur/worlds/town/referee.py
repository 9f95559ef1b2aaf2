"""Judges of a trip through a town: success is to be at the place that was meant, or to have gone the way that was."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final

from chauffeur.concept import JudgedBy, LaneId, Metric, Outcome, ProgramState, Setpoints
from chauffeur.geometry import Turn, named_ways
from chauffeur.worlds.skeleton import PlaceJudge
from chauffeur.worlds.town.world import TownWorld

BEYOND_M: Final = 40.0
"""A way is taken when the car is so far behind the junction."""
STANDS_S: Final = 3.0
"""A car that was to stop has stopped after so long."""
ENDED_S: Final = 30.0
"""So long after its program ended a car may still take the way that it was set to take."""
_STANDING_MPS: Final = 0.1
_TAKES: Final = {"left": "turn left", "right": "turn right", "straight": "go straight on at a junction"}


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
        """Whether the car is there."""
        return self._arrived

    @property
    def success(self) -> bool:
        """Whether the car is there."""
        return self._arrived

    def metrics(self) -> tuple[Metric, ...]:
        """Whether it arrived, how far it drove, and how long that took."""
        return (
            Metric("town-arrived-v1", float(self._arrived), "points"),
            Metric("town-driven-v1", self._driven_m, "m"),
            Metric("town-time-v1", self._world.observe().time_s, "s", applies=self._arrived),
        )


@dataclass(frozen=True, slots=True)
class TownWay:
    """A way to be taken at a junction: at the `nth` junction that has one, 1 for the next."""

    turn: Turn
    nth: int = 1


class WayReferee:
    """Looks at a town after each control period: whether the car took the ways it was to take, and stood at the end."""

    def __init__(self, world: TownWorld, ways: Sequence[TownWay], stops: bool, judged_by: JudgedBy = "plan") -> None:
        """Take a task.

        Args:
            world: Just reset.
            ways: To be taken one after the other, at the next junctions that have them.
            stops: Whether the car is to stop after them.
            judged_by: Where they were read.
        """
        self._world, self._left, self._stops, self._of = world, list(ways), stops, len(ways) + stops
        self.judged_by: JudgedBy = judged_by
        self._before: LaneId | None = world.observe().ego.lane
        self._beyond_m = self._driven_m = self._stood_s = self._finished_s = 0.0
        self._told_to_stand = self._finished = self._astray = False
        self._passed = 0

    def follow(self, setpoints: Setpoints, state: ProgramState) -> None:
        """What the program asks for in this period, before `observe`: who stands at a red light has not stopped."""
        self._told_to_stand = setpoints.target_speed_mps is not None and setpoints.target_speed_mps <= 0.0
        self._finished = state == "finished"

    @property
    def shortfall(self) -> str:
        """What is missing, in words."""
        if self._astray:
            return f"The car took another way, where it was to {_TAKES[self._left[0].turn]}."
        if self._left:
            return f"The car did not come to {_TAKES[self._left[0].turn]}."
        return "" if self.success else "The car did not come to a stop." if self._stops else ""

    @property
    def parts_done(self) -> tuple[int, int]:
        """Ways taken, and the stop, of all of them."""
        stood = self._stops and not self._left and self._stood_s >= STANDS_S
        return self._of - self._stops - len(self._left) + stood, self._of

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
            self._take(
                ways, next((turn for turn, those in ways.items() for one in those if lane.id in one.lanes), None)
            )
        self._before = lane.id

    def _take(self, ways: Collection[Turn], way: Turn | None) -> None:
        """Note the way taken at a junction; one that was not asked for, where straight on was possible, is astray."""
        meant = self._left[0]
        self._passed += meant.turn in ways
        if way == meant.turn and self._passed >= meant.nth:
            self._left.pop(0)
            self._passed, self._beyond_m = 0, 0.0
        elif way != "straight" and way is not None and "straight" in ways:
            self._astray = True

    @property
    def over(self) -> bool:
        """Whether all of it is done, the car took another way, or the program has ended without."""
        return self.success or self._astray or self._finished_s > ENDED_S

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
        return "failure" if self._astray or self._finished_s > ENDED_S else "timeout"

    def metrics(self) -> tuple[Metric, ...]:
        """Whether it went the way that was meant, how far it drove, and how long that took."""
        return (
            Metric("town-way-v1", float(self.success), "points"),
            Metric("town-driven-v1", self._driven_m, "m"),
            Metric("town-time-v1", self._world.observe().time_s, "s", applies=self.success),
        )
