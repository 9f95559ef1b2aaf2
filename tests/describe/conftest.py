"""Hand-made observations: a straight highway and the four-way intersection of the benchmark."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from chauffeur.concept import Lane, LaneId, Lead, Observation, VehicleState
from roads import a_lane, a_road


def lane(
    lane_id: LaneId,
    centre: tuple[tuple[float, float], ...] = ((0.0, 0.0), (1000.0, 0.0)),
    *,
    limit: float = 31.2928,
    emergency: bool = False,
) -> Lane:
    return a_lane(lane_id, centre, limit=limit, closed=emergency, emergency=emergency)


def ego(lane_id: LaneId | None, speed: float) -> VehicleState:
    return VehicleState(0, "car", 0.0, 0.0, 0.0, speed, 5.0, 2.0, lane_id)


@pytest.fixture
def highway() -> Callable[..., Observation]:
    def make(
        *, lanes: int = 4, index: int = 1, emergency: bool = False, front: Lead | None = None, speed: float = 31.26
    ) -> Observation:
        road = tuple(lane(f"c-d:{i}", emergency=emergency and i == lanes - 1) for i in reversed(range(lanes)))
        elsewhere = (lane("a-b:0"), lane("j-k:0", limit=24.5872), lane("d-c:0"))
        return Observation(
            0.0,
            0,
            "highway",
            ego(f"c-d:{index}", speed),
            (),
            (),
            a_road((*elsewhere, *road)),
            front,
            None,
            False,
            False,
        )

    return make


CROSSING = (
    lane("o0-ir0:0", ((2.0, -111.0), (2.0, -11.0)), limit=10.0),
    lane("ir0-il3:0", ((2.0, -11.0), (5.0, -4.0), (11.0, -2.1), (11.1, -2.1)), limit=10.0),
    lane("ir0-il1:0", ((2.0, -11.0), (-4.0, 0.0), (-11.0, 2.0), (-11.1, 2.0)), limit=10.0),
    lane("ir0-il2:0", ((2.0, -11.0), (2.0, 11.0)), limit=10.0),
    lane("il1-o1:0", ((-11.0, 2.0), (-111.0, 2.0)), limit=10.0),
    lane("o1-ir1:0", ((-111.0, -2.0), (-11.0, -2.0)), limit=10.0),
)


@pytest.fixture
def crossing() -> Callable[..., Observation]:
    def make(
        *,
        on: LaneId | None = "o0-ir0:0",
        stop_sign: float | None = 85.0,
        lanes: tuple[Lane, ...] = CROSSING,
        kind: str = "intersection",
    ) -> Observation:
        return Observation(0.0, 0, kind, ego(on, 10.0), (), (), a_road(lanes), None, stop_sign, False, False)

    return make
