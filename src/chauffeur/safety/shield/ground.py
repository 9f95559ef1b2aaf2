"""The shield of paved ground, and which shield fits a world.

On roads the shield judges lanes; a car that parks leaves its lane on purpose, among cars a hand's breadth away. Here
the ground is judged: one period under the command, then full braking with the wheel held where it is by then. Standing
agents may come close to that way, but not onto it; moving ones may go on and speed up, and people on foot may turn
anywhere. After a command that passed, braking with the wheel held is always left: it replaces one that does not pass.

Source of the principle: Pek, Althoff, "Fail-safe motion planning for online verification", 2020.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from chauffeur.concept import Command, Intervention, LaneId, Limits, Observation, VehicleState
from chauffeur.concept.units import people_speed
from chauffeur.geometry import Box, Pose, RoadGraph, overlap
from chauffeur.geometry.ground import Ground
from chauffeur.safety.shield.gaps import highest
from chauffeur.safety.shield.shield import NO_NUMBER, FilterResult, Shield, is_finite
from chauffeur.safety.shield.street import StreetShield
from chauffeur.worlds.base import World
from chauffeur.worlds.parking.lot import LIMIT_MPS
from chauffeur.worlds.path_follower import HARDEST_MPS2
from chauffeur.worlds.places import PavedGround, StreetCar

MARGIN_M: Final = 0.05
"""Left to standing agents, and to the edge: more than a stop takes longer because the car brakes period by period."""
WALK_MPS: Final = 1.5
"""Fastest expected pedestrian, in any direction."""
SPEED_UP_MPS2: Final = 2.0
"""Hardest expected acceleration of other cars."""
_EASY_MPS2: Final = 1.0
"""Braking towards the speed limit."""
_STAND_MPS: Final = 0.05
_STEP_M: Final = 0.1
_HALVINGS: Final = 5
_LEVEL: Final = 1e-9


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
        self._chassis, self._limit = world.chassis, limit_mps
        self._ground = Ground(RoadGraph((), paved=(world.ground,)))
        self._turn_rad = world.steering_rate * dt_s
        self._wheel_rad = 0.0

    def filter(self, observation: Observation, command: Command, aim: LaneId | None = None) -> FilterResult:
        """The command, changed as little as needed."""
        del aim
        done, rule, reason = self._ruled(observation, command)
        self._wheel_rad = self._reached(done.steering_rad)
        return FilterResult(done, (Intervention(rule, reason, command, done),) if rule else ())

    def _ruled(self, observation: Observation, command: Command) -> tuple[Command, str, str]:
        """The command, or the least change of it that can still end well, with its rule and reason."""
        ego, asked, wheel = observation.ego, command.acceleration_mps2, command.steering_rad
        halt = Command(-HARDEST_MPS2, self._wheel_rad)
        if not is_finite(command):
            return halt, "finite", NO_NUMBER
        sign = LIMIT_MPS if self._limit is None or ego.lane is None else self._limit(ego.lane)
        most_mps = self._limits.most_mps(sign)
        rule, reason = "", ""
        most = (most_mps - max(ego.speed_mps, 0.0)) / self._dt_s
        most = most if most >= 0.0 else max(most, -_EASY_MPS2)
        if asked > most + _LEVEL:
            rule, reason = "speed", f"No faster than {people_speed(most_mps, at_most=True)} here."
        wanted = min(asked, most)
        others = [one for one in (*observation.others, *observation.objects) if _near(ego, one)]

        def ends_well(acceleration: float) -> bool:
            return self._ends_well(ego, acceleration, wheel, others)

        if ends_well(wanted):
            return Command(wanted, wheel), rule, reason
        if wanted > -HARDEST_MPS2 and ends_well(-HARDEST_MPS2):
            found = highest(-HARDEST_MPS2, wanted, ends_well, _HALVINGS)
            return Command(found, wheel), "room", "There is no room to go on like that and still stop."
        return halt, "room", "That way would touch somebody: braking, wheel held."

    def _reached(self, asked_rad: float) -> float:
        """Wheel angle reached within a period, rad."""
        lock = self._chassis.steering_rad
        asked_rad = max(-lock, min(lock, asked_rad))
        return max(self._wheel_rad - self._turn_rad, min(self._wheel_rad + self._turn_rad, asked_rad))

    def _ends_well(
        self, ego: VehicleState, acceleration: float, wheel_rad: float, others: Sequence[VehicleState]
    ) -> bool:
        """True if the car touches nobody and stays on the ground, through a period and then braking to a stand."""
        curvature = math.tan(self._reached(wheel_rad)) / self._chassis.wheelbase_m
        rear, body = self._chassis.rear(ego), self._chassis.body
        first = max(ego.speed_mps, 0.0)
        then = max(0.0, first + acceleration * self._dt_s)
        period = (first + then) / 2.0 * self._dt_s
        whole = period + then * then / (2.0 * HARDEST_MPS2)
        if whole <= _LEVEL:
            return True
        steps = max(1, math.ceil(whole / _STEP_M))
        places: list[tuple[float, float, float]] = []
        for i in range(1, steps + 1):
            way = whole * i / steps
            at_s = self._dt_s * min(1.0, way / period) if period > 0.0 else 0.0
            if way > period:
                at_s += (then - math.sqrt(max(then * then - 2.0 * HARDEST_MPS2 * (way - period), 0.0))) / HARDEST_MPS2
            half = way * curvature / 2.0
            chord = way * (math.sin(half) / half if abs(half) > _LEVEL else 1.0)
            heading = rear.heading_rad + half
            x, y = rear.x_m + chord * math.cos(heading), rear.y_m + chord * math.sin(heading)
            middle = Pose(x, y, rear.heading_rad + 2.0 * half).ahead(body.rear_to_middle_m)
            own = Box(middle.x_m, middle.y_m, middle.heading_rad, body.length_m, body.width_m)
            if any(_meets(own, other, at_s) for other in others):
                return False
            places.append((own.x_m, own.y_m, own.heading_rad))
        beyond = self._ground.beyond_m(np.array(places), body.length_m + 2.0 * MARGIN_M, body.width_m + 2.0 * MARGIN_M)
        return not beyond.any()


def _near(ego: VehicleState, other: VehicleState) -> bool:
    reach = (math.hypot(ego.length_m, ego.width_m) + math.hypot(other.length_m, other.width_m)) / 2.0
    closing = max(ego.speed_mps, 0.0) + abs(other.speed_mps) + WALK_MPS
    return math.hypot(ego.x_m - other.x_m, ego.y_m - other.y_m) < reach + closing * 2.0


def _meets(own: Box, other: VehicleState, at_s: float) -> bool:
    """True if another agent may be where the car is, after a time."""
    if other.kind != "car":
        return overlap(own, other.box.grown(MARGIN_M + WALK_MPS * at_s))
    speed = max(other.speed_mps, 0.0)
    if speed <= _STAND_MPS:
        return overlap(own, other.box.grown(MARGIN_M))
    way = speed * at_s + SPEED_UP_MPS2 * at_s * at_s / 2.0
    c, s = math.cos(other.heading_rad), math.sin(other.heading_rad)
    x, y = other.x_m + c * way / 2.0, other.y_m + s * way / 2.0
    return overlap(own, Box(x, y, other.heading_rad, other.length_m + way, other.width_m).grown(MARGIN_M))


def shield_for(world: World, limits: Limits | None = None) -> Shield:
    """The shield that fits what a world, just reset, states: a car on streets, paved ground, or neither: roads."""
    if isinstance(world, StreetCar) and world.car is not None:
        return StreetShield(world.dt_s, limits, car=world.car)
    if isinstance(world, PavedGround):
        return GroundShield(world, world.dt_s, limits, world.perception().speed_limit)
    return Shield(world.dt_s, limits)
