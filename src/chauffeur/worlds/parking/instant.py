"""An instant of a lot as bytes: what changes from step to step, so that a copy of the lot elsewhere can be there.

One record for the ego, then one for each car on its way out, each person on foot, and the cars that were touched.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

from chauffeur.concept import DataError
from chauffeur.geometry import Pose
from chauffeur.worlds.parking.actors import CarMoved, LeavingCar, LotWalker

_HEAD: Final = struct.Struct("<QdddddBBBH")
"""Tick; rear axle, speed and wheel of the ego; whether it has crashed; how many records follow of each kind."""
_CAR: Final = struct.Struct("<Hdd?d")
_WALKER: Final = struct.Struct("<Hddd???")
_HIT: Final = struct.Struct("<H")
_MOST_TICK: Final = 1 << 40


@dataclass(slots=True)
class Ego:
    """The car: its rear axle, speed, and the angle of its front wheels."""

    rear: Pose
    speed_mps: float
    steering_rad: float = 0.0
    crashed: bool = False


@dataclass(frozen=True, slots=True)
class ParkingInstant:
    """State of all moving agents."""

    tick: int
    ego: Ego
    cars: tuple[LeavingCar, ...]
    walkers: tuple[LotWalker, ...]
    hit: frozenset[int]


def pack(tick: int, ego: Ego, cars: Iterable[LeavingCar], walkers: Iterable[LotWalker], hit: Iterable[int]) -> bytes:
    """An instant as bytes."""
    there = [(car.id, *car.moved()) for car in cars]
    afoot = list(walkers)
    touched = sorted(hit)
    rear = ego.rear
    parts = [
        _HEAD.pack(
            tick, rear.x_m, rear.y_m, rear.heading_rad, ego.speed_mps, ego.steering_rad, ego.crashed,
            len(there), len(afoot), len(touched),
        )
    ]  # fmt: skip
    for number, station, speed, crashed, located in there:
        parts.append(_CAR.pack(number, station, speed, crashed, math.nan if located is None else located))
    for one in afoot:
        parts.append(_WALKER.pack(one.id, one.way_m, one.waits_s, one.kept_s, one.outward, one.walks, one.crashed))
    parts.extend(_HIT.pack(number) for number in touched)
    return b"".join(parts)


def unpack(
    payload: bytes, cars: Iterable[LeavingCar], walkers: Iterable[LotWalker], parked: Iterable[int]
) -> ParkingInstant:
    """From bytes.

    Args:
        payload: What `pack` made.
        cars: Who left the lot in this trip, at any instant.
        walkers: Who is on foot in it, at any instant.
        parked: Ids of the cars that stand in it.

    Raises:
        DataError: It is no instant of this trip.
    """
    if len(payload) < _HEAD.size:
        raise DataError("An observation ends too early.")
    tick, x, y, heading, speed, steering, crashed, moving, afoot, touched = _HEAD.unpack_from(payload)
    if len(payload) != _HEAD.size + moving * _CAR.size + afoot * _WALKER.size + touched * _HIT.size:
        raise DataError("A state of another lot.")
    at = _HEAD.size
    by_id, on_foot, standing = {car.id: car for car in cars}, {one.id: one for one in walkers}, frozenset(parked)
    numbers = [x, y, heading, speed, steering]
    there: list[LeavingCar] = []
    people: list[LotWalker] = []
    for _ in range(moving):
        number, station, car_speed, hit_it, located = _CAR.unpack_from(payload, at)
        at += _CAR.size
        if number not in by_id:
            raise DataError("A state of another lot.")
        numbers += [station, car_speed]
        moved = CarMoved(station, car_speed, hit_it, None if math.isnan(located) else located)
        there.append(by_id[number].moved_to(moved))
    for _ in range(afoot):
        number, way, waits, kept, outward, walks, hit_them = _WALKER.unpack_from(payload, at)
        at += _WALKER.size
        if number not in on_foot:
            raise DataError("A state of another lot.")
        numbers += [way, waits, kept]
        people.append(
            replace(
                on_foot[number], way_m=way, waits_s=waits, kept_s=kept, outward=outward, walks=walks, crashed=hit_them
            )
        )
    hit = frozenset(_HIT.unpack_from(payload, at + i * _HIT.size)[0] for i in range(touched))
    if tick > _MOST_TICK or len(people) != len(on_foot) or not hit <= standing or not all(map(math.isfinite, numbers)):
        raise DataError("A state of another lot.")
    ego = Ego(Pose(x, y, heading), speed, steering, bool(crashed))
    return ParkingInstant(tick, ego, tuple(there), tuple(people), hit)
