"""Speed limits as OpenStreetMap writes them.

Source: the pages Key:maxspeed, Key:maxspeed:type, Key:source:maxspeed and Conditional restrictions of the OSM wiki.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept.units import MPS_PER_KMH, MPS_PER_KNOT, MPS_PER_MPH
from chauffeur.describe.services.outside import quoted

MAX_LIMIT_MPS: Final = 200.0 * MPS_PER_KMH
"""No country signs more than 160 km/h; a higher number is a mistake in the map."""

_MAX_CHARS: Final = 255
"""Longest value OSM's database keeps."""
_CONDITIONS: Final = 4
_CONDITION_CHARS: Final = 50

_NUMBER: Final = re.compile(r"(\d{1,3}(?:\.\d{1,3})?)\s{0,3}(km/?h|kmph|kph|mph|knots?|kn)?", re.ASCII)
_ZONE: Final = re.compile(r"([a-z]{2}(?:-[a-z]{2,3})?):([a-z0-9][a-z0-9_:.\-]{0,30})", re.ASCII)
_ZONE_NUMBER: Final = re.compile(r"(?:zone)?:?(\d{1,3})", re.ASCII)
_MILES: Final = ("gb", "us", "im", "je", "gg")
"""Countries whose signs are in miles per hour."""


@dataclass(frozen=True, slots=True)
class Maxspeed:
    """One value of a `maxspeed` tag, read.

    Attributes:
        kind: `speed` a number; `none` no limit is in force; `signals` signs over the road show it; `walk` walking pace;
            `zone` what the law says in such a place, e.g. `DE:urban`; `unreadable` anything else.
        speed_mps: Of `speed`: the limit. Where the tag gives several, the lowest.
        zone: Of `zone`: (country, kind of place), in lower case.
        several: Whether the tag gives more than one number.
    """

    kind: Literal["speed", "none", "signals", "walk", "zone", "unreadable"]
    speed_mps: float | None = None
    zone: tuple[str, str] = ("", "")
    several: bool = False


@dataclass(frozen=True, slots=True)
class Conditional:
    """A limit that holds under a condition.

    Attributes:
        limit: The limit.
        condition: When it holds, quoted from the map.
    """

    limit: Maxspeed
    condition: str


@dataclass(frozen=True, slots=True)
class Signed:
    """What a way's tags say of the limit in one direction.

    Attributes:
        limit: The limit; None where the tags give none.
        conditional: Other limits at other times.
        variable: Whether signs over the road may show another one.
    """

    limit: Maxspeed | None
    conditional: tuple[Conditional, ...] = ()
    variable: bool = False


def read_maxspeed(text: str) -> Maxspeed:
    """A value of a `maxspeed` tag. Never raises; what is not understood is `unreadable`."""
    if len(text) > _MAX_CHARS:
        return Maxspeed("unreadable")
    found = [_one(piece.strip()) for piece in re.split(r"[;|,]", text.lower()) if piece.strip()]
    speeds = [one.speed_mps for one in found if one.speed_mps is not None]
    if speeds:
        return Maxspeed("speed", min(speeds), several=len(set(speeds)) > 1)
    known = [one for one in found if one.kind != "unreadable"]
    return known[0] if known else Maxspeed("unreadable")


def _one(text: str) -> Maxspeed:
    if text in ("none", "signals", "walk"):
        return Maxspeed(text)
    if text in ("variable", "signs"):
        return Maxspeed("signals")
    if match := _NUMBER.fullmatch(text):
        return _speed(float(match[1]), match[2] or "km/h")
    if match := _ZONE.fullmatch(text):
        if in_zone := _ZONE_NUMBER.fullmatch(match[2]):
            return _speed(float(in_zone[1]), "mph" if match[1][:2] in _MILES else "km/h")
        return Maxspeed("zone", zone=(match[1], match[2]))
    return Maxspeed("unreadable")


def _speed(value: float, unit: str) -> Maxspeed:
    factor = MPS_PER_MPH if unit == "mph" else MPS_PER_KNOT if unit.startswith("kn") else MPS_PER_KMH
    speed_mps = value * factor
    return Maxspeed("speed", speed_mps) if 0.0 < speed_mps <= MAX_LIMIT_MPS else Maxspeed("unreadable")


def limit_signed(tags: Mapping[str, str], forward: bool | None) -> Signed:
    """What a way's tags say of the limit.

    Args:
        tags: The way's tags.
        forward: Whether the car drives in the direction in which the way was drawn; None where that is not known.
            Then the lower of the two directions' limits is given.
    """
    sides = ("forward", "backward") if forward is None else ("forward" if forward else "backward",)
    given = [read_maxspeed(tags[f"maxspeed:{side}"]) for side in sides if f"maxspeed:{side}" in tags]
    if "maxspeed" in tags and (not given or (forward is None and len(given) == 1)):
        given.append(read_maxspeed(tags["maxspeed"]))
    if not given:
        given = [
            zone
            for key in ("maxspeed:type", "source:maxspeed", "zone:maxspeed", "zone:traffic")
            if (zone := read_maxspeed(tags.get(key, ""))).kind in ("zone", "speed")
        ][:1]
    variable = tags.get("maxspeed:variable", "no") not in ("no", "") or any(one.kind == "signals" for one in given)
    others = [
        one
        for key in ("maxspeed:conditional", *(f"maxspeed:{side}:conditional" for side in sides))
        for one in _conditional(tags.get(key, ""))
    ]
    return Signed(_lowest(given), tuple(others[:_CONDITIONS]), variable)


def _lowest(given: list[Maxspeed]) -> Maxspeed | None:
    speeds = [one for one in given if one.speed_mps is not None]
    if speeds:
        best = min(speeds, key=lambda one: one.speed_mps or 0.0)
        return Maxspeed("speed", best.speed_mps, several=best.several or len({one.speed_mps for one in speeds}) > 1)
    return given[0] if given else None


def _conditional(text: str) -> list[Conditional]:
    """`VALUE @ (CONDITION); VALUE @ CONDITION`: semicolons inside of parentheses belong to the condition."""
    found: list[Conditional] = []
    for piece in re.split(r";(?![^()]{0,255}\))", text[:_MAX_CHARS]):
        value, at, condition = piece.partition("@")
        limit = read_maxspeed(value.strip())
        words = condition.strip().removeprefix("(").removesuffix(")").strip()
        if at and words and limit.kind != "unreadable":
            found.append(Conditional(limit, quoted(words, _CONDITION_CHARS)))
    return found
