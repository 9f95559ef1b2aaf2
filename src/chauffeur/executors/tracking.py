"""Tracks a path: PID along it (paper Eq. 24), MPC across it (Eq. 25), a gap to whoever is ahead, a bounded fallback.

The controllers run at their own period, several times within a world's where that is longer: the car between two
observations is that of a kinematic bicycle. Where the solver finds nothing, its solution before is held for some
periods, and pure pursuit steers after that. Braking for others is not the gains' to decide: an IDM bound holds above
them, and the safety filter behind it.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from chauffeur.concept import Command, Observation, VehicleState
from chauffeur.control.bicycle import BicycleParameters
from chauffeur.control.mpc import LateralMpc, MpcWeights, PathErrors, SteeringLimits
from chauffeur.control.pid import PidGains, PidLimits, PidState, pid_follow, pid_step
from chauffeur.executors.reference import ReferencePath
from chauffeur.geometry import Polyline, Pose, wrap_to_pi
from chauffeur.worlds.path_follower import Chassis, Follower, Look

CONTROL_S: Final = 0.05
"""Longest period of the controllers."""
_LOOK: Final = Look(look_ahead_m=5.0, look_ahead_ratio_s=1.0)
_JAM_M: Final = 2.0
_ROOM_M: Final = 0.5
_FREE_MPS: Final = 10.0
"""More than the target, so that the gap keeper's own free-road law never binds."""


@dataclass(frozen=True, slots=True)
class Gains:
    """Both rows of an action matrix, for the controllers."""

    pid: PidGains
    mpc: MpcWeights


DEFAULT_GAINS: Final = Gains(PidGains(0.6, 0.02, 0.05), MpcWeights(10.0, 20.0, 100.0))
"""Fixed gains of the moderate style: the baseline of Tab. XI, and what tracks trajectories."""


def bicycle_for(chassis: Chassis) -> BicycleParameters:
    """Model parameters for a car of this wheelbase: mass and stiffness of a saloon, scaled."""
    base = BicycleParameters()
    scale = chassis.wheelbase_m / base.wheelbase_m
    return replace(
        base,
        front_m=base.front_m * scale,
        rear_m=base.rear_m * scale,
        inertia_kgm2=base.inertia_kgm2 * scale * scale,
    )


