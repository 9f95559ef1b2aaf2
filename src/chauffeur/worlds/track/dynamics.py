"""CommonRoad's vehicle models, compiled: single-track (ST), single-track with drift (STD), multi-body (MB).

Source: M. Althoff, G. Würsching, "CommonRoad: Vehicle Models", 2020; package `commonroad-vehicle-models`. The installed
functions are read, their parameters become constants (vehicle 2, a BMW 320i) and a friction factor, and numba compiles
them: no code of theirs is copied, and a model costs microseconds. Interpreted, the multi-body model manages some six
times real time, which a benchmark of hundreds of drives cannot wait for.
"""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
from collections.abc import Callable
from functools import cache
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import MissingExtraError

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
"""Where the angular speeds of the wheels are in the state."""
_FRICTION: Final = frozenset({"p_dx1", "p_dy1"})
"""Peak friction of a tyre, along and across: what wet and snow scale."""

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


def library_dynamics(plant: Plant) -> Callable[..., list[float]]:
    """The function as the library has it: (state, input, parameters) -> derivative."""
    parameters()
    if plant == "st":
        from vehiclemodels.vehicle_dynamics_st import vehicle_dynamics_st as found
    elif plant == "std":
        from vehiclemodels.vehicle_dynamics_std import vehicle_dynamics_std as found
    else:
        from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb as found
    return found


def deliverable(acceleration_mps2: float, friction: float) -> float:
    """What traction control and anti-lock brakes make of a wanted acceleration, m/s2. The models have neither."""
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
    import numba

    entry = library_dynamics(plant)
    names: dict[str, Any] = {"math": math, "np": np}
    return _compiled(entry, parameters(), names, numba.njit)


def _compiled(function: Any, root: Any, names: dict[str, Any], jit: Any) -> Any:
    """A library function with what it calls, its parameter object replaced by constants and the friction factor."""
    home = inspect.getmodule(function)
    tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    assert isinstance(tree, ast.FunctionDef)
    fixed = _Fixed(tree.args.args[-1].arg, root, home, names, jit)
    tree = fixed.visit(tree)
    tree.args.args[-1].arg = "friction"
    tree.body = tree.body[1:] if isinstance(tree.body[0], ast.Expr) else tree.body
    module = ast.fix_missing_locations(ast.Module([tree], []))
    exec(compile(module, f"<{function.__name__}>", "exec"), names)  # noqa: S102 - an installed library's own source
    names[function.__name__] = compiled = jit(error_model="numpy")(names[function.__name__])
    return compiled


class _Fixed(ast.NodeTransformer):
    """Writes a function's parameters into it."""

    def __init__(self, name: str, root: Any, home: Any, names: dict[str, Any], jit: Any) -> None:
        self._name, self._root, self._home, self._names, self._jit = name, root, home, names, jit

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """p.tire.p_dy1 -> its value, times the friction factor where it is one."""
        found = self._value(node)
        if found is None or not isinstance(found, int | float):
            return self.generic_visit(node)
        value: ast.expr = ast.Constant(float(found))
        if node.attr in _FRICTION:
            value = ast.BinOp(value, ast.Mult(), ast.Name("friction", ast.Load()))
        return value

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """tire_model.formula_lateral(..., p.tire) -> formula_lateral(..., friction), compiled with these parameters."""
        if node.args and self._is_parameters(node.args[-1]):
            helper = self._helper(node.func)
            inner = self._root if isinstance(node.args[-1], ast.Name) else self._value(node.args[-1])
            if helper.__name__ not in self._names:
                _compiled(helper, inner, self._names, self._jit)
            arguments = [self.visit(one) for one in node.args[:-1]]
            return ast.Call(ast.Name(helper.__name__, ast.Load()), [*arguments, ast.Name("friction", ast.Load())], [])
        if isinstance(node.func, ast.Name) and inspect.isfunction(found := getattr(self._home, node.func.id, None)):
            self._names.setdefault(found.__name__, self._jit(error_model="numpy")(found))
        return self.generic_visit(node)

    def _helper(self, node: ast.expr) -> Any:
        if isinstance(node, ast.Name):
            return getattr(self._home, node.id)
        assert isinstance(node, ast.Attribute)
        assert isinstance(node.value, ast.Name)
        return getattr(getattr(self._home, node.value.id), node.attr)

    def _is_parameters(self, node: ast.expr) -> bool:
        if isinstance(node, ast.Name):
            return node.id == self._name
        found = self._value(node) if isinstance(node, ast.Attribute) else None
        return found is not None and not isinstance(found, int | float)

    def _value(self, node: ast.expr) -> Any:
        """What an attribute of the parameters is; None for anything else."""
        path: list[str] = []
        while isinstance(node, ast.Attribute):
            path.append(node.attr)
            node = node.value
        if not (isinstance(node, ast.Name) and node.id == self._name):
            return None
        found = self._root
        for attribute in reversed(path):
            found = getattr(found, attribute)
        return found


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
