"""A road, an ego on it, and plans to be judged."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from chauffeur.concept import Command, Lead, Observation, Plan, Policy, Thoughts, VehicleState
from chauffeur.safety.shield import Shield
from roads import a_lane, a_road

LIMIT = 30.0


@pytest.fixture(scope="session", autouse=True)
def _machine_code() -> None:
    """The shield's compiled parts are made before any test is timed."""
    for points in (((0.0, 0.0), (9.0, 0.0)), ((0.0, 0.0), (1.0, 0.0), (2.0, 0.1), (3.0, 0.4))):
        lane = a_lane("a-b:0", points, limit=LIMIT)
        ego = VehicleState(0, "car", 1.0, 0.0, 0.0, 5.0, 5.0, 2.0, lane.id)
        Shield(0.1).filter(
            Observation(0.0, 0, "highway", ego, (), (), a_road((lane,)), None, None, False, False), Command(0.0, 0.0)
        )


@pytest.fixture
def snap() -> Callable[..., Observation]:
    def make(
        *, lanes: int = 3, index: int | None = 1, kind: str = "highway", front: Lead | None = None,
        speed: float = 25.0, limits: tuple[float, ...] = (), road: bool = True,
    ) -> Observation:  # fmt: skip
        views = tuple(
            a_lane(f"a-b:{i}", ((0.0, 0.0), (1.0, 0.0)), limit=limits[i] if limits else LIMIT) for i in range(lanes)
        )
        other = a_lane("ir0-il0:0" if kind == "intersection" else "b-a:0", ((1.0, 0.0), (0.0, 0.0)), limit=20.0)
        lane = None if index is None else f"a-b:{index}"
        ego = VehicleState(0, "car", 0.0, 0.0, 0.0, speed, 5.0, 2.0, lane)
        return Observation(
            0.0, 0, kind, ego, (), (), a_road((other, *views) if road else ()), front, None, False, False
        )

    return make


@pytest.fixture
def plan() -> Callable[..., Plan]:
    def make(policy: Policy | Any = None, **fields: Any) -> Plan:
        return Plan(Thoughts(""), policy, **fields)

    return make
