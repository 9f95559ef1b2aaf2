"""The last word in a parking lot: a command goes through only if the car can brake to a stand after it.

On roads the shield judges lanes; a car that parks leaves its lane on purpose, among cars a hand's breadth away. What is
judged here is the ground: one period under the command, then full braking with the wheel held where it is by then.
Those who stand may come close to that way, but not onto it; those who drive may go on and speed up, and people on foot
may turn anywhere. After a command that passed, braking with the wheel held is always left: that is what replaces one
that does not pass.

Source of the principle: Pek, Althoff, "Fail-safe motion planning for online verification", 2020.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from chauffeur.concept import Command, Observation, VehicleState
from chauffeur.concept.units import people_speed
from chauffeur.geometry import Box, Pose, overlap
from chauffeur.geometry.ground import Ground
from chauffeur.worlds.path_follower import HARDEST_MPS2, Chassis

MARGIN_M: Final = 0.05
"""Left to those who stand, and to the edge: more than a stop takes longer because the car brakes period by period."""
WALK_MPS: Final = 1.5
"""Nobody on foot is expected to be faster, wherever they turn."""
SPEED_UP_MPS2: Final = 2.0
"""No car is expected to speed up harder."""
_EASY_MPS2: Final = 1.0
"""Braking towards the speed limit."""
_STAND_MPS: Final = 0.05
_STEP_M: Final = 0.1
_HALVINGS: Final = 5
_LEVEL: Final = 1e-9


@dataclass(frozen=True, slots=True)
class LotFilterResult:
    """Command that may go to the actuator; rule and reason are empty where it is the one asked for."""

    command: Command
    rule: str = ""
    reason: str = ""


class LotSafetyFilter:
    """Judges the commands of one trip, one a control period. It remembers where it left the wheel."""

    def __init__(self, chassis: Chassis, dt_s: float, steering_rate: float, ground: Ground | None = None) -> None:
        """Args: the car; the control period; how fast the wheel turns, rad/s; the ground, default the road's own."""
        self._chassis = chassis
        self._dt_s = dt_s
        self._ground = ground
        self._turn = steering_rate * dt_s
        self._wheel = 0.0

    def filter(self, observation: Observation, command: Command, most_mps: float) -> LotFilterResult:
        """The command, or the least change of it that can still end well.

        Args:
            observation: The instant the command is for.
            command: What is asked; numbers that are none stop the car.
            most_mps: Highest speed allowed.
        """
        speed = max(observation.ego.speed_mps, 0.0)
        asked, wheel = command.acceleration_mps2, command.steering_rad
        if not (math.isfinite(asked) and math.isfinite(wheel)):
            return self._let(Command(-HARDEST_MPS2, self._wheel), "finite", "A command that is no number was replaced.")
        rule, reason = "", ""
        most = (most_mps - speed) / self._dt_s
        most = most if most >= 0.0 else max(most, -_EASY_MPS2)
        if asked > most + _LEVEL:
            rule, reason = "speed", f"No faster than {people_speed(most_mps, at_most=True)} here."
        wanted = min(asked, most)
        others = [one for one in (*observation.others, *observation.objects) if self._near(observation.ego, one)]
        ground = observation.road.ground if self._ground is None else self._ground
        if self._ends_well(observation.ego, wanted, wheel, others, ground):
            return self._let(Command(wanted, wheel), rule, reason)
        low, high = -HARDEST_MPS2, wanted
        if low < high and self._ends_well(observation.ego, low, wheel, others, ground):
            for _ in range(_HALVINGS):
                middle = (low + high) / 2.0
                if self._ends_well(observation.ego, middle, wheel, others, ground):
                    low = middle
                else:
                    high = middle
            return self._let(Command(low, wheel), "room", "There is no room to go on like that and still stop.")
        held = Command(-HARDEST_MPS2, self._wheel)
        return self._let(held, "room", "That way would touch somebody: braking, wheel held.")

    def _let(self, command: Command, rule: str = "", reason: str = "") -> LotFilterResult:
        self._wheel = self._reached(command.steering_rad)
        return LotFilterResult(command, rule, reason)

    def _reached(self, asked_rad: float) -> float:
        """Steering angle reached within a period."""
        lock = self._chassis.steering_rad
        asked_rad = max(-lock, min(lock, asked_rad))
        return max(self._wheel - self._turn, min(self._wheel + self._turn, asked_rad))

    def _near(self, ego: VehicleState, other: VehicleState) -> bool:
        reach = (math.hypot(ego.length_m, ego.width_m) + math.hypot(other.length_m, other.width_m)) / 2.0
        closing = max(ego.speed_mps, 0.0) + abs(other.speed_mps) + WALK_MPS
        return math.hypot(ego.x_m - other.x_m, ego.y_m - other.y_m) < reach + closing * 2.0

    def _ends_well(
        self, ego: VehicleState, acceleration: float, wheel_rad: float, others: list[VehicleState], ground: Ground
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
        beyond = ground.beyond_m(np.array(places), body.length_m + 2.0 * MARGIN_M, body.width_m + 2.0 * MARGIN_M)
        return not beyond.any()


def _meets(own: Box, other: VehicleState, at_s: float) -> bool:
    """True if somebody may be where the car is, after a time."""
    if other.kind != "car":
        return overlap(own, other.box.grown(MARGIN_M + WALK_MPS * at_s))
    speed = max(other.speed_mps, 0.0)
    if speed <= _STAND_MPS:
        return overlap(own, other.box.grown(MARGIN_M))
    way = speed * at_s + SPEED_UP_MPS2 * at_s * at_s / 2.0
    c, s = math.cos(other.heading_rad), math.sin(other.heading_rad)
    x, y = other.x_m + c * way / 2.0, other.y_m + s * way / 2.0
    return overlap(own, Box(x, y, other.heading_rad, other.length_m + way, other.width_m).grown(MARGIN_M))
