"""Lateral model predictive control (paper Eq. 25): steer a linear bicycle along a path within what the wheels can do.

    J = sum over the horizon of  Wl e_y^2 + Wh (e_psi - e_ss)^2 + Ws (delta_k - delta_{k-1})^2
    |delta_k| <= most at that speed,  |delta_k - delta_{k-1}| <= rate dt

Wl and Wh are in W_Q, Ws in W_R of Eq. 25; its control input is the increment of the steering angle. e_ss is the heading
error of a steady bend, so that a bend is no reason for lateral error. States are condensed out; the unknowns are the
commanded front-wheel angles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from chauffeur.control.bicycle import STATES, Array, BicycleParameters, error_model
from chauffeur.control.qp import QpSolver, osqp_solver

HORIZON: Final = 30
SPEED_STEP_MPS: Final = 0.5
"""Prediction models are made for every half metre a second, and kept."""
_HELD_PERIODS: Final = 5
"""How many periods in a row the solution before may stand in for one that was not found."""


class MpcWeights(NamedTuple):
    """Row two of the action matrix (paper Eq. 22): lateral error (1/m2), heading error and steering (1/rad2)."""

    lateral: float
    heading: float
    steering: float


@dataclass(frozen=True, slots=True)
class SteeringLimits:
    """Limits of steering angle and rate.

    Attributes:
        angle_rad: Full lock.
        rate_radps: Fastest turn of the front wheels.
        lateral_mps2: Sideways acceleration no command asks for in steady state; tyres slide beyond.
    """

    angle_rad: float = 0.6
    rate_radps: float = 0.4
    lateral_mps2: float = 6.0


class PathErrors(NamedTuple):
    """Tracking errors: e_y (m, left positive), its rate, e_psi (rad), its rate."""

    lateral_m: float
    lateral_mps: float
    heading_rad: float
    heading_radps: float


@dataclass(frozen=True, slots=True)
class Condensed:
    """Predictions of a horizon as functions of state, steering and curvature, and their cost.

    Attributes:
        quadratic: P, (n, n).
        state, curvature, before: q = state x + curvature kappa + before delta_before; (n, 5), (n, n), (n,).
    """

    quadratic: Array
    state: Array
    curvature: Array
    before: Array


def condense(
    car: BicycleParameters, weights: MpcWeights, speed_mps: float, dt_s: float, horizon: int = HORIZON
) -> Condensed:
    """The quadratic program of Eq. 25 at a speed, states condensed out."""
    model = error_model(car, speed_mps, dt_s)
    powers = [np.eye(STATES)]
    for _ in range(horizon):
        powers.append(model.transition @ powers[-1])
    answers = np.array([power @ model.steering for power in powers[:-1]])  # (n, 5): to an angle, so many periods later
    bends = np.array([power @ model.curvature for power in powers[:-1]])
    late = np.subtract.outer(np.arange(horizon), np.arange(horizon))
    causal, late = late >= 0, np.maximum(late, 0)
    by_state = np.array(powers[1:])
    step = np.eye(horizon) - np.eye(horizon, k=-1)
    quadratic = weights.steering * step.T @ step
    state, curvature = np.zeros((horizon, STATES)), np.zeros((horizon, horizon))
    for row, weight, steady in (
        (0, weights.lateral, 0.0),
        (2, weights.heading, car.heading_error_rad(speed_mps)),
    ):
        by_steering = np.where(causal, answers[late, row], 0.0)
        by_bend = np.where(causal, bends[late, row], 0.0) - steady * np.eye(horizon)
        weighted = weight * by_steering.T
        quadratic = quadratic + weighted @ by_steering
        state += weighted @ by_state[:, row, :]
        curvature += weighted @ by_bend
    before = np.zeros(horizon)
    before[0] = -weights.steering
    return Condensed(2.0 * quadratic, 2.0 * state, 2.0 * curvature, 2.0 * before)


Source = Literal["solved", "previous", "none"]


class MpcStep(NamedTuple):
    """Commanded front-wheel angle, rad, and its source; `none` leaves steering to the caller."""

    steering_rad: float
    source: Source


MakeSolver = Callable[[Array, Array], QpSolver]
"""(P, A) -> solver."""


class LateralMpc:
    """Keeps what one trip needs from step to step: prediction models, the solver and its last solution."""

    def __init__(
        self,
        weights: MpcWeights,
        dt_s: float,
        car: BicycleParameters | None = None,
        limits: SteeringLimits | None = None,
        *,
        horizon: int = HORIZON,
        make_solver: MakeSolver | None = None,
    ) -> None:
        """Args: row two of the action matrix; period; believed car; limits; periods foreseen; solver, default OSQP.

        Raises:
            MissingExtraError: OSQP was to solve and is not installed: said here, before anything moves.
        """
        self.car = BicycleParameters() if car is None else car
        self.limits = SteeringLimits() if limits is None else limits
        self.dt_s, self.horizon = dt_s, horizon
        self._weights = weights
        self._make_solver = osqp_solver() if make_solver is None else make_solver
        self._models: dict[int, Condensed] = {}
        self._solver: QpSolver | None = None
        self._speed = -1
        self._last = np.zeros(horizon)
        self._held = 0
        eye = np.eye(horizon)
        self._constraints = np.vstack([eye, eye - np.eye(horizon, k=-1)])
        self._turn = np.full(horizon, self.limits.rate_radps * dt_s)

    def most_rad(self, speed_mps: float) -> float:
        """Largest front-wheel angle that may be commanded at a speed."""
        v = max(speed_mps, 0.1)
        return min(self.limits.angle_rad, abs(self.car.steering_rad(v, self.limits.lateral_mps2 / v**2)))

    def program(
        self, errors: PathErrors, curvatures: Array, speed_mps: float, wheel_rad: float, before_rad: float
    ) -> tuple[Condensed, Array, Array, Array]:
        """(P and its makers, q, low, high) of a step; arguments as of `steer`."""
        bin_ = round(max(speed_mps, 0.0) / SPEED_STEP_MPS)
        model = self._models.get(bin_)
        if model is None:
            model = condense(self.car, self._weights, bin_ * SPEED_STEP_MPS, self.dt_s, self.horizon)
            self._models[bin_] = model
        linear = model.state @ np.array([*errors, wheel_rad]) + model.curvature @ curvatures + model.before * before_rad
        most = self.most_rad(speed_mps)
        # Where full lock shrinks faster than the wheel turns, the way down to it is allowed.
        down = np.maximum(most, abs(before_rad) - self._turn * np.arange(1, self.horizon + 1))
        low, high = np.concatenate([-down, -self._turn]), np.concatenate([down, self._turn])
        low[self.horizon] += before_rad
        high[self.horizon] += before_rad
        return model, linear, low, high

    def steer(
        self, errors: PathErrors, curvatures: Array, speed_mps: float, wheel_rad: float, before_rad: float
    ) -> MpcStep:
        """Command for one period.

        Args:
            errors: Of the centre of mass, beside the path.
            curvatures: Of the path where the car will be in each period of the horizon, (n,), 1/m, left positive.
            speed_mps: Speed.
            wheel_rad: Front-wheel angle now.
            before_rad: Angle commanded in the period before.
        """
        model, linear, low, high = self.program(errors, curvatures, speed_mps, wheel_rad, before_rad)
        if not np.isfinite(linear).all():
            return self._without(before_rad)
        bin_ = round(max(speed_mps, 0.0) / SPEED_STEP_MPS)
        if self._solver is None:
            self._solver = self._make_solver(model.quadratic, self._constraints)
        elif bin_ != self._speed:
            self._solver.cost(model.quadratic)
        self._speed = bin_
        start = np.append(self._last[1:], self._last[-1])
        found = self._solver.solve(linear, low, high, start)
        if found is None or not np.isfinite(found).all():
            return self._without(before_rad)
        self._last, self._held = found, 0
        return MpcStep(self._kept(float(found[0]), before_rad), "solved")

    def _without(self, before_rad: float) -> MpcStep:
        """The solution before, moved on by a period, for a few periods."""
        self._held += 1
        self._last = np.append(self._last[1:], self._last[-1])
        if self._held > _HELD_PERIODS:
            return MpcStep(before_rad, "none")
        return MpcStep(self._kept(float(self._last[0]), before_rad), "previous")

    def _kept(self, angle_rad: float, before_rad: float) -> float:
        """An angle within the wheels' rate: a solver is exact to its tolerance only."""
        turn = float(self._turn[0])
        return min(max(angle_rad, before_rad - turn, -self.limits.angle_rad), before_rad + turn, self.limits.angle_rad)
