"""Traffic brakes for an ego in its way, and for nobody else."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from chauffeur.concept import VehicleState
from chauffeur.geometry import Box, overlap
from chauffeur.worlds.town.brakes import BRAKING_MPS2, TrafficBrakes
from chauffeur.worlds.town.sumo import Mover

DT = 0.05


def ego(speed: float = 0.0) -> VehicleState:
    return VehicleState(0, "car", 0.0, 0.0, 0.0, speed, 4.9, 2.1, None)


def one(x: float, y: float, heading: float, speed: float, name: str = "v1") -> Mover:
    return Mover(name, "car", x, y, heading, speed, 0.0, "e_0")


class Road:
    """Writes down who was held, and to what speed."""

    def __init__(self) -> None:
        self.held: dict[str, float] = {}

    def hold(self, name: str, speed_mps: float | None) -> None:
        self.held[name] = math.nan if speed_mps is None else speed_mps


@pytest.fixture
def road() -> Any:
    return Road()


@pytest.mark.parametrize(
    ("mover", "brakes"),
    [
        (one(-9.0, 0.0, 0.0, 6.0), True),  # from behind
        (one(-25.0, 0.0, 0.0, 6.0), False),  # still far
        (one(-45.0, 1.5, 0.0, 22.0), True),  # as far, and fast
        (one(-75.0, 1.5, 0.0, 22.0), False),  # so far that even the fast need not yet
        (one(0.0, -7.0, math.pi / 2.0, 6.0), True),  # from the side
        (one(0.0, -4.5, math.pi / 2.0, 0.0), False),  # stands
        (one(-9.0, 3.5, 0.0, 6.0), False),  # passes in the lane beside
        (one(9.0, 3.5, math.pi, 6.0), False),  # comes the other way in its own lane
        (one(8.0, 0.0, 0.0, 2.0), False),  # drives away ahead
    ],
)
def test_who_would_touch_the_ego_brakes(road: Any, mover: Mover, brakes: bool) -> None:
    TrafficBrakes(road, DT).mind(ego(), [mover])
    assert road.held == ({mover.name: pytest.approx(mover.speed_mps - BRAKING_MPS2 * DT)} if brakes else {})


def test_who_is_fast_stands_before_an_ego_whose_nose_is_in_its_lane(road: Any) -> None:
    brakes = TrafficBrakes(road, DT)
    x, speed = -120.0, 22.0
    for _ in range(400):
        brakes.mind(ego(), [one(x, 1.8, 0.0, speed)])
        held = road.held.get("v1", math.nan)
        speed = min(22.0, speed + 2.0 * DT) if math.isnan(held) else held
        x += speed * DT
        assert not overlap(ego().box, Box(x, 1.8, 0.0, 4.6, 1.85))
    assert speed < 0.5


def test_who_turns_into_a_standing_ego_stops_before_it_and_goes_on_when_it_is_gone(road: Any) -> None:
    """A left turn from ahead across the ego, as SUMO drives it: with the right of way, and no eye for the ego."""
    brakes = TrafficBrakes(road, DT)
    x, y, heading, speed = 11.0, 3.2, math.pi, 4.0
    for _ in range(120):
        brakes.mind(ego(), [one(x, y, heading, speed)])
        held = road.held.get("v1", math.nan)
        speed = min(4.0, speed + 2.0 * DT) if math.isnan(held) else held
        heading += speed / 9.0 * DT
        x, y = x + speed * math.cos(heading) * DT, y + speed * math.sin(heading) * DT
        assert not overlap(ego().box, Box(x, y, heading, 4.6, 1.85))
    assert speed < 0.5
    far = replace(ego(), x_m=200.0)
    brakes.mind(far, [one(x, y, heading, speed)])
    assert math.isnan(road.held["v1"])
