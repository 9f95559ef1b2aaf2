"""A car as a kinematic bicycle with the bounds of its pedals, wheel and tyres, as a pure function.

Source: Rajamani, "Vehicle Dynamics and Control", 2nd ed., Sec. 2.2. The rear axle is moved along exact circles, so that
the result does not depend on how a period is divided while nothing changes in it. No handedness is assumed: what turns
headings up is a positive steering angle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from chauffeur.geometry import Pose

_STRAIGHT_RAD: Final = 1e-9


@dataclass(frozen=True, slots=True)
class KinematicBicycle:
    """Size and bounds of a car.

    Attributes:
        length_m, width_m: Of its body.
        wheelbase_m: Between the axles.
        rear_to_middle_m: From the rear axle forward to the middle of the body.
        most_steering_rad: Of the front wheels, to either side.
        steering_rate_radps: How fast they turn.
        most_acceleration_mps2, most_braking_mps2: Of the pedals, both positive.
        grip_mps2: Lateral acceleration that the tyres hold; asked for more, the car understeers.
        lag_s: Time constant with which the pedals answer; who plans a stop counts on it, `advanced` does not.
        stray_s: How far beside or beyond the place that a bicycle of these numbers foresees the car comes to a stand,
            for every m/s that it brakes from.
    """

    length_m: float
    width_m: float
    wheelbase_m: float
    rear_to_middle_m: float
    most_steering_rad: float
    steering_rate_radps: float
    most_acceleration_mps2: float
    most_braking_mps2: float
    grip_mps2: float = 8.0
    lag_s: float = 0.0
    stray_s: float = 0.0


LINCOLN_MKZ: Final = KinematicBicycle(4.902, 2.128, 2.85, 1.425, 0.61, 1.2, 3.5, 8.0)
"""Lincoln MKZ of 2017: the size that CARLA gives it, wheelbase and turning circle of the real one."""


@dataclass(frozen=True, slots=True)
class BicycleState:
    """A car at one instant: its rear axle, speed forwards, the angle of its front wheels, what its pedals do."""

    rear: Pose
    speed_mps: float
    steering_rad: float = 0.0
    acceleration_mps2: float = 0.0

    def yaw_rate_radps(self, parameters: KinematicBicycle) -> float:
        """Yaw rate, rad/s."""
        return self.speed_mps * curvature_of(self.speed_mps, self.steering_rad, parameters)

    def middle(self, parameters: KinematicBicycle) -> Pose:
        """The middle of the body."""
        return self.rear.ahead(parameters.rear_to_middle_m)


def curvature_of(speed_mps: float, steering_rad: float, parameters: KinematicBicycle) -> float:
    """Curvature, 1/m, that the rear axle drives, within the grip of the tyres."""
    asked = math.tan(steering_rad) / parameters.wheelbase_m
    held = parameters.grip_mps2 / max(speed_mps * speed_mps, 1e-6)
    return max(-held, min(held, asked))


def advanced(
    state: BicycleState, acceleration_mps2: float, steering_rad: float, dt_s: float, parameters: KinematicBicycle
) -> BicycleState:
    """The state after a period under a command, which is brought within the car's bounds first.

    It brakes to a stand, and does not go backwards.

    Args:
        state: Before.
        acceleration_mps2: Asked along the heading.
        steering_rad: Asked of the front wheels.
        dt_s: Length of the period.
        parameters: Of the car.
    """
    asked = max(-parameters.most_braking_mps2, min(parameters.most_acceleration_mps2, acceleration_mps2))
    turn = parameters.steering_rate_radps * dt_s
    wheel = max(-parameters.most_steering_rad, min(parameters.most_steering_rad, steering_rad))
    wheel = max(state.steering_rad - turn, min(state.steering_rad + turn, wheel))
    speed = max(0.0, state.speed_mps + asked * dt_s)
    way = (state.speed_mps + speed) / 2.0 * dt_s
    if speed == 0.0 and asked < 0.0:  # it stood before the period was over
        way = min(way, state.speed_mps * state.speed_mps / (-2.0 * asked))
    half = way * curvature_of(max(speed, state.speed_mps), wheel, parameters) / 2.0
    chord = way * (math.sin(half) / half if abs(half) > _STRAIGHT_RAD else 1.0)
    x, y = state.rear.x_m, state.rear.y_m
    heading = state.rear.heading_rad + half
    rear = Pose(x + chord * math.cos(heading), y + chord * math.sin(heading), state.rear.heading_rad + 2.0 * half)
    return BicycleState(rear, speed, wheel, (speed - state.speed_mps) / dt_s)
