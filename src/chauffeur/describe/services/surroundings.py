"""What is known of the place a car is at, as values and in words for the driving context C."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, TypeVar

from chauffeur.describe.services.maxspeed import Conditional
from chauffeur.describe.services.readings import Position, ServiceReading, Unknown
from chauffeur.describe.services.road_map import RoadAhead
from chauffeur.describe.services.roads import Limit, ServiceRoad
from chauffeur.describe.services.rules import Rules
from chauffeur.describe.services.traffic import TrafficReport
from chauffeur.describe.services.units import age_words, distance_words, speed_words
from chauffeur.describe.services.weather import Weather

T = TypeVar("T")

_YOUNG_S: Final = 60.0
"""Ages below are not worth a word."""
_OLD_MAP_S: Final = 400.0 * 86_400.0
"""The age of a map is told in C when it is above this."""
_OLD_RULES_S: Final = 800.0 * 86_400.0
_SLOW: Final = 0.75
_JAM: Final = 0.35
"""Below these parts of the free speed, traffic is called slow, and jammed."""
_WINDY_MPS: Final = 8.0
_ON_RED: Final = {"after_stop": "after a stop", "where_signed": "only where a sign allows it"}
_INSIDE: Final = {"allowed": "is allowed", "restricted": "is allowed only at times", "forbidden": "is not allowed"}


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What services, map and rules know of a place.

    Attributes:
        at: The place.
        when_s: Unix time of this description.
        weather, road, limit, ahead, traffic, rules: What is known, or why it is not.
    """

    at: Position
    when_s: float
    weather: ServiceReading[Weather] | Unknown
    road: ServiceReading[ServiceRoad] | Unknown
    limit: ServiceReading[Limit] | Unknown
    ahead: ServiceReading[RoadAhead] | Unknown
    traffic: ServiceReading[TrafficReport] | Unknown
    rules: ServiceReading[Rules] | Unknown

    def words(self) -> tuple[str, ...]:
        """One line for each thing that C says. Of a service's own wording only names are in them, quoted."""
        return tuple(words for _, words in self.scene())

    def scene(self) -> tuple[tuple[str, str], ...]:
        """The same lines, each with its name, as `Situation.scene` takes them."""
        rules = self.rules.value if isinstance(self.rules, ServiceReading) else None
        return (
            ("weather", _line("Weather", self.weather, lambda value: weather_words(value, self.when_s), _YOUNG_S)),
            ("road", _line("Road", self.road, road_words, _OLD_MAP_S)),
            ("speed limit", _line("Speed limit", self.limit, lambda value: limit_words(value, rules), _OLD_MAP_S)),
            ("next junction", _line("Next junction", self.ahead, lambda value: ahead_words(value, rules), _OLD_MAP_S)),
            ("traffic", _line("Traffic", self.traffic, lambda value: traffic_words(value, rules), _YOUNG_S)),
            ("traffic rules", _line("Traffic rules", self.rules, rules_words, _OLD_RULES_S)),
        )

    def rows(self) -> tuple[Row, ...]:
        """Every number that is known, one a row; and a row for each thing that is not."""
        return (
            *_rows("weather", self.weather, _weather_cells),
            *_rows("road", self.road, _road_cells),
            *_rows("speed_limit", self.limit, _limit_cells),
            *_rows("next_junction", self.ahead, lambda value: (("", value.junction_m, "m"),)),
            *_rows("traffic", self.traffic, _traffic_cells),
            *_rows("rules", self.rules, lambda value: (("", value.name, ""),)),
        )


@dataclass(frozen=True, slots=True)
class Row:
    """One thing that is known, or not, for tables and records.

    Attributes:
        name: What it is.
        value: The value; None where it is not known, or where there is none (no limit in force, no junction in view).
        unit: Its unit; empty for words.
        source: Who told it; empty where it is not known.
        age_s: How old it is; None where nobody said.
        confidence: 0 to 1.
        note: What is wrong with it, or why it is not known.
    """

    name: str
    value: float | str | None
    unit: str
    source: str
    age_s: float | None
    confidence: float
    note: str


def _line(name: str, known: ServiceReading[T] | Unknown, say: Callable[[T], str], young_s: float) -> str:
    if isinstance(known, Unknown):
        return f"{name}: not known ({known.reason})."
    age = f" {age_words(known.age_s)} old" if known.age_s is not None and known.age_s >= young_s else ""
    newer = f" (nothing newer: {known.note})" if known.note else ""
    return f"{name}{age}: {say(known.value)}{newer}."


def weather_words(weather: Weather, now_s: float) -> str:
    """The weather in words: conditions, then what a driver feels of it."""
    parts = [*weather.conditions]
    if weather.rain_mm_per_h:
        parts.append(f"rain {weather.rain_mm_per_h:.1f} mm/h")
    if weather.snow_mm_per_h:
        parts.append(f"snow {weather.snow_mm_per_h:.1f} mm/h")
    if weather.temperature_c is not None:
        parts.append(f"{weather.temperature_c:.0f} °C".replace("-0 ", "0 "))
    if weather.visibility_m is not None:
        least = "at least " if weather.more_visibility else ""
        parts.append(f"visibility {least}{_visibility(weather.visibility_m)}")
    if weather.wind_mps is not None and max(weather.wind_mps, weather.gust_mps or 0.0) >= _WINDY_MPS:
        gusts = f" with gusts of {weather.gust_mps:.0f} m/s" if (weather.gust_mps or 0.0) > weather.wind_mps else ""
        parts.append(f"wind {weather.wind_mps:.0f} m/s{gusts}")
    night = weather.night(now_s)
    if night is not None:
        parts.append("night" if night else "daylight")
    return ", ".join(parts)


