"""Lateral MPC: its program against another solver, its bounds, its fallbacks."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chauffeur.control.bicycle import BicycleParameters, error_model, exponential
from chauffeur.control.mpc import HORIZON, LateralMpc, MpcWeights, PathErrors, condense
from chauffeur.control.qp import Array

pytest.importorskip("osqp")
optimize = pytest.importorskip("scipy.optimize")
linalg = pytest.importorskip("scipy.linalg")

DT = 0.05
WEIGHTS = MpcWeights(10.0, 20.0, 100.0)


class Nothing:
    """A solver that never finds anything."""

    def cost(self, quadratic: Array) -> None: ...

    def solve(self, linear: Array, low: Array, high: Array, start: Array) -> Array | None:
        return None


def test_the_exponential_is_scipys() -> None:
    rng = np.random.default_rng(1)
    for scale in (0.01, 1.0, 30.0):
        matrix = rng.normal(size=(7, 7)) * scale
        assert exponential(matrix) == pytest.approx(linalg.expm(matrix), rel=1e-9, abs=1e-9 * np.exp(scale * 5))


def test_a_bend_without_lateral_error_is_a_steady_state() -> None:
    car, speed, bend = BicycleParameters(), 12.0, 0.02
    model = error_model(car, speed, DT)
    wheel = car.steering_rad(speed, bend)
    state = np.array([0.0, 0.0, bend * car.heading_error_rad(speed), 0.0, wheel])
    after = model.transition @ state + model.steering * wheel + model.curvature * bend
    assert after == pytest.approx(state, abs=1e-9)


@pytest.mark.parametrize("speed", [1.0, 8.33, 13.89, 30.0])
@pytest.mark.parametrize("seed", range(4))
def test_osqp_finds_what_another_solver_finds(seed: int, speed: float) -> None:
    """Active bounds included: half of the draws are far off the path."""
    rng = np.random.default_rng(seed)
    mpc = LateralMpc(WEIGHTS, DT)
    scale = 3.0 if seed % 2 else 0.2
    errors = PathErrors(*(rng.normal(size=4) * (scale, scale, 0.1 * scale, 0.1 * scale)).tolist())
    bends, before = rng.normal(size=HORIZON) * 0.01, float(rng.normal() * 0.05)
    model, linear, low, high = mpc.program(errors, bends, speed, before, before)
    eye = np.eye(HORIZON)
    rows = np.vstack([eye, eye - np.eye(HORIZON, k=-1)])
    oracle = optimize.minimize(
        lambda u: 0.5 * u @ model.quadratic @ u + linear @ u,
        np.full(HORIZON, before),
        jac=lambda u: model.quadratic @ u + linear,
        method="SLSQP",
        constraints=[
            {"type": "ineq", "fun": lambda u: rows @ u - low, "jac": lambda _: rows},
            {"type": "ineq", "fun": lambda u: high - rows @ u, "jac": lambda _: -rows},
        ],
        options={"maxiter": 500, "ftol": 1e-12},
    )
    step = mpc.steer(errors, bends, speed, before, before)
    assert step.source == "solved"
    assert step.steering_rad == pytest.approx(float(oracle.x[0]), abs=2e-4)


def test_it_drives_a_car_of_its_own_kind_onto_the_path() -> None:
    mpc, speed = LateralMpc(WEIGHTS, DT), 13.89
    model = error_model(mpc.car, speed, DT)
    state, angle = np.array([1.0, 0.0, 0.0, 0.0, 0.0]), 0.0
    for i in range(160):
        bends = np.full(HORIZON, 0.01 if i > 60 else 0.0)
        step = mpc.steer(PathErrors(*state[:4].tolist()), bends, speed, float(state[4]), angle)
        assert abs(step.steering_rad - angle) <= mpc.limits.rate_radps * DT + 1e-9
        assert abs(step.steering_rad) <= mpc.most_rad(speed) + 1e-4
        angle = step.steering_rad
        state = model.transition @ state + model.steering * angle + model.curvature * bends[0]
    assert abs(state[0]) < 0.01


def test_without_a_solution_the_one_before_is_held_and_then_it_gives_up() -> None:
    mpc = LateralMpc(WEIGHTS, DT, make_solver=lambda p, a: Nothing())
    found = [mpc.steer(PathErrors(1.0, 0.0, 0.0, 0.0), np.zeros(HORIZON), 10.0, 0.02, 0.02) for _ in range(7)]
    assert [step.source for step in found] == ["previous"] * 5 + ["none"] * 2
    assert all(abs(step.steering_rad) <= 0.04 for step in found)


def test_what_is_no_number_is_not_solved_for() -> None:
    mpc = LateralMpc(WEIGHTS, DT)
    step = mpc.steer(PathErrors(math.nan, 0.0, 0.0, 0.0), np.zeros(HORIZON), 10.0, 0.0, 0.01)
    assert step.source == "previous"
    assert math.isfinite(step.steering_rad)


def test_weights_count_by_their_ratios() -> None:
    bends = np.full(HORIZON, 0.01)
    once, thrice = (
        LateralMpc(MpcWeights(10.0 * k, 20.0 * k, 100.0 * k), DT).steer(
            PathErrors(0.3, 0.0, 0.0, 0.0), bends, 10.0, 0.0, 0.0
        )
        for k in (1.0, 3.0)
    )
    assert once.steering_rad == pytest.approx(thrice.steering_rad, abs=1e-4)


def test_the_program_is_linear_in_the_weights() -> None:
    parts = [condense(BicycleParameters(), MpcWeights(*row), 9.0, DT) for row in np.eye(3).tolist()]
    whole = condense(BicycleParameters(), WEIGHTS, 9.0, DT)
    assert sum(w * part.quadratic for w, part in zip(WEIGHTS, parts, strict=True)) == pytest.approx(whole.quadratic)
