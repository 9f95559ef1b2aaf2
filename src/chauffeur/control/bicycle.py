"""Linear dynamic bicycle in error coordinates of a path: what the lateral MPC predicts with.

Source: J. M. Snider, "Automatic Steering Methods for Autonomous Automobile Path Tracking", CMU-RI-TR-09-08, 2009
(the paper's [154]); R. Rajamani, "Vehicle Dynamics and Control", 2012, Sec. 2.5 and 3.1. The steering actuator is a
first-order lag, and is part of the model. Discretised exactly for inputs held over a period.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STATES: Final = 5
"""Lateral error (m, left of the path positive), its rate, heading error (rad), its rate, front-wheel angle (rad)."""
SLOWEST_MPS: Final = 2.0
"""The tyre model divides by the speed; slower than this it is that of this speed."""


@dataclass(frozen=True, slots=True)
class BicycleParameters:
    """Car parameters assumed by the controller. A mid-size saloon, rounded: no plant's exact values.

    Attributes:
        mass_kg: Car and people.
        inertia_kgm2: About the vertical axis.
        front_m, rear_m: From the centre of mass to the axles.
        front_npr, rear_npr: Cornering stiffness of each axle (both tyres), N/rad.
        lag_s: Time constant of the steering actuator.
    """

    mass_kg: float = 1150.0
    inertia_kgm2: float = 1850.0
    front_m: float = 1.15
    rear_m: float = 1.42
    front_npr: float = 125_000.0
    rear_npr: float = 105_000.0
    lag_s: float = 0.1

    @property
    def wheelbase_m(self) -> float:
        """Axle to axle."""
        return self.front_m + self.rear_m

    def heading_error_rad(self, speed_mps: float) -> float:
        """Heading error per curvature (rad m) with which the car drives a bend without lateral error."""
        slip = self.front_m * self.mass_kg * speed_mps**2 / (self.rear_npr * self.wheelbase_m)
        return slip - self.rear_m

    def steering_rad(self, speed_mps: float, curvature_per_m: float) -> float:
        """Front-wheel angle of a steady bend, understeer included."""
        gradient = self.mass_kg / self.wheelbase_m * (self.rear_m / self.front_npr - self.front_m / self.rear_npr)
        return curvature_per_m * (self.wheelbase_m + gradient * speed_mps**2)


@dataclass(frozen=True, slots=True)
class ErrorModel:
    """x' = A x + b u + d kappa over one period.

    Attributes:
        transition: A, (5, 5).
        steering: b, (5,): per commanded front-wheel angle, rad.
        curvature: d, (5,): per path curvature, 1/m.
    """

    transition: Array
    steering: Array
    curvature: Array


def error_model(car: BicycleParameters, speed_mps: float, dt_s: float) -> ErrorModel:
    """The model at a constant speed, discretised exactly (zero-order hold)."""
    v, m, inertia = max(speed_mps, SLOWEST_MPS), car.mass_kg, car.inertia_kgm2
    cf, cr, lf, lr = car.front_npr, car.rear_npr, car.front_m, car.rear_m
    turning, spinning = cf * lf - cr * lr, cf * lf * lf + cr * lr * lr
    whole = np.zeros((STATES + 2, STATES + 2))
    whole[0, 1] = whole[2, 3] = 1.0
    whole[1, 1:5] = -(cf + cr) / (m * v), (cf + cr) / m, -turning / (m * v), cf / m
    whole[3, 1:5] = -turning / (inertia * v), turning / inertia, -spinning / (inertia * v), cf * lf / inertia
    whole[4, 4], whole[4, 5] = -1.0 / car.lag_s, 1.0 / car.lag_s
    whole[1, 6], whole[3, 6] = (-turning / (m * v) - v) * v, -spinning / inertia
    exact = exponential(whole * dt_s)
    return ErrorModel(exact[:5, :5], exact[:5, 5], exact[:5, 6])


def exponential(matrix: Array) -> Array:
    """Matrix exponential by scaling and squaring of its Taylor series; for small matrices."""
    squarings = max(0, math.ceil(math.log2(max(float(np.abs(matrix).sum(axis=1).max()), 1e-300))) + 2)
    small = matrix / 2.0**squarings
    term = total = np.eye(len(matrix))
    for order in range(1, 14):
        term = term @ small / order
        total = total + term
    for _ in range(squarings):
        total = total @ total
    return total
