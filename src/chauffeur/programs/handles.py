"""Opaque handles: what a program holds instead of a vehicle or a lane.

A handle is a string that the host gave to this very program. It carries no authority of its own: the host looks it up
in the table of what it handed out, so a made-up one is refused, and there is no object behind it to reach into.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, TypeVar

from chauffeur.concept import LaneId
from chauffeur.programs.errors import BadArgumentTypeError, BadArgumentValueError

VEHICLE_PREFIX: Final = "veh:"
LANE_PREFIX: Final = "lane:"

_T = TypeVar("_T")


def vehicle_handle(vehicle_id: int) -> str:
    """Handle of a vehicle, e.g. `veh:3`."""
    return f"{VEHICLE_PREFIX}{vehicle_id}"


def lane_handle(lane: LaneId) -> str:
    """Handle of a lane, e.g. `lane:a-b:1`."""
    return f"{LANE_PREFIX}{lane}"


class HandleTable:
    """What one program has been handed out so far."""

    def __init__(self) -> None:
        self._vehicles: dict[str, int] = {}
        self._lanes: dict[str, LaneId] = {}

    def give_vehicle(self, vehicle_id: int) -> str:
        """Handle for a vehicle, known from now on."""
        handle = vehicle_handle(vehicle_id)
        self._vehicles[handle] = vehicle_id
        return handle

    def give_lane(self, lane: LaneId) -> str:
        """Handle for a lane, known from now on."""
        handle = lane_handle(lane)
        self._lanes[handle] = lane
        return handle

    def vehicle(self, handle: object, where: str) -> int:
        """Vehicle id behind a handle.

        Args:
            handle: What the program passed.
            where: API and parameter, for the message.

        Raises:
            BadArgumentTypeError: It is not a vehicle handle.
            BadArgumentValueError: It looks like one, but was never handed out.
        """
        source = "vehicles come from get_ego_vehicle() or detect_front_vehicle_in()"
        return _given(self._vehicles, handle, where, "vehicle", VEHICLE_PREFIX, source)

    def lane(self, handle: object, where: str) -> LaneId:
        """Lane behind a handle.

        Args:
            handle: What the program passed.
            where: API and parameter, for the message.

        Raises:
            BadArgumentTypeError: It is not a lane handle.
            BadArgumentValueError: It looks like one, but was never handed out.
        """
        source = "lanes come from get_lane_of(), get_left_lane() or get_right_lane()"
        return _given(self._lanes, handle, where, "lane", LANE_PREFIX, source)

    def issued(self) -> tuple[list[int], list[LaneId]]:
        """Vehicles and lanes handed out, for a dump of the program."""
        return list(self._vehicles.values()), list(self._lanes.values())


def _given(table: Mapping[str, _T], handle: object, where: str, kind: str, prefix: str, source: str) -> _T:
    """What was handed out under a handle; the errors are those of `HandleTable.vehicle` and `HandleTable.lane`."""
    if isinstance(handle, str):
        known = table.get(handle)
        if known is not None:
            return known
        if handle.startswith(prefix):
            raise BadArgumentValueError(f"{where}: {handle[:40]!r} is no {kind} this program was given")
    raise BadArgumentTypeError(f"{where} must be a {kind}, not {describe(handle)}; {source}")


def describe(value: object) -> str:
    """A value in a few words, whatever its size: a program's value is never rendered whole."""
    if value is None:
        return "None (test for None first)"
    if isinstance(value, bool):
        return f"{value}"
    if isinstance(value, int):
        return f"the number {value}" if value.bit_length() <= 64 else "a very large number"
    if isinstance(value, float):
        return f"the number {value:g}"
    if isinstance(value, str):
        if value.startswith(VEHICLE_PREFIX):
            return "a vehicle"
        if value.startswith(LANE_PREFIX):
            return "a lane"
        return f"the text {value[:30]!r}"
    return f"a {type(value).__name__}"
