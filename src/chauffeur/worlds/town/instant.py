"""An instant of a town as bytes: what changes from period to period, so that a copy elsewhere can be there."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from pydantic import TypeAdapter, ValidationError

from chauffeur.concept import DataError, SignalState, VehicleState
from chauffeur.geometry import LaneId
from chauffeur.worlds.town.course import Course

MOST_BYTES: Final = 60_000
"""Of an instant: who is farthest is left out of a larger one."""


@dataclass(frozen=True, slots=True)
class TownInstant:
    """The part of a town's state that changes from instant to instant.

    Attributes:
        tick: Control periods since the trip began.
        ego, others: Who is where.
        lane, station_m: Of the ego.
        off_road, over: Whether it left the road, and whether nothing moves any more.
        forced: Lights that show something else than their cycles say.
        place, stood: The place that was set out for; the one that was reached, and where the car stood.
        course: The driver's.
    """

    tick: int
    ego: VehicleState
    others: tuple[VehicleState, ...]
    lane: LaneId | None
    station_m: float
    off_road: bool
    over: bool
    forced: dict[str, SignalState]
    place: str
    stood: tuple[str, float, float] | None
    course: Course

    def encode(self) -> bytes:
        """As bytes, the nearest road users where there are too many."""
        payload = _instants.dump_json(self, exclude_defaults=True)
        if len(payload) <= MOST_BYTES:
            return payload
        near = sorted(self.others, key=lambda one: math.hypot(one.x_m - self.ego.x_m, one.y_m - self.ego.y_m))
        return replace(self, others=tuple(near[: len(near) // 2])).encode()

    @classmethod
    def decode(cls, payload: bytes) -> TownInstant:
        """From bytes. Raises DataError."""
        try:
            return _instants.validate_json(payload)
        except (ValidationError, ValueError, RecursionError) as error:
            raise DataError(f"An instant of a town is not as it should be: {type(error).__name__}.") from error


_instants: Final = TypeAdapter(TownInstant)
