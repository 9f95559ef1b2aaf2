"""A road, an ego on it, and plans to be judged."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from chauffeur.concept import Command, LaneView, Lead, Plan, Policy, Snapshot, Thoughts, VehicleState
from chauffeur.safety.shield import Shield

LIMIT = 30.0


@pytest.fixture(scope="session", autouse=True)
def _machine_code() -> None:
    """The shield's compiled parts are made before any test is timed."""
    for points in (((0.0, 0.0), (9.0, 0.0)), ((0.0, 0.0), (1.0, 0.0), (2.0, 0.1), (3.0, 0.4))):
        lane = LaneView(("a", "b", 0), 4.0, 9.0, LIMIT, False, False, points)
        ego = VehicleState(0, "car", 1.0, 0.0, 0.0, 5.0, 5.0, 2.0, lane.id)
        Shield(0.1).guard(
            Snapshot(0.0, 0, "highway", ego, (), (), (lane,), None, None, False, False), Command(0.0, 0.0)
        )


@pytest.fixture
def snap() -> Callable[..., Snapshot]:
    def make(
        *, lanes: int = 3, index: int | None = 1, kind: str = "highway", front: Lead | None = None,
        speed: float = 25.0, limits: tuple[float, ...] = (), road: bool = True,
    ) -> Snapshot:  # fmt: skip
        views = tuple(
            LaneView(("a", "b", i), 4.0, 1000.0, limits[i] if limits else LIMIT, False, False, ((0.0, 0.0), (1.0, 0.0)))
            for i in range(lanes)
        )
        other = LaneView(("b", "a", 0), 4.0, 1000.0, 20.0, False, False, ((1.0, 0.0), (0.0, 0.0)))
        lane = None if index is None else ("a", "b", index)
        ego = VehicleState(0, "car", 0.0, 0.0, 0.0, speed, 5.0, 2.0, lane)
        return Snapshot(0.0, 0, kind, ego, (), (), (other, *views) if road else (), front, None, False, False)

    return make


@pytest.fixture
def plan() -> Callable[..., Plan]:
    def make(policy: Policy | Any = None, **fields: Any) -> Plan:
        return Plan(Thoughts(""), policy, **fields)

    return make
