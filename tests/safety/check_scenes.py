"""A road, an ego on it, and plans to be judged."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from chauffeur.concept import (
    Lead,
    Limits,
    Observation,
    Parameters,
    Plan,
    Policy,
    Program,
    Thoughts,
    VehicleState,
    Verdict,
)
from chauffeur.safety.base import Check
from roads import a_lane, a_road

LIMIT_MPS = 30.0
"""Speed limit of the ego's road; the road across has 20 m/s."""


def snap(
    *, lanes: int = 3, index: int | None = 1, kind: str = "highway", front: Lead | None = None,
    speed: float = 25.0, limits: tuple[float, ...] = (), road: bool = True,
) -> Observation:  # fmt: skip
    """The ego in a lane of a road; `index` None puts it in none, and `road` False takes the road away."""
    views = tuple(
        a_lane(f"a-b:{i}", ((0.0, 0.0), (1.0, 0.0)), limit=limits[i] if limits else LIMIT_MPS) for i in range(lanes)
    )
    other = a_lane("ir0-il0:0" if kind == "intersection" else "b-a:0", ((1.0, 0.0), (0.0, 0.0)), limit=20.0)
    lane = None if index is None else f"a-b:{index}"
    ego = VehicleState(0, "car", 0.0, 0.0, 0.0, speed, 5.0, 2.0, lane)
    return Observation(0.0, 0, kind, ego, (), (), a_road((other, *views) if road else ()), front, None, False, False)


def plan(policy: Policy | Any = None, **fields: Any) -> Plan:
    """A plan without thoughts."""
    return Plan(Thoughts(""), policy, **fields)


def program(body: str, library: str = "") -> Program:
    """A program that does something in its first period; `body` begins in line 3."""
    lines = "".join(f"    {line}\n" for line in body.splitlines())
    source = f"def policy():\n    ego = get_ego_vehicle()\n{lines}    yield autopilot()\n"
    return Program(source, library=library)


def parameters(lane: Any = 0, speed: Any = 20.0, ahead: Any = 20.0, ratio: Any = 1.0, route: str = "") -> Parameters:
    """Good parameters, but for what is given."""
    return Parameters(speed, ahead, ratio, lane, route)


def judged_by(check: Check, name: str) -> Callable[..., Verdict]:
    """A check whose every verdict has its name, a reason, and a remedy where it refuses."""

    def judge(plan: Plan, observation: Observation, limits: Limits = Limits()) -> Verdict:  # noqa: B008
        verdict = check(plan, observation, limits)
        assert verdict.check == name
        assert verdict.reason
        assert bool(verdict.remedy) is not verdict.passed
        return verdict

    return judge
