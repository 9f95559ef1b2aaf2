"""A car on the test track: CommonRoad's vehicle models (`vehicle_models`) with actuators, integrated.

Parameters are those of vehicle 2, a BMW 320i, from the package `commonroad-vehicle-models`. numba compiles the
models: one costs microseconds; interpreted, the multi-body model manages some six times real time, which a benchmark of
hundreds of drives cannot wait for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import MissingExtraError
from chauffeur.worlds.track.vehicle_models import derivative

Array = NDArray[np.float64]
Plant = Literal["st", "std", "mb"]
PLANTS: Final[tuple[Plant, ...]] = "st", "std", "mb"

STEP_S: Final = 0.001
"""Runge-Kutta step: with 10 ms the multi-body model yields no numbers, and the drift model a jerk that is none."""
STEERING_LAG_S: Final = 0.1
DRIVE_LAG_S: Final = 0.2
CREEP_MPS: Final = 0.5
"""Slower than this, a car rolls without slip: the models divide by the speed, and the multi-body one is not defined for
a car that stands."""
_VEHICLE: Final = 2
_WHEELS: Final[dict[Plant, tuple[int, int]]] = {"st": (7, 7), "std": (7, 9), "mb": (23, 27)}
"""Slice of the wheels' angular speeds in the state."""

TRACTION_MPS2: Final = 3.9
"""Hardest acceleration on a dry road that traction control lets through: half the weight is on driven wheels."""
BRAKES_MPS2: Final = 8.0
"""Hardest braking on a dry road that its anti-lock brakes let through."""

Dynamics = Callable[[Array, Array, float], Array]
"""(state (n,), (steering velocity rad/s, acceleration m/s2), friction factor) -> derivative (n,)."""


@cache
def parameters() -> Any:
    """CommonRoad's parameters of the vehicle, not to be changed. Raises MissingExtraError: they are not installed."""
    try:
        from vehiclemodels.vehicle_parameters import setup_vehicle_parameters
    except ImportError as error:
        raise MissingExtraError("The test track needs CommonRoad's vehicle models.", extra="motion") from error
    return setup_vehicle_parameters(vehicle_id=_VEHICLE)


def deliverable(acceleration_mps2: float, friction: float) -> float:
    """Limit a wanted acceleration, m/s2, as traction control and anti-lock brakes do. The models have neither."""
    return min(max(acceleration_mps2, -BRAKES_MPS2 * friction), TRACTION_MPS2 * friction)


def initial_state(plant: Plant, x_m: float, y_m: float, heading_rad: float, speed_mps: float) -> Array:
    """State of a car that drives straight on: ST (7,), STD (9,), MB (29,). Raises MissingExtraError."""
    known = parameters()
    from vehiclemodels.init_mb import init_mb
    from vehiclemodels.init_std import init_std

    core = [x_m, y_m, 0.0, speed_mps, heading_rad, 0.0, 0.0]
    if plant == "std":
        core = init_std(core, known)
    elif plant == "mb":
        core = init_mb(core, known)
    return np.array(core, dtype=np.float64)


@cache
def dynamics(plant: Plant) -> Dynamics:
    """A model's derivative, compiled."""
    return derivative(plant, parameters())


@cache
def advance(plant: Plant, step_s: float = STEP_S) -> Callable[..., float]:
    """Compiled integration of one model with its actuators, with a Runge-Kutta step of `step_s`.

    (state (n,), acceleration m/s2, friction, commanded angle rad, commanded acceleration m/s2, steps) -> acceleration

    The state is changed in place. Steering and drive are first-order lags; the wheel turns no faster than the model's
    own limit. Runge-Kutta of fourth order.
    """
    import numba

    derivative: Any = dynamics(plant)
    car = parameters()
    first, last = _WHEELS[plant]
    turn, wheelbase, radius = float(car.steering.v_max), float(car.a + car.b), float(car.R_w)

    def integrate(state: Array, acceleration: float, friction: float, angle: float, wanted: float, steps: int) -> float:
        u = np.zeros(2)
        h = step_s
        count = len(state)
        held = np.zeros(count)
        sums = np.zeros(count)
        work = np.zeros(count)
        for _ in range(steps):
            acceleration += h / DRIVE_LAG_S * (wanted - acceleration)
            u[0] = (angle - state[2]) / STEERING_LAG_S
            u[1] = acceleration if state[3] > 0.0 or acceleration > 0.0 else 0.0
            if state[3] < CREEP_MPS:
                state[2] += h * min(max(u[0], -turn), turn)
                state[3] = max(0.0, state[3] + h * u[1])
                state[0] += h * state[3] * math.cos(state[4])
                state[1] += h * state[3] * math.sin(state[4])
                state[5] = state[3] * math.tan(state[2]) / wheelbase
                state[4] += h * state[5]
                for i in range(first, last):
                    state[i] = state[3] / radius
                continue
            held[:] = state
            sums[:] = state
            work[:] = state
            for part in range(4):
                slope = derivative(work, u, friction)
                share = h / 6.0 if part in (0, 3) else h / 3.0
                ahead = h / 2.0 if part < 2 else h
                for i in range(count):
                    sums[i] += share * slope[i]
                    work[i] = held[i] + ahead * slope[i]
            state[:] = sums
            state[3] = max(state[3], 0.0)
        return acceleration

    return numba.njit(error_model="numpy")(integrate)
