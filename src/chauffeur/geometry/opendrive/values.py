"""Attributes of an OpenDRIVE file as numbers within sense, and the list of what could not be taken as written."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, TypeVar

if TYPE_CHECKING:
    from xml.etree import ElementTree as ET

MOST_M: Final = 2.1e7
"""Largest coordinate or length: the widest of usual projections (Web Mercator, UTM) end at 2.004e7 m."""
MOST_ROAD_M: Final = 1e5
"""Longest road: files of whole motorways cut them at junctions, tens of kilometres apart."""
MOST_LANE_ID: Final = 1000
_MOST_LIMIT_MPS: Final = 100.0
"""No sign says 360 km/h."""
_LEAST_ODD_MPS: Final = 45.0
"""Without a unit a speed is in m/s, yet no sign says more than 162 km/h: such a number was meant in km/h."""
_MPS: Final = {
    **dict.fromkeys(("m/s", "mps"), 1.0),
    **dict.fromkeys(("km/h", "kmh", "kph", "kmph", "km/hr", "km/hour"), 1.0 / 3.6),
    **dict.fromkeys(("mph", "mi/h", "mi/hr", "miles/h"), 0.44704),
}
_WRITTEN_UNITS: Final = frozenset({"m/s", "km/h", "mph"})
"""As the standard spells them."""
_SPEED: Final = re.compile(r"([-+]?[0-9]{1,12}(?:\.[0-9]{1,30})?(?:[eE][-+]?[0-9]{1,3})?) ?([a-zA-Z/]{0,12})")
_NO_LIMIT: Final = frozenset({"no limit", "undefined", ""})
_T = TypeVar("_T")
_PLACES: Final = 3
"""Places that a remark names; of more it gives the number."""


class OpenDriveError(ValueError):
    """The file is no OpenDRIVE, or says something that cannot be read; the message says where."""


class Remarks:
    """Remarks on what was skipped or reinterpreted, each kind once, with its first places.

    Attributes:
        dropped: Elements that were left out.
    """

    def __init__(self) -> None:
        self._places: dict[str, dict[str, int]] = {}
        self.dropped: list[ET.Element] = []

    def add(self, what: str, where: str) -> None:
        """Note one, e.g. ("a speed in 'knots' is left out", "road '1'")."""
        places = self._places.setdefault(what, {})
        places[where] = places.get(where, 0) + 1

    def told(self) -> tuple[str, ...]:
        """A sentence a kind."""
        return tuple(f"{what[:1].upper()}{what[1:]}: {_listed(places)}." for what, places in self._places.items())

    def tried(self, where: str, read: Callable[[], _T], node: ET.Element | None = None) -> _T | None:
        """Result of a reader; None, with a remark, if it raises OpenDriveError, so that only that record is lost.

        Args:
            where: Which record, for people.
            read: The reader.
            node: The element that is left out with it.
        """
        try:
            return read()
        except OpenDriveError as error:
            self.add(f"left out, since {str(error).rstrip('.')}", where)
            if node is not None:
                self.dropped.append(node)
            return None


def _listed(places: dict[str, int]) -> str:
    named = [where if count == 1 else f"{where} ({count} times)" for where, count in list(places.items())[:_PLACES]]
    more = len(places) - len(named)
    return ", ".join(named) + (f" and {more} more" if more else "")


def quoted(text: str) -> str:
    """Foreign text for a message, cut where it is long."""
    return repr(text if len(text) <= 60 else text[:57] + "...")


def number(
    node: ET.Element, key: str, default: float | None = None, low: float = -MOST_M, high: float = MOST_M
) -> float:
    """A number of an attribute, within [low, high]. Raises OpenDriveError where it is missing, none or beyond."""
    text = node.get(key)
    if text is None:
        if default is None:
            raise OpenDriveError(f"<{node.tag}> has no {key!r}.")
        return default
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise OpenDriveError(f"<{node.tag}> has {key}={quoted(text)}, which is no number.")
    if not low <= value <= high:
        raise OpenDriveError(f"<{node.tag}> has {key}={quoted(text)}; from {low:g} to {high:g} makes sense.")
    return value


def lane_id(node: ET.Element, key: str = "id") -> int:
    """Number of a lane. Raises OpenDriveError where it is missing or none."""
    value = number(node, key, low=-MOST_LANE_ID, high=MOST_LANE_ID)
    if value != int(value):
        raise OpenDriveError(f"<{node.tag}> has {key}={quoted(node.get(key, ''))}, which is no lane.")
    return int(value)


def offset_m(node: ET.Element, where: str, remarks: Remarks) -> float | None:
    """Start of a lane record from its section's start, m; None, with a remark, if it is no number."""
    return remarks.tried(where, lambda: number(node, "sOffset", 0.0), node)


def linked_lane(node: ET.Element | None, where: str, remarks: Remarks) -> int | None:
    """The lane that a link names; None, as written, for an empty one."""
    if node is None:
        return None
    if not (node.get("id") or "").strip():
        remarks.dropped.append(node)
        return None
    return remarks.tried(where, lambda: lane_id(node), node)


def speed_mps(text: str, unit: str) -> float | None:
    """A written speed; None for no limit. Raises OpenDriveError where it is no speed.

    A unit that stands with the number counts where there is none of its own.
    """
    if text.strip().casefold() in _NO_LIMIT:
        return None
    found = _SPEED.fullmatch(text.strip())
    if found is None:
        raise OpenDriveError(f"a speed of {quoted(text)} is none")
    name = (unit.strip() or found[2]).casefold()
    if name and name not in _MPS:
        raise OpenDriveError(f"a speed in {quoted(unit or found[2])} is of no known unit")
    value = float(found[1])
    speed = value * (_MPS[name] if name else 1.0 if value <= _LEAST_ODD_MPS else 1.0 / 3.6)
    if not 0.0 <= speed <= _MOST_LIMIT_MPS:
        raise OpenDriveError(f"a speed of {quoted(text)} {unit or found[2] or 'm/s'} makes no sense")
    return speed if speed > 0.0 else None


def speed_of(node: ET.Element | None, where: str, remarks: Remarks) -> float | None:
    """The limit of a `<speed>`, None without one; an unusual spelling of it becomes a usual one."""
    if node is None:
        return None
    text, unit = node.get("max", ""), node.get("unit", "")
    speed = remarks.tried(where, lambda: speed_mps(text, unit), node)
    if speed is not None and unit not in _WRITTEN_UNITS:
        node.attrib.update(max=repr(speed), unit="m/s")
    return speed