class PathTracker:
    """Tracks one reference at a time; it remembers the controllers' states and what was commanded last."""

    def __init__(self, chassis: Chassis, dt_s: float, gains: Gains, limits: PidLimits | None = None) -> None:
        """Args: the car; the world's control period; gains; bounds of the acceleration."""
        self._chassis = chassis
        self._parts = max(1, math.ceil(dt_s / CONTROL_S - 1e-9))
        self._dt_s, self._sub_s = dt_s, dt_s / self._parts
        self._gains = gains
        self._limits = PidLimits(high_mps2=chassis.acceleration_mps2) if limits is None else limits
        self._car = bicycle_for(chassis)
        self._mpc = LateralMpc(gains.mpc, self._sub_s, self._car, SteeringLimits(angle_rad=chassis.steering_rad))
        self._follower = Follower(chassis, dt_s, jam_m=_JAM_M)
        self._reference: ReferencePath | None = None
        self._pid = PidState()
        self._before: VehicleState | None = None
        self._angle = 0.0
        self.steered = Counter[str]()
        """Number of steps that each source of steering has served: `solved`, `previous`, `pursuit`."""
        self.offset_m = 0.0
        """Lateral error at the last observation, m."""
        self.station_m = 0.0
        """Way along the reference at the last observation, m."""

    def follow(self, reference: ReferencePath) -> None:
        """Track a reference from now on; the controllers' states go on."""
        self._reference = reference
        self._follower.take(Polyline.of(zip(reference.x.tolist(), reference.y.tolist(), strict=True)), _ROOM_M)

    def command(self, observation: Observation, target_mps: float, headway_s: float) -> Command:
        """Acceleration and steering for one period of the world.

        Args:
            observation: The instant.
            target_mps: Speed to reach.
            headway_s: Time headway to who is ahead.
        """
        assert self._reference is not None
        ego = observation.ego
        others = [one for one in (*observation.others, *observation.objects) if one.kind != "stop_sign"]
        held = self._follower.command(ego, others, _LOOK, target_mps + _FREE_MPS, headway_s)
        speed = max(ego.speed_mps, 0.0)
        yaw_rate = self._yaw_rate(ego)
        if self._before is None:
            self._angle = ego.steering_rad
        wheel = ego.steering_rad if ego.steering_rad else self._angle
        self._before = ego
        middle = Pose(ego.x_m, ego.y_m, ego.heading_rad)
        mass = middle.ahead(self._to_mass_m)
        total, acceleration = 0.0, 0.0
        for part in range(self._parts):
            place = self._reference.locate(mass.x_m, mass.y_m)
            if part == 0:
                self.offset_m, self.station_m = place.offset_m, place.station_m
            wanted, pid = pid_step(self._gains.pid, self._limits, self._pid, target_mps - speed, self._sub_s)
            acceleration = min(wanted, held.acceleration_mps2)
            self._pid = pid_follow(pid, acceleration) if acceleration < wanted else pid
            self._steer(mass, speed, yaw_rate, wheel, acceleration, held.steering_rad)
            total += acceleration
            if part + 1 < self._parts:
                speed, yaw_rate, wheel, mass = self._predicted(mass, speed, wheel, acceleration)
        return Command(total / self._parts, self._angle)

    @property
    def _to_mass_m(self) -> float:
        """From the middle of the car forwards to its centre of mass."""
        return self._car.rear_m - self._chassis.body.rear_to_middle_m

    def _yaw_rate(self, ego: VehicleState) -> float:
        """As observed; from the headings of two instants where a world does not say."""
        if ego.yaw_rate_radps or self._before is None:
            return ego.yaw_rate_radps
        return wrap_to_pi(ego.heading_rad - self._before.heading_rad) / self._dt_s

    def _steer(
        self, mass: Pose, speed: float, yaw_rate: float, wheel: float, acceleration: float, pursuit_rad: float
    ) -> None:
        assert self._reference is not None
        place = self._reference.locate(mass.x_m, mass.y_m)
        turned = self._reference.heading_error(mass.heading_rad, place)
        # The velocity points beside the heading by the slip angle that goes with this yaw rate.
        slip = -self._car.heading_error_rad(speed) * yaw_rate / speed if speed > 1.0 else 0.0
        errors = PathErrors(place.offset_m, speed * (turned + slip), turned, yaw_rate - place.curvature_per_m * speed)
        ahead_s = np.arange(self._mpc.horizon) * self._sub_s
        speeds = np.maximum(speed + acceleration * np.minimum(ahead_s, 1.0), 0.0)
        way = np.concatenate([[0.0], np.cumsum(speeds[:-1]) * self._sub_s])
        curvatures = self._reference.curvatures(place.station_m + way)
        step = self._mpc.steer(errors, curvatures, speed, wheel, self._angle)
        if step.source == "none":
            self.steered["pursuit"] += 1
            turn = self._mpc.limits.rate_radps * self._sub_s
            self._angle = min(max(pursuit_rad, self._angle - turn), self._angle + turn)
        else:
            self.steered[step.source] += 1
            self._angle = step.steering_rad

    def _predicted(
        self, mass: Pose, speed: float, wheel: float, acceleration: float
    ) -> tuple[float, float, float, Pose]:
        """Speed, yaw rate, wheel and place a sub-step later."""
        dt = self._sub_s
        wheel += min(1.0, dt / self._car.lag_s) * (self._angle - wheel)
        yaw_rate = speed * math.tan(wheel) / self._chassis.wheelbase_m
        mean = Pose(mass.x_m, mass.y_m, mass.heading_rad + 0.5 * yaw_rate * dt).ahead(speed * dt)
        then = Pose(mean.x_m, mean.y_m, mass.heading_rad + yaw_rate * dt)
        return max(0.0, speed + acceleration * dt), yaw_rate, wheel, then
