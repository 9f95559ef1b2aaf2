"""Compiles the shield's machine code before any test is timed."""

from __future__ import annotations

import pytest

from chauffeur.concept import Command, Observation, VehicleState
from chauffeur.safety.shield import Shield
from roads import a_lane, a_road


@pytest.fixture(scope="session", autouse=True)
def _machine_code() -> None:
    for points in (((0.0, 0.0), (9.0, 0.0)), ((0.0, 0.0), (1.0, 0.0), (2.0, 0.1), (3.0, 0.4))):
        lane = a_lane("a-b:0", points)
        ego = VehicleState(0, "car", 1.0, 0.0, 0.0, 5.0, 5.0, 2.0, lane.id)
        Shield(0.1).filter(
            Observation(0.0, 0, "highway", ego, (), (), a_road((lane,)), None, None, False, False), Command(0.0, 0.0)
        )