def _visibility(visibility_m: float) -> str:
    return f"{visibility_m / 1000.0:.1f} km" if visibility_m >= 1_000.0 else f"{visibility_m:.0f} m"


def road_words(road: ServiceRoad) -> str:
    """A road in words."""
    parts = [f"{road.road_class.replace('_', ' ')}{f' {road.name}' if road.name else ''}"]
    if road.lanes is not None:
        lanes = "1 lane" if road.lanes == 1 else f"{road.lanes} lanes"
        parts.append(lanes if road.oneway else f"{lanes} in both directions together")
    parts.append("one way" if road.oneway else "both ways")
    return ", ".join(parts)


def limit_words(limit: Limit, rules: Rules | None) -> str:
    """A limit in words, and where it comes from."""
    if limit.speed_mps is None:
        advised = "" if limit.advisory_mps is None else f"; {_both(limit.advisory_mps, rules)} is recommended"
        words = f"unrestricted here{advised}"
    else:
        words = _both(limit.speed_mps, rules)
    words += {"map": "", "zone": " (by law in such a place)", "default": " (a default)"}[limit.origin]
    if limit.detail:
        words += f"; {limit.detail}"
    times = [f"{_conditional(one, rules)} when {one.condition}" for one in limit.conditional]
    return f"{words}; at times {', '.join(times)}" if times else words


def _conditional(one: Conditional, rules: Rules | None) -> str:
    return speed_words(one.limit.speed_mps, rules) if one.limit.speed_mps is not None else "another one"


def _both(speed_mps: float, rules: Rules | None) -> str:
    return f"{speed_words(speed_mps, rules)} ({speed_mps:.1f} m/s)"


def ahead_words(ahead: RoadAhead, rules: Rules | None) -> str:
    """How far the next junction is, in words."""
    if ahead.junction_m is not None:
        return f"in {distance_words(ahead.junction_m, rules)}"
    return f"none on the next {distance_words(ahead.seen_m, rules)}, as far as the map shows the road"


def traffic_words(traffic: TrafficReport, rules: Rules | None) -> str:
    """How traffic flows, in words."""
    if traffic.closed:
        return "the road is closed"
    part = traffic.speed_mps / traffic.free_mps
    flowing, free = speed_words(traffic.speed_mps, rules), speed_words(traffic.free_mps, rules)
    if part >= _SLOW:
        return f"free, at {flowing}"
    return f"{'jammed' if part < _JAM else 'slow'}, at {flowing} where {free} is usual"


def rules_words(rules: Rules) -> str:
    """The rules of a region in words."""
    red = rules.turn_on_red
    turn = f"a turn to the {red.way} {_ON_RED[red.rule]}" if red.rule != "never" else "no turn"
    inside = rules.overtaking_inside
    slow_side = "left" if rules.side == "left" else "right"
    keep = "the law asks for" if rules.following.binding else "recommended are"
    return (
        f"{rules.name}: traffic keeps {rules.side}; signs are in {rules.unit}; on red {turn}{_note(red.note)}; "
        f"overtaking on the {slow_side} {_INSIDE[inside.rule]}{_note(inside.note)}; "
        f"{keep} at least {rules.following.seconds:g} s to the vehicle ahead"
    )


def _note(note: str | None) -> str:
    return f" ({note})" if note else ""


Cells = tuple[tuple[str, float | str | None, str], ...]


def _rows(name: str, known: ServiceReading[T] | Unknown, cells: Callable[[T], Cells]) -> Iterator[Row]:
    if isinstance(known, Unknown):
        yield Row(name, None, "", "", None, 0.0, known.reason)
        return
    for inner, value, unit in cells(known.value):
        if value is None and inner:  # a detail that was not told
            continue
        full = f"{name}.{inner}" if inner else name
        yield Row(full, value, unit, known.source, known.age_s, known.confidence, known.note)


def _weather_cells(weather: Weather) -> Cells:
    return (
        ("conditions", ", ".join(weather.conditions) or None, ""),
        ("temperature", weather.temperature_c, "°C"),
        ("visibility", weather.visibility_m, "m"),
        ("rain", weather.rain_mm_per_h, "mm/h"),
        ("snow", weather.snow_mm_per_h, "mm/h"),
        ("wind", weather.wind_mps, "m/s"),
        ("gusts", weather.gust_mps, "m/s"),
    )


def _road_cells(road: ServiceRoad) -> Cells:
    return (
        ("class", road.road_class, ""),
        ("name", road.name or None, ""),
        ("lanes", None if road.lanes is None else float(road.lanes), "lanes"),
        ("direction", "one way" if road.oneway else "both ways", ""),
    )


def _limit_cells(limit: Limit) -> Cells:
    return (("", limit.speed_mps, "m/s"), ("origin", limit.origin, ""), ("detail", limit.detail or None, ""))


def _traffic_cells(traffic: TrafficReport) -> Cells:
    return (
        ("speed", traffic.speed_mps, "m/s"),
        ("free_speed", traffic.free_mps, "m/s"),
        ("closed", "yes" if traffic.closed else "no", ""),
    )
