"""highway-env's own road, lane and vehicle classes under our scenes: what the quicker ones are tested against.

The quicker classes (`traffic.py`) keep every result and save time; with the plain ones a scene costs what highway-env
costs anybody.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from functools import partial
from typing import Any, ClassVar

from highway_env.road.lane import StraightLane
from highway_env.road.regulation import RegulatedRoad
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.dynamics import BicycleVehicle

from highway_oracle import scenes


class _PlainNetwork(RoadNetwork):
    def freeze(self) -> None:
        """Nothing to prepare."""


class _PlainRoad(Road):
    def forget_instant(self) -> None:
        """Nothing is remembered."""


class _PlainRegulatedRoad(RegulatedRoad):
    def forget_instant(self) -> None:
        """Nothing is remembered."""


class _PlainDynamicEgo(BicycleVehicle):
    MAX_SPEED: ClassVar[float] = 15.0


@contextmanager
def plain_highway_env(*, record_history: bool = False) -> Generator[None]:
    """Scenes built meanwhile consist of highway-env's own classes; a ReferenceWorld reset inside goes on with them.

    Args:
        record_history: Whether vehicles keep their last 30 states for display, as in LaMPilot's environments.
    """
    plain: dict[str, Any] = {
        "AxisLane": StraightLane,
        "FastNetwork": _PlainNetwork,
        "FastRoad": partial(_PlainRoad, record_history=record_history),
        "FastRegulatedRoad": partial(_PlainRegulatedRoad, record_history=record_history),
        "DynamicEgo": _PlainDynamicEgo,
    }
    ours = {name: getattr(scenes, name) for name in plain}
    try:
        for name, value in plain.items():
            setattr(scenes, name, value)
        yield
    finally:
        for name, value in ours.items():
            setattr(scenes, name, value)
