"""A car that follows a path among others: pure pursuit across it, a gap and a speed along it.

Nothing here depends on the kind of world: all it needs is a path for the rear axle, the car's own state and everybody
else's. What the parameters of pure pursuit ask for is done as far as it is steady and keeps the car on its path:

- a look-ahead of less than 0.5 s is taken for 0.5 s (and at least 1.5 m): steering answers late, and a shorter one
  weaves;
- where a look-ahead would cut a corner by more than the room beside the path, it is shortened for as long as it would;
- no wheel is turned further than the tyres hold at that speed;
- speed is lowered before bends, and before the end of the path: the car stops there whatever the look-ahead is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from chauffeur.concept import Command, VehicleState
from chauffeur.control import IdmParameters
from chauffeur.control.idm import idm_acceleration
from chauffeur.control.kinematic_bicycle import KinematicBicycle
from chauffeur.control.pure_pursuit import kept_within, look_ahead_distance, pursuit_curvature
from chauffeur.control.pure_pursuit import steering_angle as angle_of
from chauffeur.geometry import Box, Polyline, Pose, overlap, wrap_to_pi
from chauffeur.worlds.corridor import Ahead, Body, Corridor

STEADY_S: Final = 0.5
"""Shortest look-ahead, as a time: twice that below which a car weaves whose steering answers after 0.1 s."""
SHORTEST_M: Final = 1.5
"""Shortest look-ahead, as a distance."""
GRIP_MPS2: Final = 6.0
"""Sideways acceleration no steering exceeds: two thirds of what tyres hold on a dry road."""
BEND_MPS2: Final = 3.0
"""Sideways acceleration in bends, for which speed is lowered: firm for people, far from slipping."""
LOT_BEND_MPS2: Final = 1.5
"""The same in a parking lot."""
EASY_MPS2: Final = 2.0
"""Braking before bends and the end of the path."""
FIRM_MPS2: Final = 3.0
"""Braking towards a lower target speed."""
HARDEST_MPS2: Final = 8.0
"""Braking in an emergency."""
COMMITTED_MPS2: Final = 6.0
"""A crossing that could only be kept clear of by braking harder is driven on through."""
_BEND_M: Final = 2.0
_STILL_MPS: Final = 0.1
_SIDE_M: Final = 0.3
_STOP_SHORT_M: Final = 1.0
_SLOW_MPS: Final = 0.5
_LOOK_S: Final = 5.0
_LOOK_M: Final = 12.0
_TOUCH_M: Final = 0.2


@dataclass(frozen=True, slots=True)
class Chassis:
    """A car as its follower knows it.

    Attributes:
        body: Size, and where the rear axle is in it.
        wheelbase_m: Axle to axle.
        steering_rad: Full lock.
        acceleration_mps2: Hardest acceleration asked for.
    """

    body: Body
    wheelbase_m: float
    steering_rad: float
    acceleration_mps2: float

    @classmethod
    def of(cls, car: KinematicBicycle) -> Chassis:
        """Chassis of a car simulated as a kinematic bicycle."""
        body = Body(car.length_m, car.width_m, car.rear_to_middle_m)
        return cls(body, car.wheelbase_m, car.most_steering_rad, car.most_acceleration_mps2)

    def rear(self, ego: VehicleState) -> Pose:
        """Its rear axle."""
        return Pose(ego.x_m, ego.y_m, ego.heading_rad).ahead(-self.body.rear_to_middle_m)


@dataclass(frozen=True, slots=True)
class Look:
    """The parameters of pure pursuit: least look-ahead distance, and look-ahead per speed."""

    look_ahead_m: float
    look_ahead_ratio_s: float


class Follower:
    """Follows one path, and takes over a new one when given it. Its only state is where along the path it is."""

    def __init__(self, chassis: Chassis, dt_s: float, *, jam_m: float, bend_mps2: float = BEND_MPS2) -> None:
        """Args: the car; its control period; clear distance kept to who stands; sideways acceleration in bends."""
        self._chassis = chassis
        self._dt_s = dt_s
        self._manners = IdmParameters(chassis.acceleration_mps2, FIRM_MPS2, 4.0, jam_m, 1.5)
        self._bend_mps2 = bend_mps2
        self._corridor: Corridor | None = None
        self._fastest: tuple[float, ...] = ()
        self.located_m: float | None = None
        """Way along the path to where the car was last; None where it has not been looked for on this path."""
        self._room_m = 0.0

    @property
    def path(self) -> Polyline | None:
        """The path followed."""
        return None if self._corridor is None else self._corridor.path

    @property
    def station_m(self) -> float:
        """Way along the path to where the car was last, m."""
        return 0.0 if self.located_m is None else self.located_m

    @property
    def left_m(self) -> float:
        """Way left to the end of the path, m; nothing where there is no path."""
        return 0.0 if self._corridor is None else self._corridor.path.length_m - self.station_m

    def take(self, path: Polyline, room_m: float) -> None:
        """Follow a path of the rear axle from now on, with so much room beside it."""
        self._corridor = Corridor(path, self._chassis.body, min(_SIDE_M, room_m))
        self._fastest = _speeds_for_bends(path, self._bend_mps2)
        self.located_m = None
        self._room_m = room_m

    def locate(self, ego: VehicleState) -> float:
        """Way along the path to where the car is now. Raises ValueError without a path."""
        if self._corridor is None:
            raise ValueError("There is no path to follow.")
        rear, path = self._chassis.rear(ego), self._corridor.path
        if self.located_m is None:
            self.located_m = path.nearest(rear.x_m, rear.y_m)
        else:
            ahead = self.located_m + max(ego.speed_mps, 0.0) * self._dt_s + 2.0
            self.located_m = path.nearest(rear.x_m, rear.y_m, self.located_m - 1.0, ahead)
        return self.located_m

    def command(
        self,
        ego: VehicleState,
        others: Sequence[VehicleState],
        look: Look,
        target_mps: float,
        headway_s: float,
        stop_m: float = math.inf,
    ) -> Command:
        """Command for this period.

        Args:
            ego: The car.
            others: Everybody else.
            look: Parameters of pure pursuit.
            target_mps: Speed in free traffic.
            headway_s: Time headway to who is ahead.
            stop_m: Way along the path at which the rear axle is to stop, before the path's end.
        """
        station = self.locate(ego)
        steering = self.steering(ego, look, station)
        acceleration = self._along(ego, others, station, target_mps, headway_s, stop_m)
        clear = self._clear_way(ego, others, steering)
        if clear < math.inf:
            acceleration = min(acceleration, stopping_acceleration(ego.speed_mps, clear, FIRM_MPS2, self._dt_s))
        return Command(max(-HARDEST_MPS2, acceleration), steering)

    def steering(self, ego: VehicleState, look: Look, station: float) -> float:
        """Steering angle of pure pursuit, rad."""
        assert self._corridor is not None
        path, rear, speed = self._corridor.path, self._chassis.rear(ego), max(ego.speed_mps, 0.0)
        least = max(SHORTEST_M, STEADY_S * speed)
        wanted = look_ahead_distance(speed, look.look_ahead_ratio_s, look.look_ahead_m)
        distance = kept_within(rear, path, max(wanted, least), station, self._room_m, least)
        curvature = pursuit_curvature(rear, path, distance, station)
        most = GRIP_MPS2 / max(speed, _STILL_MPS) ** 2
        curvature = max(-most, min(most, curvature))
        return angle_of(curvature, self._chassis.wheelbase_m, self._chassis.steering_rad)

    def crossing(self, ego: VehicleState, others: Sequence[VehicleState], target_mps: float, margin_s: float) -> bool:
        """True if an agent would cross, by a margin in time, if the car went on towards a speed now."""
        assert self._corridor is not None
        found = self._corridor.ahead(
            self.locate(ego), ego.speed_mps, others, within_m=_LOOK_M, target_mps=target_mps, margin_s=margin_s
        )
        return any(one.crosses for one in found)

    def _along(
        self,
        ego: VehicleState,
        others: Sequence[VehicleState],
        station: float,
        target_mps: float,
        headway_s: float,
        stop_m: float,
    ) -> float:
        assert self._corridor is not None
        speed = max(ego.speed_mps, 0.0)
        target = min(target_mps, self._bend_speed(station + speed * self._dt_s))
        wanted = self._free(speed, target)
        end = min(stop_m, self._corridor.path.length_m)
        wanted = min(wanted, stopping_acceleration(speed, end - station, EASY_MPS2, self._dt_s))
        look_m = _LOOK_M + speed * _LOOK_S
        kinds = {other.id: other.kind for other in others}
        found = self._corridor.ahead(station, speed, others, within_m=look_m, target_mps=target)
        for one in found:
            wanted = min(wanted, self._behind(one, speed, target, headway_s, car=kinds[one.id] == "car"))
        return max(-HARDEST_MPS2, min(self._chassis.acceleration_mps2, wanted))

    def _clear_way(self, ego: VehicleState, others: Sequence[VehicleState], steering_rad: float) -> float:
        """Way the car could drive on with the wheel held until it touches an agent; infinite if it can stop before.

        The corridor is where the car should be; this is where it really goes.
        """
        speed, body = max(ego.speed_mps, 0.0), self._chassis.body
        reach = speed * self._dt_s + speed * speed / (2.0 * FIRM_MPS2) + _TOUCH_M
        around = math.hypot(body.length_m, body.width_m) / 2.0 + reach
        near = [
            box
            for other in others
            if math.hypot(other.x_m - ego.x_m, other.y_m - ego.y_m)
            < around + math.hypot(other.length_m, other.width_m) / 2.0
            and abs(other.speed_mps) < _SLOW_MPS
            for box in [other.box]
        ]
        if not near or speed <= 0.0:
            return math.inf
        rear, curvature = self._chassis.rear(ego), math.tan(steering_rad) / self._chassis.wheelbase_m
        way = 0.0
        while way < reach:
            way += _TOUCH_M
            half = way * curvature / 2.0
            chord = way * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
            middle = Pose(
                rear.x_m + chord * math.cos(rear.heading_rad + half),
                rear.y_m + chord * math.sin(rear.heading_rad + half),
                rear.heading_rad + 2.0 * half,
            ).ahead(body.rear_to_middle_m)
            own = Box(middle.x_m, middle.y_m, middle.heading_rad, body.length_m + 0.1, body.width_m + 0.1)
            if any(overlap(own, box) for box in near):
                return way - _TOUCH_M
        return math.inf

    def _free(self, speed: float, target: float) -> float:
        if target < _STILL_MPS:  # IDM's free road has no standing still
            return max(-FIRM_MPS2, -speed / self._dt_s)
        return max(-EASY_MPS2, idm_acceleration(speed, target, self._manners))  # a lower target is no emergency

    def _behind(self, one: Ahead, speed: float, target: float, headway_s: float, *, car: bool) -> float:
        """Acceleration, m/s2, that an agent ahead leaves."""
        if one.crosses and car and speed**2 > 2.0 * COMMITTED_MPS2 * one.gap_m:
            return math.inf
        jam = self._manners.jam_distance_m
        if one.crosses or one.speed_mps < _SLOW_MPS:
            room = one.gap_m - (_STOP_SHORT_M if one.crosses else jam)
            return stopping_acceleration(speed, room, EASY_MPS2, self._dt_s)
        manners = IdmParameters(self._manners.acceleration_mps2, FIRM_MPS2, 4.0, jam, headway_s)
        # What the gap asks for and no more: to slow down to a lower target is `_free`'s part, which does it gently.
        return idm_acceleration(speed, max(target, speed, _SLOW_MPS), manners, one.gap_m, speed - one.speed_mps)

    def _bend_speed(self, station: float) -> float:
        index = max(0, min(int(station / _BEND_M), len(self._fastest) - 1))
        return self._fastest[index]


def stopping_acceleration(speed_mps: float, distance_m: float, braking_mps2: float, dt_s: float) -> float:
    """Largest acceleration, m/s2, for one period after which a braking still stops within a distance.

    Args:
        speed_mps: Speed now, 0 or more.
        distance_m: Way to where the car is to stand.
        braking_mps2: Braking from then on; where that cannot be enough, what is returned is as hard as it has to be.
        dt_s: Period. The next speed is reached at its end.
    """
    half = 0.5 * braking_mps2 * dt_s
    left = distance_m - speed_mps * dt_s
    if left <= 0.0:
        return -speed_mps / dt_s
    # With next speed u: v dt + u dt / 2 + u^2 / 2b <= distance, as for a car that is stepped by explicit Euler
    then = -half + math.sqrt(half * half + 2.0 * braking_mps2 * left)
    return (then - speed_mps) / dt_s


def _speeds_for_bends(path: Polyline, sideways_mps2: float) -> tuple[float, ...]:
    """Highest speed every 2 m of a path, m/s: what its bends allow, there and farther on."""
    headings: list[float] = path.poses(path.every(_BEND_M))[2].tolist()
    count = len(headings)
    speeds = [math.inf] * count
    for i, (one, two) in enumerate(pairwise(headings)):
        curvature = abs(wrap_to_pi(two - one)) / _BEND_M
        if curvature > 1e-4:
            most = math.sqrt(sideways_mps2 / curvature)
            speeds[i], speeds[i + 1] = min(speeds[i], most), min(speeds[i + 1], most)
    for i in range(count - 2, -1, -1):
        speeds[i] = min(speeds[i], math.sqrt(speeds[i + 1] ** 2 + 2.0 * EASY_MPS2 * _BEND_M))
    return tuple(speeds)
